"""However the launcher ends, no node outlives it."""

import os
import pty
import signal
import subprocess
import sys

import pytest

from tests.supervision.conftest import until

TWO = """
nodes:
  one: {module: nodes.silent_actor, parameters: {child: true}}
  two: {module: nodes.silent_actor, after: [one]}
"""
STUBBORN = """
nodes:
  one: {module: nodes.silent_actor, parameters: {ignores_sigterm: true, child: true}}
  two: {module: nodes.silent_actor, after: [one]}
"""


@pytest.mark.parametrize(
    ("number", "code", "reason"),
    [
        (signal.SIGINT, 130, "stopped by Ctrl-C"),
        (signal.SIGTERM, 143, "stopped by SIGTERM"),
        (signal.SIGHUP, 129, "stopped because the terminal was closed"),
    ],
    ids=lambda x: str(x),
)
def test_signal_ends_the_nodes_in_order(workspace, number, code, reason):
    workspace.write(TWO)
    launcher = workspace.start()
    workspace.await_event("two ready", launcher)
    launcher.send_signal(number)
    shown = launcher.communicate(timeout=60)[0]
    assert launcher.returncode == code, shown
    assert [event for event in workspace.events if event.endswith(" ended")] == ["two ended", "one ended"]
    assert f"{reason}. Run folder" in shown
    assert "FAILED" not in shown
    assert workspace.processes() == {}


def test_second_interrupt_ends_all_at_once(workspace):
    workspace.write(STUBBORN)
    launcher = workspace.start()
    workspace.await_event("two ready", launcher)
    launcher.send_signal(signal.SIGINT)
    until(lambda: "two ended" in workspace.events, "the second node has ended")
    launcher.send_signal(signal.SIGINT)
    shown = launcher.communicate(timeout=60)[0]
    assert launcher.returncode == 130
    assert "was killed (SIGKILL)" in shown
    assert not any(f"{seconds}.0 s after the request" in shown for seconds in (5, 6)), "it waited for the time limit"
    assert workspace.processes() == {}


@pytest.mark.parametrize("text", [TWO, STUBBORN], ids=["obedient", "stubborn"])
def test_nodes_of_a_killed_launcher_end(workspace, text):
    workspace.write(text)
    launcher = workspace.start()
    workspace.await_event("two ready", launcher)
    launcher.kill()
    launcher.wait(timeout=60)
    until(lambda: workspace.processes() == {}, "no process is left")


def test_run_after_a_killed_one_works_in_the_same_domain(workspace):
    workspace.write(TWO)
    launcher = workspace.start()
    workspace.await_event("two ready", launcher)
    launcher.kill()
    launcher.wait(timeout=60)
    until(lambda: workspace.processes() == {}, "no process is left")
    workspace.write("nodes:\n  main: {module: nodes.silent_actor, ends_run: true, parameters: {lasts_s: 0.1}}\n")
    again = workspace.start()
    shown = again.communicate(timeout=60)[0]
    assert again.returncode == 0, shown


def test_closed_terminal_ends_the_nodes(workspace):
    workspace.write(TWO)
    terminal, end = pty.openpty()
    launcher = workspace.start(stdin=end, stdout=end, stderr=end, text=False, preexec_fn=lambda: os.login_tty(end))
    os.close(end)
    workspace.await_event("two ready", launcher)
    os.close(terminal)
    assert launcher.wait(timeout=60) == 129
    assert workspace.processes() == {}


@pytest.mark.parametrize("begin", ["nohup", "trap '' HUP; exec"], ids=["output in a file", "output at the terminal"])
def test_a_run_that_ignores_hangups_survives_its_terminal(workspace, begin):
    workspace.write(TWO.replace("after: [one]", "after: [one], restart: always"))
    terminal, end = pty.openpty()
    launcher = workspace.start(
        command=["bash", "-c", f"{begin} {sys.executable} -m paramove.cli.launch test"],
        stdin=end,
        stdout=end,
        stderr=end,
        text=False,
        preexec_fn=lambda: os.login_tty(end),
    )
    os.close(end)
    workspace.await_event("two ready", launcher)
    nodes = {event["node"]: event["pid"] for event in workspace.happened if event["event"] == "started"}
    os.close(terminal)
    pid = workspace.happened[0]["pid"]
    for process in (pid, *nodes.values()):
        os.kill(process, signal.SIGHUP)
    os.kill(nodes["two"], signal.SIGTERM)  # handled after the hangup
    workspace.await_happening(launcher, "two", "ended")
    until(lambda: workspace.events.count("two ready") == 2, "the node is started again")
    assert "run_stops" not in [event["event"] for event in workspace.happened]
    os.kill(pid, signal.SIGTERM)
    assert launcher.wait(timeout=60) == 143
    assert [event for event in workspace.events if event.endswith(" ended")][-2:] == ["two ended", "one ended"]
    assert workspace.processes() == {}


def test_second_run_in_a_domain_is_refused_and_names_the_first(workspace):
    workspace.write(TWO)
    launcher = workspace.start()
    workspace.await_event("two ready", launcher)
    second = workspace.start()
    shown = second.communicate(timeout=60)[0]
    assert second.returncode == 75
    assert f"domain 'default' is held by pid {launcher.pid} (paramove launch test)" in shown
    assert "PARAMOVE_DOMAIN" in shown
    launcher.send_signal(signal.SIGTERM)
    launcher.communicate(timeout=60)


def test_wrong_launch_file_starts_nothing(workspace):
    workspace.write("nodes:\n  one: {modul: nodes.silent_actor}\n")
    launcher = workspace.start(stderr=subprocess.PIPE)
    _, errors = launcher.communicate(timeout=60)
    assert launcher.returncode == 78
    assert "test.yaml:2:9: unknown key 'modul'; did you mean 'module'?" in errors
    assert not (workspace.root / "runs").exists()
