"""One process and all that it starts."""

import os
import shutil
import subprocess
import sys
import threading
from pathlib import Path

import pytest

from paramove.documents.wording import printable
from paramove.supervision.launch_schema import NodeSettings
from paramove.supervision.processes import NICE, Guard, SupervisedProcess, last_lines, node_process, prioritise
from paramove.supervision.run_folder import RunFolder
from paramove.workspace import Workspace
from tests.supervision.conftest import until


@pytest.fixture
def guard():
    with Guard() as made:
        yield made


def started(guard, tmp_path, source, **options):
    return SupervisedProcess(
        [sys.executable, "-c", source], folder=tmp_path, environment=os.environ, guard=guard, **options
    )


def exit_code(process):
    until(lambda: process.ended() is not None, "the process has ended")
    return process.ended()


def test_exit_code_and_output(guard, tmp_path):
    log = tmp_path / "log"
    process = started(guard, tmp_path, "import sys; print('out'); sys.exit('err')", log=log)
    assert exit_code(process) == 1
    assert sorted(last_lines(log, 20)) == ["err", "out"]


def test_leads_a_session_of_its_own_and_dies_with_the_launcher(guard, tmp_path):
    source = (
        "import ctypes, os; signal = ctypes.c_int(); ctypes.CDLL(None).prctl(2, ctypes.byref(signal));"
        "print(os.getsid(0) == os.getpid(), os.getpgid(0) == os.getpid(), signal.value)"
    )
    log = tmp_path / "log"
    assert exit_code(started(guard, tmp_path, source, log=log)) == 0
    assert last_lines(log, 1) == ["True True 15"]


def test_children_left_behind_are_killed(guard, tmp_path):
    log = tmp_path / "log"
    source = (
        "import subprocess, sys; print(subprocess.Popen([sys.executable, '-c', 'import signal; signal.pause()']).pid)"
    )
    assert exit_code(started(guard, tmp_path, source, log=log)) == 0
    child = int(last_lines(log, 1)[0])
    until(lambda: not os.path.exists(f"/proc/{child}") or state_of(child) == "Z", "the child has ended")


def test_a_node_knows_from_the_launcher_that_it_was_started_before(guard, tmp_path):
    """Whatever is deleted in the run's folder."""
    (tmp_path / "which.py").write_text("from paramove.bus import is_first_start; print(is_first_start())")
    workspace, settings = Workspace(tmp_path, (tmp_path,)), NodeSettings(module="which")
    run_folder = RunFolder(tmp_path / "run")
    for number, expected in enumerate(("True", "False", "False")):
        run_folder.logs.mkdir(parents=True)
        assert exit_code(node_process("driver", settings, run_folder, workspace, guard)) == 0, number
        assert last_lines(run_folder.log("driver"), 1) == [expected]
        shutil.rmtree(run_folder.path)


def state_of(pid):
    try:
        with open(f"/proc/{pid}/stat") as file:
            return file.read().rpartition(")")[2].split()[0]
    except OSError:
        return "Z"


def test_missing_program_ends_at_once_with_a_reason(guard, tmp_path):
    log = tmp_path / "log"
    process = SupervisedProcess(["/no/such"], folder=tmp_path, environment=os.environ, guard=guard, log=log)
    assert exit_code(process) == 1
    assert "/no/such" in last_lines(log, 1)[0] or "No such file" in last_lines(log, 1)[0]


def test_processes_start_in_the_main_thread_only(guard, tmp_path):
    caught = []

    def start():
        try:
            started(guard, tmp_path, "")
        except RuntimeError as error:
            caught.append(str(error))

    thread = threading.Thread(target=start)
    thread.start()
    thread.join()
    assert len(caught) == 1
    assert "main thread" in caught[0]


def test_guard_kills_what_its_launcher_left(tmp_path):
    with Guard() as guard:
        process = started(
            guard, tmp_path, "import signal; signal.signal(signal.SIGTERM, signal.SIG_IGN); signal.pause()"
        )
    assert process.ended() == -9 or exit_code(process) in (-9, -15)


def test_guard_that_died_is_no_obstacle(tmp_path):
    with Guard() as guard:
        guard._process.kill()
        guard._process.wait()
        assert exit_code(started(guard, tmp_path, "")) == 0


def test_last_lines_of_a_long_file_with_odd_bytes(tmp_path):
    log = tmp_path / "log"
    log.write_bytes(b"x" * 500_000 + b"\n" + b"\n".join(b"line %d" % n for n in range(100)) + b"\n\xff\x1b[31mred\n")
    lines = last_lines(log, 3)
    assert lines == ["line 98", "line 99", "\N{REPLACEMENT CHARACTER}\\x1b[31mred"]
    assert last_lines(tmp_path / "none", 3) == []


@pytest.mark.parametrize(
    ("text", "shown"), [("a\x1b[2Jb", "a\\x1b[2Jb"), ("a\nb\t", "a\\nb\\t"), ("ξ = 1 é", "ξ = 1 é")]
)
def test_control_characters_are_written_out(text, shown):
    assert printable(text) == shown


def test_priority_is_that_of_the_process_and_of_its_session(guard, tmp_path, monkeypatch):
    process = started(guard, tmp_path, "import signal; signal.pause()")
    lower = min(19, os.getpriority(os.PRIO_PROCESS, 0) + 5)  # which everybody may
    monkeypatch.setitem(NICE, "low", lower)
    prioritise(process.pid, "low")
    assert os.getpriority(os.PRIO_PROCESS, process.pid) == lower
    group = Path(f"/proc/{process.pid}/autogroup")
    assert not group.exists() or group.read_text().split()[-1] == str(lower)
    process.kill()
    exit_code(process)


@pytest.mark.skipif(os.geteuid() != 0, reason="only root can become an ordinary user")
@pytest.mark.skipif(not Path("/proc/self/autogroup").exists(), reason="this kernel does not group by session")
def test_sessions_that_an_ordinary_user_starts_at_once_all_get_their_priority():
    code = """
import os, subprocess
from pathlib import Path
from paramove.supervision.processes import prioritise
os.setgroups([])
os.setgid(65534)
os.setuid(65534)
processes = [subprocess.Popen(["sleep", "60"], stdout=subprocess.DEVNULL, start_new_session=True) for _ in range(3)]
for process in processes:
    prioritise(process.pid, "low")
print(*(Path(f"/proc/{process.pid}/autogroup").read_text().split()[-1] for process in processes))
for process in processes:
    process.kill()
"""

    def priorities() -> list[str]:
        done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=60, check=True)
        return done.stdout.split()

    # All processes of the machine share the turns: those of root, as other tests start them, take some.
    assert any(priorities() == [str(NICE["low"])] * 3 for _ in range(10))
