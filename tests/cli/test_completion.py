"""What a shell offers after <Tab>, asked as bash, zsh and fish ask."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from paramove.bus import topics
from paramove.cli.main import COMMANDS, main, wanted_command

ROOT = Path(__file__).parents[2]
LAUNCHED = "import sys; from paramove.cli.main import main; sys.argv[0] = 'paramove'; main()"


def paramove(*arguments, cwd=ROOT, **variables):
    return subprocess.run(
        [sys.executable, "-c", LAUNCHED, *arguments],
        cwd=cwd,
        env={**os.environ, **variables},
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
    )


@pytest.fixture
def offered(monkeypatch, capsys):
    """What bash is offered at the end of a line; answered in this process, and for a real bash in one of its own."""

    def ask(line, cwd=ROOT, **variables):
        words = line.split(" ")
        variables |= {"_PARAMOVE_COMPLETE": "complete_bash", "COMP_WORDS": line, "COMP_CWORD": str(len(words) - 1)}
        with monkeypatch.context() as patch:
            patch.chdir(cwd)
            patch.setattr(sys, "argv", ["paramove"])
            for name, value in variables.items():
                patch.setenv(name, value)
            with pytest.raises(SystemExit):
                main()
        answer = capsys.readouterr()
        assert answer.err == ""
        return answer.out.split()

    return ask


@pytest.mark.parametrize(
    ("line", "expected"),
    [
        ("paramove la", {"launch"}),
        (
            "paramove launch ",
            {"dynamixel_arm", "hand_over", "pointing", "relocate_by_pointing", "rule_learning", "two_arms"},
        ),
        ("paramove launch rule_learning --with re", {"real", "real_time", "rehearsal"}),
        ("paramove launch pointing --with rep", {"replay"}),
        ("paramove launch rule_learning --set camera.w", {"camera.width="}),
        ("paramove launch rule_learning --set simulator.se", {"simulator.seed="}),
        ("paramove launch rule_learning --with real --set simulator.", set()),
        ("paramove launch --robot k", {"koch_v1_1"}),
        ("paramove launch --robot koch_v1_1 rule_learning --set camera.w", {"camera.width="}),
        ("paramove launch --schema ", {"launch", "overlay"}),
        ("paramove topic ec", {"echo"}),
        ("paramove topic echo camera/im", {"camera/image", "camera/image_raw"}),
        ("paramove graph --format ", {"text", "mermaid", "svg"}),
        ("paramove doctor --only c", {"cameras"}),
        ("paramove launch no_such --set x", set()),
    ],
)
def test_names_are_offered(line, expected, offered):
    assert set(offered(line)) == expected


def test_every_command_is_offered(offered):
    there = {name for name in offered("paramove ") if not name.startswith("-")}
    assert {"launch", "graph", "topic", "node", "evaluate", "warm", "doctor"} <= there <= set(COMMANDS)


def test_options_of_the_typed_command_are_offered(offered):
    assert {"--with", "--set", "--seed", "--check", "--headless", "--schema"} <= set(offered("paramove launch --"))
    assert {"--format", "--output", "--live"} <= set(offered("paramove graph --"))


def test_topics_of_the_truth_are_not_offered(offered):
    found = offered("paramove topic echo ")
    assert set(found) >= {topic.name for topic in topics.TOPICS if not topic.truth}
    assert not [name for name in found if name.startswith("truth/")]


def test_nodes_and_domains_on_the_bus_are_offered(tmp_path, offered):
    folder = tmp_path / "paramove" / "second"
    folder.mkdir(parents=True)
    (folder / "status.camera").touch()
    (folder / "status.camera.lock").touch()
    place = {"XDG_RUNTIME_DIR": str(tmp_path), "PARAMOVE_DOMAIN": "second"}
    assert offered("paramove topic echo status/", **place) == ["status/camera"]
    assert offered("paramove topic list --domain ", **place) == ["second"]


@pytest.mark.parametrize(
    "text", ["nodes: [", "nodes: {a: 3}", "default_overlays: 3", "\x00", "nodes: {a: {module: ../x}}"]
)
def test_half_written_files_offer_nothing_and_say_nothing(tmp_path, text, offered):
    (tmp_path / "launch").mkdir()
    (tmp_path / "launch" / "half.yaml").write_text(text)
    assert offered("paramove launch half --set x", cwd=tmp_path) == []
    assert offered("paramove launch hal", cwd=tmp_path) == ["half"]


def test_folders_of_runs_are_offered(tmp_path, offered):
    (tmp_path / "runs" / "2026-11-21_10-00-00").mkdir(parents=True)
    assert offered("paramove logs --run runs/", cwd=tmp_path) == ["runs/2026-11-21_10-00-00"]
    assert offered("paramove logs --run runs/", cwd=tmp_path / "runs") == []


def test_in_an_empty_folder_what_is_installed_is_offered(tmp_path, offered):
    assert "rule_learning" in offered("paramove launch ", cwd=tmp_path)


@pytest.mark.parametrize("shell", ["zsh", "fish"])
def test_other_shells_are_answered(shell):
    variables = {"_PARAMOVE_COMPLETE": f"complete_{shell}", "_TYPER_COMPLETE_FISH_ACTION": "get-args"}
    answer = paramove(_TYPER_COMPLETE_ARGS="paramove launch ru", **variables)
    assert "rule_learning" in answer.stdout
    answer = paramove(_TYPER_COMPLETE_ARGS="paramove launch rule_learning --wi", **variables)
    assert "--with" in answer.stdout


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
def test_script_for_the_shell_is_shown(shell):
    answer = paramove("--show-completion", _TYPER_COMPLETE_TEST_DISABLE_SHELL_DETECTION="1")
    answer = paramove("--show-completion", shell, _TYPER_COMPLETE_TEST_DISABLE_SHELL_DETECTION="1")
    assert "_PARAMOVE_COMPLETE" in answer.stdout
    if shutil.which(shell):
        checked = subprocess.run([shell, "-n"], input=answer.stdout, text=True, capture_output=True, check=False)
        assert checked.returncode == 0, checked.stderr


@pytest.mark.skipif(shutil.which("bash") is None, reason="no bash on this machine")
def test_bash_completes_with_the_installed_script(tmp_path):
    """The script is installed into a home of its own, read by a bash, and asked as <Tab> asks."""
    home = {"HOME": str(tmp_path), "_TYPER_COMPLETE_TEST_DISABLE_SHELL_DETECTION": "1"}
    answer = paramove("--install-completion", "bash", **home)
    assert answer.returncode == 0, answer.stderr
    assert (tmp_path / ".bashrc").is_file()
    script = next(path for path in tmp_path.rglob("*.sh") if "paramove" in path.name)
    (tmp_path / "paramove").write_text(f'#!/bin/sh\nexec "{sys.executable}" -c "{LAUNCHED}" "$@"\n')
    (tmp_path / "paramove").chmod(0o755)
    ask = f"source {script}; COMP_WORDS=(paramove launch rule_learning --with re); COMP_CWORD=4;"
    ask += ' $(complete -p paramove | sed "s/.*-F \\([^ ]*\\) .*/\\1/") paramove; echo "${COMPREPLY[@]}"'
    done = subprocess.run(
        ["bash", "--norc", "-c", ask],
        cwd=ROOT,
        env={**os.environ, "PATH": f"{tmp_path}:{os.environ['PATH']}"},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.stdout.split() == ["real", "real_time", "rehearsal"], done.stderr


def test_the_command_that_is_typed_is_found():
    assert wanted_command(["paramove", "--version"], {}) is None
    assert wanted_command(["paramove", "topic", "list"], {}) == "topic"
    asked = {"_PARAMOVE_COMPLETE": "complete_bash", "COMP_WORDS": "paramove launch x"}
    assert wanted_command(["paramove"], asked) == "launch"
    asked = {"_PARAMOVE_COMPLETE": "complete_zsh", "_TYPER_COMPLETE_ARGS": "paramove node "}
    assert wanted_command(["paramove"], asked) == "node"


def test_a_tab_waits_for_no_heavy_library():
    """What is imported when the options of `launch` are asked for; a budget that does not depend on the machine."""
    code = "import sys\nsys.argv = ['paramove']\nfrom paramove.cli.main import main\ntry:\n    main()\n"
    code += "except SystemExit:\n    pass\nfinally:\n    sys.stderr.write(' '.join(sys.modules))"
    variables = {"_PARAMOVE_COMPLETE": "complete_bash", "COMP_WORDS": "paramove launch --s", "COMP_CWORD": "2"}
    answer = subprocess.run(
        [sys.executable, "-c", code],
        cwd=ROOT,
        env={**os.environ, **variables},
        capture_output=True,
        text=True,
        check=False,
    )
    loaded = set(answer.stderr.split())
    assert "--seed" in answer.stdout
    assert not loaded & {"numpy", "cv2", "mujoco", "zmq", "google.protobuf", "psutil", "ruamel.yaml"}


def test_a_stop_of_the_arm_waits_for_no_heavy_library():
    """All commands about the arm are imported before `estop` is done, and a person who stops an arm is in a hurry."""
    code = "import sys, paramove.cli.arm; print(' '.join(sys.modules))"
    loaded = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=True)
    assert not set(loaded.stdout.split()) & {"numpy", "scipy", "cv2", "mujoco", "zmq"}
