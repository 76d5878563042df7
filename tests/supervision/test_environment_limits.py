"""What the operating system allows."""

import errno
import os
import resource

import pytest

from paramove.documents import exit_codes
from paramove.msgs.node_status_pb2 import NodeStatus
from paramove.supervision.launch_schema import NodeSettings
from paramove.supervision.supervised_node import State, SupervisedNode

MAIN = "nodes:\n  main: {module: nodes.silent_actor, ends_run: true, parameters: {lasts_s: 0}}\n"


def limited(soft, hard):
    return lambda: resource.setrlimit(resource.RLIMIT_NOFILE, (soft, hard))


def test_too_few_open_files_are_told_with_the_limit_and_the_remedy(workspace):
    workspace.write(MAIN)
    launcher = workspace.start(preexec_fn=limited(64, 64))
    shown = launcher.communicate(timeout=60)[0]
    assert launcher.returncode == exit_codes.PERMISSION, shown
    assert "a process may have 64 files open here (hard limit 64), a run needs 256; raise the limit:" in shown
    assert "ulimit -Hn 256" in shown
    assert not (workspace.root / "runs").exists()


def test_low_soft_limit_is_raised(workspace):
    workspace.write(MAIN)
    launcher = workspace.start(preexec_fn=limited(64, 1024))
    shown = launcher.communicate(timeout=60)[0]
    assert launcher.returncode == exit_codes.OK, shown


class Process:
    pid = os.getpid()
    killed = False

    def ended(self):
        return -9 if self.killed else None

    def halted(self):
        return None

    def kill(self):
        self.killed = True


def node(spawn, **settings):
    changes = []
    made = SupervisedNode(
        "camera", NodeSettings(module="m", **settings), spawn, lambda it: changes.append((it.state, it.detail))
    )
    return made, changes


def test_process_that_cannot_be_started_is_tried_again():
    def spawn(_):
        raise BlockingIOError(errno.EAGAIN, os.strerror(errno.EAGAIN))

    made, changes = node(spawn, restart="on-failure", backoff_s=1.0)
    made.start(0.0)
    told = "cannot be started: Resource temporarily unavailable; restart 1 in 1 s"
    assert changes == [(State.RESTARTING, told)]
    assert made.check(0.5) is None
    assert made.check(1.5) is None
    assert changes[-1][1].endswith("restart 2 in 2 s")


@pytest.mark.parametrize(("looks_s", "killed"), [([1.0, 100.0], False), ([0.4 * n for n in range(1, 60)], True)])
def test_silence_while_the_supervisor_itself_was_stopped_does_not_count(looks_s, killed):
    made, changes = node(lambda _: Process(), silent_timeout_s=10.0)
    made.start(0.0)
    made.handle(NodeStatus(node="camera", state=NodeStatus.STATE_READY, detail="frames", pid=os.getpid()))
    for now_s in looks_s:
        made.check(now_s)
    assert (made.process is None) == killed
    assert (State.READY, "hangs: no status for 10 s, last message: frames, so it is killed") in changes or not killed
