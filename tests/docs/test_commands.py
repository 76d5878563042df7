"""Every command in README and docs works.

A block of commands is run as it stands, from the root of the workspace. Two markers in the Markdown, in a comment on
the line before the block, change that:

    <!-- check only: why -->       the targets, sub-commands and options exist, but nothing is started
    <!-- needs a running demo -->  run while the demo runs in the same domain
    <!-- on an emulated arm -->    run with an emulated Koch v1.1 plugged in, in the order of the page; those of
                                   "Connect your arm" by `tests/system/test_connect_your_arm.py`
    <!-- in the example: 78 -->    run by `test_examples.py` in a workspace with the files that the page shows; 78 is
                                   the exit code that is expected, 0 if it is left out
"""

import functools
import itertools
import re
import shlex
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from ruamel.yaml import YAML
from typer.testing import CliRunner

from dynamixel_emulator.emulator import DynamixelEmulator
from paramove.cli.main import build
from paramove.supervision import parameters
from tests.docs.command_line import unknown, unknown_study
from tests.docs.markdown import CONNECT_YOUR_ARM, MARKERS, PAGES, ROOT, Block, blocks
from tests.docs.terminal import ENVIRONMENT, attended
from tests.robots.dynamixel.koch_arm import hands, koch_servos
from tests.robots.dynamixel.small_arm import LINK

BLOCKS = [block for path in PAGES for block in blocks(path)]


def run(command, seconds=180.0):
    return subprocess.run(
        command, cwd=ROOT, env=ENVIRONMENT, capture_output=True, text=True, timeout=seconds, check=False
    )


def marked(marker):
    return [pytest.param(block, id=str(block)) for block in BLOCKS if block.marker == marker]


def run_block(block: Block):
    answer = run(["bash", "-euo", "pipefail", "-c", "\n".join(block.commands)])
    assert answer.returncode == 0, f"{block}\n{answer.stdout}{answer.stderr}"


def test_markers_are_known():
    assert {block.marker for block in BLOCKS} <= {"", *MARKERS}


@pytest.mark.parametrize("block", marked(""))
def test_commands_run(block):
    run_block(block)


@pytest.fixture
def demo(tmp_path):
    """A run of the demo. It takes all processors that it gets, so one test needs it, and ends it."""
    log = tmp_path / "log"
    with log.open("w") as output:
        launch = subprocess.Popen(
            ["paramove", "launch", "rule_learning", "--headless", "--runs", str(tmp_path)],
            cwd=ROOT,
            env=ENVIRONMENT,
            stdout=output,
            stderr=output,
        )
    try:
        deadline_s = time.monotonic() + 120
        while 'robot: "' not in log.read_text():
            assert launch.poll() is None, log.read_text()
            assert time.monotonic() < deadline_s, log.read_text()
            run(["paramove", "node", "list", "--seconds", "1"])
        yield
    finally:
        launch.send_signal(signal.SIGINT)
        launch.wait(120)


@pytest.mark.slow
@pytest.mark.usefixtures("demo")
def test_commands_look_at_a_running_demo():
    watching = [block for block in BLOCKS if block.marker == "needs a running demo"]
    assert watching
    for block in watching:
        run_block(block)


ON_THE_ARM = {block.path for block in BLOCKS if block.marker == "on an emulated arm"} - {CONNECT_YOUR_ARM}


@pytest.mark.slow
@pytest.mark.parametrize("page", [pytest.param(page, id=page.stem) for page in sorted(ON_THE_ARM)])
def test_commands_work_on_an_emulated_arm(page, tmp_path):
    """One after the other, as a person follows the page."""
    (tmp_path / "by-id").mkdir()
    places = {"PARAMOVE_SERIAL_BY_ID": str(tmp_path / "by-id"), "PARAMOVE_DATA": str(tmp_path / "data")}
    with DynamixelEmulator(koch_servos(), tmp_path / "by-id" / LINK) as emulator:
        for block in (one for one in BLOCKS if one.path == page and one.marker == "on an emulated arm"):
            for command in block.commands:
                steps = hands(emulator) if "calibrate" in command else []
                code, output = attended(command, steps, ENVIRONMENT | places)
                assert code == 0, f"{block}\n{command}\n{output}"


