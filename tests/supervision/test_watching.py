"""Ends, stops and silence of nodes: seen, told in one sentence, and written into the log of events."""

import json
import os
import signal

import pytest

from paramove.documents import exit_codes
from paramove.supervision.events import EventLog, signal_name
from tests.recording.small_disk import fill, small_disk

MAIN = "  main: {module: nodes.silent_actor, ends_run: true, parameters: {lasts_s: %s}}\n"
LONG = MAIN % 1e6


def of(workspace, node):
    return [(event["event"], event["sentence"]) for event in workspace.happened if event.get("node") == node]


def ended(launcher):
    shown = launcher.communicate(timeout=60)[0]
    return launcher.returncode, shown


def test_killed_node_is_named_with_its_signal_and_comes_back(workspace):
    workspace.write("nodes:\n  camera: {module: nodes.silent_actor, restart: on-failure, backoff_s: 0.1}\n" + LONG)
    launcher = workspace.start()
    first = workspace.await_happening(launcher, "camera", "ready")
    os.kill(first["pid"], signal.SIGKILL)
    end = workspace.await_happening(launcher, "camera", "ended")
    assert end["sentence"] == "was killed (SIGKILL); restart 1 in 0.1 s"
    assert (end["pid"], end["exit_code"], end["signal"]) == (first["pid"], -9, "SIGKILL")
    workspace.await_event("camera ready", launcher)
    second = workspace.await_happening(launcher, "camera", "ready")
    while second["pid"] == first["pid"]:
        second = workspace.await_happening(launcher, "camera", "ready")
    assert first["monotonic_ns"] < end["monotonic_ns"] < second["monotonic_ns"]
    launcher.send_signal(signal.SIGINT)
    code, shown = ended(launcher)
    assert code == exit_codes.by_signal(signal.SIGINT)
    assert "camera           restarting  was killed (SIGKILL); restart 1 in 0.1 s" in shown
    assert workspace.happened[-1]["event"] == "run_ends"


def test_stopped_process_is_told_at_once_and_may_go_on(workspace):
    workspace.write("nodes:\n  camera: {module: nodes.silent_actor, stopped_timeout_s: 60}\n" + LONG)
    launcher = workspace.start()
    pid = workspace.await_happening(launcher, "camera", "ready")["pid"]
    os.kill(pid, signal.SIGSTOP)
    halt = workspace.await_happening(launcher, "camera", "suspended")
    assert halt["sentence"] == "is stopped (SIGSTOP); killed in 60 s unless it is continued"
    os.kill(pid, signal.SIGCONT)
    assert workspace.await_happening(launcher, "camera", "resumed")["sentence"] == "is continued"
    launcher.send_signal(signal.SIGTERM)
    ended(launcher)
    assert [event for event, _ in of(workspace, "camera")][-2:] == ["asked", "ended"]


def test_process_that_stays_stopped_is_killed_and_restarted(workspace):
    workspace.write(
        "nodes:\n  camera: {module: nodes.silent_actor, restart: on-failure, backoff_s: 0, stopped_timeout_s: 0.2}\n"
        + LONG
    )
    launcher = workspace.start()
    pid = workspace.await_happening(launcher, "camera", "ready")["pid"]
    os.kill(pid, signal.SIGSTOP)
    end = workspace.await_happening(launcher, "camera", "ended")
    assert end["sentence"] == "was stopped (SIGSTOP) for 0.2 s; restart 1 in 0 s"
    assert end["pid"] == pid
    launcher.send_signal(signal.SIGTERM)
    ended(launcher)


def test_stopped_process_ends_in_order_with_the_run(workspace):
    workspace.write("nodes:\n  camera: {module: nodes.silent_actor, stopped_timeout_s: null}\n" + LONG)
    launcher = workspace.start()
    pid = workspace.await_happening(launcher, "camera", "ready")["pid"]
    os.kill(pid, signal.SIGSTOP)
    assert workspace.await_happening(launcher, "camera", "suspended")["sentence"] == "is stopped (SIGSTOP)"
    launcher.send_signal(signal.SIGTERM)
    ended(launcher)
    assert workspace.await_happening(launcher, "camera", "ended")["exit_code"] == 0


def test_silent_node_is_killed_with_its_last_words(workspace):
    workspace.write("""
nodes:
  dreamer: {module: nodes.silent_actor, silent_timeout_s: 0.5, parameters: {silent: true}}
  talker: {module: nodes.silent_actor, silent_timeout_s: 5}
""")
    outcome, _, _ = workspace.run()
    assert outcome.code == exit_codes.FAILURE
    assert outcome.reason == (
        "dreamer hangs: no status for 0.5 s, last message: all set; the run cannot continue without it"
    )
    assert ("fault", "hangs: no status for 0.5 s, last message: all set, so it is killed") in of(workspace, "dreamer")


def test_run_ends_when_a_node_is_back_that_must_not_go_on(workspace):
    workspace.write(
        "nodes:\n  arm: {module: nodes.silent_actor, restart: on-failure, backoff_s: 0, restart_ends_run: true}\n"
        + LONG
    )
    launcher = workspace.start()
    pid = workspace.await_happening(launcher, "arm", "ready")["pid"]
    os.kill(pid, signal.SIGKILL)
    code, shown = ended(launcher)
    assert code == exit_codes.FAILURE
    assert "FAILED: arm was killed (SIGKILL) and is back: all set; the run has ended. Run folder" in shown


def test_run_ends_when_such_a_node_does_not_come_back(workspace):
    workspace.write(
        "nodes:\n"
        "  arm:\n"
        "    {module: nodes.silent_actor, restart: on-failure, backoff_s: 0, restart_ends_run: true,"
        " parameters: {crashes: 9}}\n" + LONG
    )
    outcome, _, _ = workspace.run()
    assert outcome.code == exit_codes.FAILURE
    assert outcome.reason == ("arm ended with exit code 1; it did not come back; the run cannot continue without it")
    assert workspace.events.count("arm started") == 2


@pytest.mark.parametrize(
    ("code", "detail"),
    [
        (0, "has finished"),
        (70, "ended with exit code 70"),
        (-9, "was killed (SIGKILL)"),
        (-11, "crashed (SIGSEGV)"),
        (-15, "was ended by SIGTERM"),
        (-40, "was ended by signal 40"),
    ],
)
def test_end_is_described_in_words_that_follow_a_name(code, detail):
    assert exit_codes.describe(code) == detail
    assert (signal_name(code) is None) == (code >= 0)


def test_log_of_events_outlives_a_full_disk(caplog):
    with EventLog("/dev/full") as events:
        for _ in range(2):
            events.write("ready", node="camera")
    assert [record.message for record in caplog.records] == [
        "the log of events cannot be written: No space left on device"
    ]


def test_log_of_events_goes_on_when_there_is_space_again(tmp_path):
    with small_disk(tmp_path / "disk", 1) as disk, EventLog(disk / "events.jsonl") as events:
        filler = fill(disk)
        os.truncate(filler, filler.stat().st_size - 4096)  # room for one block: a line is cut off in it
        for number in range(200):
            events.write("ready", sentence=str(number))
        filler.unlink()
        events.write("ended", sentence="the last")
        *whole, _, last = (disk / "events.jsonl").read_text().splitlines()  # what is cut off may be the line's end only
    assert [json.loads(line)["sentence"] for line in whole] == [str(number) for number in range(len(whole))]
    assert 0 < len(whole) < 199
    assert json.loads(last)["sentence"] == "the last"
