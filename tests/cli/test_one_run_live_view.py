"""`--view` adds the page to any choice of overlays and tells its link once."""

import json
import os
from pathlib import Path

import pytest

from paramove.cli import one_run as live_view
from paramove.cli import set_up_view
from paramove.dashboard.link_file import NAME, LinkFile
from paramove.supervision import application
from paramove.supervision.launch_file import load
from paramove.workspace import Workspace

ROOT = Path(__file__).parents[2]


class Shown:
    def __init__(self):
        self.stories, self.refreshed = [], 0

    def story(self, text):
        self.stories.append(text)

    def refresh(self, nodes):
        self.refreshed += 1


@pytest.mark.parametrize(
    ("overlays", "expected"),
    [(None, ["sim", "view", "page"]), (["sim", "real_time"], ["sim", "real_time", "view", "page"])],
)
def test_the_page_is_laid_over_what_was_chosen_and_fits(overlays, expected):
    found, title = live_view.with_page(Workspace.at(ROOT), "rule_learning", overlays)
    assert found == expected
    launch = load(Workspace.at(ROOT), "rule_learning", found, [title])
    application.check(launch, Workspace.at(ROOT))
    page = launch.file.nodes["dashboard"]
    assert page.parameters["title"] == launch.file.description
    assert not page.lockstep, "time never waits for a page"
    assert not page.truth


def test_the_link_of_each_process_is_told_once_and_no_browser_opens_without_a_display(tmp_path, monkeypatch):
    opened = []
    monkeypatch.setattr(set_up_view.webbrowser, "open", opened.append)
    monkeypatch.delenv("DISPLAY", raising=False)
    monkeypatch.delenv("WAYLAND_DISPLAY", raising=False)
    shown = Shown()
    view = live_view.AnnouncingView(shown, tmp_path)
    view.refresh([])
    assert shown.stories == []
    file = LinkFile.following(tmp_path, 4711)
    file.write()
    view.refresh([])
    view.refresh([])
    assert shown.stories == [f"live page: {file.link}"]
    assert shown.refreshed == 3
    path = tmp_path / NAME
    path.write_text(json.dumps({"link": "that of the next process", "pid": os.getpid() + 1}))
    view.refresh([])
    view.refresh([])
    assert shown.stories[1:] == ["live page: that of the next process"]
    assert opened == []
