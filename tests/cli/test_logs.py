"""`paramove logs` on the folder of a run."""

import json
import logging
import os
import pty
import subprocess
import sys

import pytest
from typer.testing import CliRunner

from paramove.bus.log_format import NodeFormatter, parse
from paramove.cli.main import build
from paramove.supervision.run_logs import RunLogs

CAMERA = """\
something that was printed
10.000001 2026-11-21T10:00:00.000001+00:00 INFO camera: ready: frames
12.000000 2026-11-21T10:00:02.000000+00:00 ERROR camera: the node raised an exception
Traceback (most recent call last):
ValueError: \x1b[31mred\x1b[0m\a
"""
TRACKER = "11.500000 2026-11-21T10:00:01.500000+00:00 WARNING tracker: no hand\n"
EVENTS = [
    {"monotonic_ns": 9 * 10**9, "wall": "2026-11-21T09:59:59.000000+00:00", "event": "started", "node": "camera"},
    {"monotonic_ns": 10 * 10**9, "wall": "2026-11-21T10:00:00.000000+00:00", "event": "ready", "node": "camera"},
    {
        "monotonic_ns": 13 * 10**9,
        "wall": "2026-11-21T10:00:03.000000+00:00",
        "event": "ended",
        "node": "camera",
        "state": "restarting",
        "sentence": "was killed (SIGKILL); restart 1 in 0.5 s",
    },
    {"monotonic_ns": 14 * 10**9, "wall": "2026-11-21T10:00:04.000000+00:00", "event": "run_ends", "exit_code": 0},
]


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "logs").mkdir()
    (tmp_path / "logs" / "camera.log").write_text(CAMERA)
    (tmp_path / "logs" / "tracker.log").write_text(TRACKER)
    (tmp_path / "events.jsonl").write_text("".join(json.dumps(event) + "\n" for event in EVENTS))
    return tmp_path


def run(*arguments):
    return CliRunner().invoke(build("logs"), ["logs", *map(str, arguments)])


def texts(done):
    assert done.exit_code == 0, done.output
    return [line[38:] for line in done.stdout.splitlines()]


def test_lines_of_all_nodes_come_in_the_order_of_time(folder):
    done = run("--run", folder)
    assert texts(done) == [
        "something that was printed",
        "camera is started, started",
        "ready: frames",
        "no hand",
        "the node raised an exception",
        "Traceback (most recent call last):",
        "ValueError: \\x1b[31mred\\x1b[0m\\x07",
        "camera was killed (SIGKILL); restart 1 in 0.5 s",
        "run ends",
    ]
    assert "10:00:01.500 tracker          WARNING no hand" in done.stdout


@pytest.mark.parametrize(
    ("options", "count"),
    [
        (["--level", "warn"], 6),
        (["--level", "error"], 3),
        (["--node", "tracker"], 1),
        (["--node", "tracker", "--node", "camera"], 8),
        (["--node", "camera", "--level", "error"], 3),
    ],
)
def test_choice(folder, options, count):
    assert len(texts(run("--run", folder, *options))) == count


def test_json(folder):
    lines = [json.loads(line) for line in run("--run", folder, "--json").stdout.splitlines()]
    assert lines[3] == {
        "monotonic_s": 11.5,
        "wall": "2026-11-21T10:00:01.500000+00:00",
        "node": "tracker",
        "level": "WARNING",
        "text": "no hand",
    }


def test_what_does_not_exist_is_named(folder):
    done = run("--run", folder, "--node", "lamp")
    assert done.exit_code == 2
    assert f"no log of lamp in {folder}; there are: camera, tracker" in done.output
    done = run("--run", folder / "none")
    assert done.exit_code == 66
    assert "holds no logs" in done.output


def test_newest_run_of_the_workspace_is_the_default(folder, tmp_path, monkeypatch):
    for name in ("launch", "nodes", "runs"):
        (tmp_path / name).mkdir()
    (tmp_path / "runs" / "latest").symlink_to(folder)
    monkeypatch.chdir(tmp_path / "nodes")
    assert len(texts(run())) == 9


def test_following_ends_with_the_run_and_never_shows_half_a_line(folder):
    events = folder / "events.jsonl"
    whole = events.read_text()
    events.write_text("")
    logs = RunLogs(folder)
    assert len(logs.read()) == 6
    with (folder / "logs" / "tracker.log").open("a") as file:
        file.write("15.000000 2026-11-21T10:00:05.000000+00:00 INFO tracker: half")
    assert logs.read() == []
    with (folder / "logs" / "tracker.log").open("a") as file:
        file.write(" and half\n")
    assert [line.text for line in logs.read()] == ["half and half"]
    assert not logs.ended
    events.write_text(whole)
    assert len(logs.read()) == 3
    assert logs.ended
    assert len(texts(run("--run", folder, "-f"))) == 10


@pytest.mark.parametrize("no_colour", [False, True])
def test_names_are_coloured_on_a_terminal_unless_not_wanted(folder, no_colour):
    terminal, end = pty.openpty()
    environment = {key: value for key, value in os.environ.items() if key != "NO_COLOR"}
    environment |= {"NO_COLOR": "1"} if no_colour else {}
    command = [sys.executable, "-m", "paramove.cli.main", "logs", "--run", str(folder)]
    assert subprocess.run(command, stdout=end, env=environment, check=False).returncode == 0
    os.close(end)
    shown = os.read(terminal, 65536)
    os.close(terminal)
    assert (b"\x1b[36mcamera" in shown) == (not no_colour)
    assert b"\x1b[31mred" not in shown


def test_closed_pipe_is_no_error(folder):
    with (folder / "logs" / "camera.log").open("a") as file:
        file.write("x\n" * 100_000)
    command = f"{sys.executable} -m paramove.cli.main logs --run {folder} | head -1"
    done = subprocess.run(["bash", "-o", "pipefail", "-c", command], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (0, "")


def test_what_a_node_logs_is_read_again():
    record = logging.LogRecord("x", logging.WARNING, "", 0, "no frame for %d s", (1,), None)
    found = parse(NodeFormatter("camera").format(record))
    assert found is not None
    assert (found.node, found.level, found.text) == ("camera", logging.WARNING, "no frame for 1 s")
    assert found.wall[10] == "T"
    assert parse("Traceback (most recent call last):") is None
