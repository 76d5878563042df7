"""The evaluation as the launcher calls it: files, summary, exit code."""

import json
import re

import cv2
import pytest

from paramove.runs.rule_learning.__main__ import main
from tests.runs.conftest import ROOT
from tests.runs.synthetic_run import SyntheticRun


@pytest.fixture
def folder(tmp_path, robot, monkeypatch):
    monkeypatch.chdir(ROOT)
    return SyntheticRun(tmp_path, robot, view=True).write()


def test_successful_run_gets_numbers_report_and_video(folder, capsys):
    assert main([str(folder)]) == 0
    shown = capsys.readouterr().out
    assert "SUCCESS: 2 of 2" in shown.replace("\n", " ")
    assert str(folder / "report.html") in shown
    assert json.loads((folder / "run.json").read_text())["success"]
    page = (folder / "report.html").read_text()
    assert "Success: 2 of 2 objects" in page
    assert "data:video/mp4;base64," in page
    assert page.count("<svg") == 5
    assert not re.search(r"""(src|href)=["']?(http|file|/|\.)""", page), "it needs no other file"
    video = cv2.VideoCapture(str(folder / "demo.mp4"))
    frames = 0
    while video.read()[0]:
        frames += 1
    assert frames == 120 + 60  # all 120 views, and the last one for two seconds


def test_failed_run_exits_with_3_and_says_why(folder, capsys):
    verdict = json.loads((folder / "truth.json").read_text())
    verdict["objects"]["green"] |= {"success": False, "rests_in": ""}
    (folder / "truth.json").write_text(json.dumps(verdict | {"success": False, "placed": 1}))
    assert main([str(folder), "--no-video"]) == 3
    shown = capsys.readouterr().out
    assert "FAILURE: 1 of 2" in shown
    assert "green is in no opening" in shown
    assert not (folder / "demo.mp4").exists()
    assert "<video" not in (folder / "report.html").read_text()


def test_folder_without_a_run_is_refused(tmp_path, capsys):
    (tmp_path / "notes.txt").write_text("")
    assert main([str(tmp_path)]) == 66
    assert "holds no recording.mcap (notes.txt)" in capsys.readouterr().err


def test_text_of_a_run_cannot_break_the_page(folder):
    verdict = json.loads((folder / "truth.json").read_text())
    (folder / "truth.json").write_text(json.dumps(verdict | {"success": False, "reason": "<script>alert(1)</script>"}))
    assert main([str(folder), "--no-video"]) == 3
    assert "<script" not in (folder / "report.html").read_text()
