"""A terminal that takes nothing, is closed or suspends its programs: the run goes on, or ends in order."""

import fcntl
import os
import pty
import signal
import subprocess
import sys
import termios
from pathlib import Path

import pytest

from tests.supervision.conftest import until
from tests.supervision.test_supervisor_interrupts import STUBBORN

TWO = """
nodes:
  one: {module: nodes.silent_actor, restart: always}
  two: {module: nodes.silent_actor, after: [one]}
"""


def full_pipe():
    """A pipe that holds all it can."""
    reader, writer = os.pipe()
    fcntl.fcntl(writer, fcntl.F_SETPIPE_SZ, 4096)
    os.set_blocking(writer, False)
    os.write(writer, b"x" * 4096)
    os.set_blocking(writer, True)
    return reader, writer


def stopped_terminal():
    """A terminal after Ctrl-S."""
    master, end = pty.openpty()
    termios.tcflow(end, termios.TCOOFF)
    return master, end


@pytest.fixture(params=[full_pipe, stopped_terminal])
def stuck(request):
    """The end of a pipe or terminal to which nobody can write."""
    reader, writer = request.param()
    yield writer
    os.close(writer)
    os.close(reader)


def state_of(pid):
    return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0]


@pytest.mark.parametrize(
    ("stuck", "number", "code"),
    [
        (full_pipe, signal.SIGINT, 130),
        (full_pipe, signal.SIGHUP, 129),
        (stopped_terminal, signal.SIGINT, 130),
        (stopped_terminal, signal.SIGTERM, 143),
    ],
    indirect=["stuck"],
)
def test_a_terminal_that_takes_nothing_delays_neither_a_restart_nor_the_end(workspace, stuck, number, code):
    workspace.write(TWO)
    launcher = workspace.start(stdout=stuck, stderr=stuck)
    workspace.await_event("two ready", launcher)
    first = workspace.await_happening(launcher, "one", "started")
    os.kill(first["pid"], signal.SIGKILL)
    until(lambda: workspace.events.count("one ready") == 2, "the killed node is started again")
    launcher.send_signal(number)
    assert launcher.wait(timeout=60) == code
    assert [event for event in workspace.events if event.endswith(" ended")] == ["two ended", "one ended"]
    assert workspace.happened[-1]["event"] == "run_ends"
    assert workspace.processes() == {}


def test_more_signals_at_such_a_terminal_leave_no_process(workspace, stuck):
    workspace.write(TWO)
    launcher = workspace.start(stdout=stuck, stderr=stuck)
    workspace.await_event("two ready", launcher)

    def ended():
        launcher.send_signal(signal.SIGINT)
        return launcher.poll() is not None

    until(ended, "the launcher has ended")
    until(lambda: workspace.processes() == {}, "no process is left, nor the guard")


def test_the_guard_kills_before_it_prints(workspace, stuck):
    workspace.write(STUBBORN)
    launcher = workspace.start(stdout=stuck, stderr=stuck)
    workspace.await_event("two ready", launcher)
    launcher.kill()
    launcher.wait(timeout=60)
    until(lambda: workspace.processes() == {}, "no process is left, nor the guard")


def test_what_judges_the_run_does_not_wait_either(workspace, stuck):
    judge = "import argparse, sys\nfrom paramove.runs.after_a_run import evaluated\n\n\n"
    judge += "def judged(options, console):\n    console.print('x' * 10_000)\n    return True, []\n\n\n"
    judge += "sys.exit(evaluated('nodes.judge', '', {}, judged, None))\n"
    (workspace.root / "nodes" / "judge.py").write_text(judge)
    workspace.write(
        "after_run: nodes.judge\n"
        "nodes:\n  main: {module: nodes.silent_actor, ends_run: true, parameters: {lasts_s: 0.1}}\n"
    )
    launcher = workspace.start(stdout=stuck, stderr=stuck)
    assert launcher.wait(timeout=60) == 0


def test_closed_output_ends_the_run_in_order(workspace):
    workspace.write(TWO)
    reader, writer = os.pipe()
    launcher = workspace.start(stdout=writer)
    os.close(writer)
    workspace.await_event("two ready", launcher)
    os.close(reader)
    assert launcher.wait(timeout=60) == 141
    assert [event for event in workspace.events if event.endswith(" ended")] == ["two ended", "one ended"]
    assert workspace.processes() == {}


@pytest.mark.parametrize("number", [signal.SIGTSTP, signal.SIGTTIN, signal.SIGTTOU])
def test_a_terminal_cannot_suspend_a_run(workspace, number):
    workspace.write(TWO)
    shown = workspace.root / "shown.txt"
    with shown.open("w") as file:
        launcher = workspace.start(stdout=file, process_group=0)  # a group without a parent in another is not suspended
    workspace.await_event("two ready", launcher)
    launcher.send_signal(number)
    until(lambda: "Ctrl-Z does nothing" in shown.read_text(), "it says that it is not suspended")
    assert state_of(launcher.pid) != "T"
    launcher.send_signal(signal.SIGINT)
    assert launcher.wait(timeout=60) == 130
    assert [event for event in workspace.events if event.endswith(" ended")] == ["two ended", "one ended"]


def test_a_run_in_the_background_of_a_terminal_goes_on(workspace):
    """With `stty tostop`, a program in the background that writes is suspended."""
    workspace.write(TWO)
    terminal, end = pty.openpty()
    shell = subprocess.Popen(
        ["bash", "-c", f"set -m; stty tostop; {sys.executable} -m paramove.cli.launch test --headless & wait"],
        cwd=workspace.root,
        stdin=end,
        stdout=end,
        stderr=end,
        preexec_fn=lambda: os.login_tty(end),
    )
    workspace.launchers.append(shell)
    os.close(end)
    workspace.await_event("two ready", shell)
    pid = workspace.happened[0]["pid"]
    os.kill(pid, signal.SIGTERM)
    shown = b""
    while b"stopped by SIGTERM. Run folder" not in shown:
        shown += os.read(terminal, 4096)
    until(lambda: workspace.processes() == {}, "no process is left")
    shell.wait(timeout=60)
    os.close(terminal)