@pytest.mark.parametrize("block", marked("check only"))
def test_commands_exist(block):
    for words in (words for line in block.commands for words in single_commands(line)):
        program = words[0].rpartition("/")[2]
        assert program in CHECKS, f"{block}: no check for commands of {program!r}: {shlex.join(words)}"
        CHECKS[program](words)


def single_commands(line):
    """Words of each command of a line `A && B; C`, without variables set before it."""
    words = shlex.shlex(line, posix=True, punctuation_chars=True)
    words.whitespace_split = True
    for ends, command in itertools.groupby(words, key=lambda word: word in ("&&", ";", "|")):
        if not ends:
            yield list(itertools.dropwhile(lambda word: re.fullmatch(r"[A-Z_]+=.*", word), command))


def check_make(words):
    answer = run(["make", "--dry-run", *words[1:]])
    assert answer.returncode == 0, answer.stderr
    arguments = [word.removeprefix("ARGS=") for word in words if word.startswith("ARGS=")]
    if words[1] == "demo" and arguments:
        check_paramove(["paramove", "launch", "rule_learning", *shlex.split(arguments[0])])


def check_paramove(words):
    if words[1].startswith("-"):
        check_options(("paramove",), words)
        return
    wrong = unknown(words[1:])
    assert not wrong, f"{shlex.join(words)}: {wrong} is unknown"
    if words[1] == "launch":
        with pytest.MonkeyPatch.context() as patch:
            patch.chdir(ROOT)
            patch.setattr(parameters, "_check_in_process", asked_here)
            answer = CliRunner().invoke(build("launch"), [*words[1:], "--check"])
        assert answer.exit_code == 0, answer.output


def asked_here(asked, workspace):
    """Findings of the nodes' own Config, asked here; `tests/system/test_launch_files.py` asks it in a process."""
    return [parameters._answer(module, given) for _, module, given in asked]


def check_python(words):
    if words[1] == "-c":
        compile(words[2], "<command>", "exec")
        return
    if words[1:3] == ["-m", "studies"]:
        wrong = unknown_study(words[3:])
        assert not wrong, f"{shlex.join(words)}: {wrong} is unknown"
        return
    program = words[1:3] if words[1] == "-m" else words[1:2]
    check_options((sys.executable, *program), words[1 + len(program) :])


def check_pip(words):
    check_options((sys.executable, "-m", "pip", words[1]), words[2:])


def check_options(command, words):
    known = set(re.findall(r"(?<![\w-])--?[a-z][\w-]*", help_of(command)))
    assert {word.partition("=")[0] for word in words if word.startswith("-")} <= known


@functools.cache
def help_of(command):
    answer = run([*command, "--help"])
    assert answer.returncode == 0, f"{shlex.join(command)} --help: {answer.stderr}"
    return answer.stdout


def check_git(words):
    assert words[1] == "clone"


def check_docker(words):
    """The service of a `docker compose -f FILE run|up [OPTION...] SERVICE` exists; Docker itself is not needed."""
    assert words[1:3] == ["compose", "-f"]
    services = YAML(typ="safe", pure=True).load((ROOT / words[3]).read_text())["services"]
    assert words[4] in ("run", "up")
    assert set(services).intersection(words[5:])
    for service in services.values():
        folder = ROOT / Path(words[3]).parent / service["build"]["context"]
        assert (folder / service["build"]["dockerfile"]).is_file()


def check_program(words):
    assert shutil.which(words[0]), f"{words[0]} is not there"


def check_nothing(words):
    """Of a shell's own commands and of a machine's administration there is nothing to check."""


CHECKS = {
    "make": check_make,
    "paramove": check_paramove,
    "python": check_python,
    "python3": check_python,
    "pip": check_pip,
    "git": check_git,
    "docker": check_docker,
    "cp": check_program,
    "mkdir": check_program,
    "ls": check_program,
    "sudo": check_nothing,
    "cd": check_nothing,
    ".": check_nothing,
    "apt-get": check_nothing,
    "xdg-open": check_nothing,
}


def test_a_wrong_command_is_found():
    """The checks themselves can fail."""
    for words in (
        "make no-such-target",
        "paramove launch no_such",
        "paramove launch rule_learning --set camera.no_such=1",
        "paramove topic hz --no-such",
        "paramove nothing",
        "python -m studies nothing",
    ):
        with pytest.raises(AssertionError):
            CHECKS[words.split()[0]](words.split())
