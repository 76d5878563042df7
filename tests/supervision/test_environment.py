"""What of the environment is taken, ignored or refused: each case with variable, value and remedy."""

import os
import re
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

import pytest

from paramove.supervision.domain import DomainError
from paramove.supervision.environment import examined
from paramove.workspace import Workspace

ROOT = Path(__file__).parents[2]
FILE = str(Path(__file__))
RUNTIME = tempfile.TemporaryDirectory(prefix="pm-", dir="/tmp")  # others may have folders of this name in /tmp itself
DECIDING = ("PARAMOVE_DOMAIN", "XDG_RUNTIME_DIR", "XDG_CACHE_HOME", "HOME", "TMPDIR", "TZ", "PYTHONPATH", "LC_ALL")


@pytest.fixture
def environment(monkeypatch, tmp_path):
    """Sets the variables given and unsets all others that decide something; returns what is examined."""

    def examine(**variables):
        for name in DECIDING:
            monkeypatch.delenv(name, raising=False)
        for name, value in {"HOME": str(tmp_path), **variables}.items():
            if value is None:
                monkeypatch.delenv(name, raising=False)
            else:
                monkeypatch.setenv(name, value)
        monkeypatch.setattr(tempfile, "tempdir", None)
        return examined(os.environ, Workspace.at(ROOT))

    return examine


def test_a_usual_environment_needs_no_word(environment, tmp_path):
    found = environment(XDG_RUNTIME_DIR=str(tmp_path), TZ="Europe/Berlin", LC_ALL="C.UTF-8")
    assert found.notes == ()
    assert found.domain == "default"
    assert found.sockets == tmp_path / "paramove" / "default"


def test_nothing_set_at_all(environment):
    found = environment(HOME=None)
    assert found.notes == ()
    assert found.sockets == Path(tempfile.gettempdir()) / f"paramove-{os.getuid()}" / "default"


@pytest.mark.parametrize("name", ["PARAMOVE_DOMAIN", "XDG_RUNTIME_DIR", "TMPDIR", "TZ", "PYTHONPATH", "XDG_CACHE_HOME"])
def test_empty_is_as_unset(environment, name):
    assert environment(**{name: ""}) == environment()


@pytest.mark.parametrize(
    ("variables", "note"),
    [
        ({"XDG_RUNTIME_DIR": "run"}, "XDG_RUNTIME_DIR='run' is ignored: it is not an absolute path; sockets lie in /"),
        ({"XDG_RUNTIME_DIR": "/no/such"}, "XDG_RUNTIME_DIR='/no/such' is ignored: there is no such folder"),
        ({"XDG_RUNTIME_DIR": FILE}, "is ignored: there is no such folder"),
        ({"TMPDIR": "tmp"}, "TMPDIR='tmp' is ignored: it is not an absolute path; temporary files lie in /"),
        ({"TMPDIR": "/no/such"}, "TMPDIR='/no/such' is ignored"),
        ({"HOME": FILE}, f"HOME='{FILE}': the cache {FILE}/.cache/paramove is not writable"),
        ({"XDG_CACHE_HOME": FILE}, f"XDG_CACHE_HOME='{FILE}': the cache "),
        ({"HOME": "home"}, "HOME='home' is ignored: it is not an absolute path; the cache is /"),
        ({"TZ": "Mars/Base"}, "TZ='Mars/Base' is not a known time zone"),
        ({"TZ": "../../etc/passwd"}, "TZ='../../etc/passwd' is not a known time zone"),
    ],
)
def test_what_is_ignored_is_told_with_its_remedy(environment, variables, note):
    (told,) = environment(**variables).notes
    assert note in told
    assert any(remedy in told for remedy in ("Unset it", "Correct it", "set XDG_CACHE_HOME to"))


@pytest.mark.skipif(os.geteuid() == 0, reason="root may write everywhere")
def test_a_runtime_folder_that_cannot_be_written_is_told(environment, tmp_path):
    tmp_path.chmod(0o500)
    (told,) = environment(XDG_RUNTIME_DIR=str(tmp_path), HOME="/tmp").notes
    assert "it cannot be written" in told


@pytest.mark.parametrize("zone", ["UTC", "CET-1CEST", "<+03>-3", ":Europe/Istanbul"])
def test_time_zones_of_every_form_are_taken(environment, zone):
    assert environment(TZ=zone).notes == ()


@pytest.mark.parametrize("name", ["My Domain", "../x", "a/b", "x" * 41, "\x1b[2J", "türk"])
def test_a_name_that_no_domain_can_have_is_refused(environment, name):
    with pytest.raises(DomainError, match=r"expected up to 40 .* unset PARAMOVE_DOMAIN") as caught:
        environment(PARAMOVE_DOMAIN=name)
    assert str(caught.value).isprintable() or name == "türk"


@pytest.mark.parametrize("made", ["numpy.py", "json.py", "paramove/__init__.py"])
def test_a_module_that_hides_another_is_named(environment, tmp_path, made):
    (tmp_path / made).parent.mkdir(exist_ok=True)
    (tmp_path / made).touch()
    (told,) = environment(PYTHONPATH=f"/no/such{os.pathsep}{tmp_path}").notes
    hidden = made.partition("/")[0]
    assert told.startswith(str(tmp_path / hidden))
    assert f"hides the required module {hidden.removesuffix('.py')}" in told
    assert "unset PYTHONPATH" in told


def test_data_and_other_modules_beside_hide_nothing(environment, tmp_path):
    (tmp_path / "mine.py").touch()
    (tmp_path / "json").mkdir()  # a folder without Python in it
    assert environment(PYTHONPATH=str(tmp_path)).notes == ()


def test_root_in_the_clone_of_another_is_told(environment, monkeypatch):
    monkeypatch.setattr(os, "geteuid", lambda: 0)
    stat = Path.stat
    owner = os.stat_result((0o40755, 0, 0, 0, 1000, 1000, 0, 0, 0, 0))
    monkeypatch.setattr(Path, "stat", lambda path, **options: owner if path == ROOT else stat(path, **options))
    assert environment().notes == ("run as root in a clone of user 1000: the folder of this run will belong to root",)


def launch(*arguments, cwd=ROOT, **variables):
    kept = {"PATH": os.environ["PATH"], "XDG_RUNTIME_DIR": RUNTIME.name}
    return subprocess.run(
        [sys.executable, "-m", "paramove.cli.launch", *arguments],
        cwd=cwd,
        env={**kept, **variables},
        capture_output=True,
        text=True,
        timeout=120,
        check=False,
    )


@pytest.mark.parametrize(
    "variables",
    [{}, {"LC_ALL": "C"}, {"LC_ALL": "tr_TR.UTF-8"}, {"PYTHONIOENCODING": "ascii"}, {"TZ": "Pacific/Kiritimati"}],
    ids=str,
)
def test_check_prints_what_a_run_would_use(variables):
    answer = launch("rule_learning", "--check", "--seed", "7", PARAMOVE_DOMAIN="second", **variables)
    assert answer.returncode == 0, answer.stderr
    assert answer.stderr == ""
    first, *lines = answer.stdout.splitlines()
    assert first == "rule_learning: 10 nodes fit together"
    told = {line.split()[0]: line.split(maxsplit=1)[1] for line in lines}
    assert told["overlays"] == "sim, seed 7"
    assert told["clock"] == "simulated, lockstep"
    assert told["domain"] == f"second, sockets in {RUNTIME.name}/paramove/second"
    assert told["python"] == sys.executable


def test_a_wrong_domain_ends_with_the_code_of_a_wrong_configuration():
    answer = launch("rule_learning", "--check", PARAMOVE_DOMAIN="Two words")
    assert answer.returncode == 78
    assert answer.stderr.startswith("domain 'Two words': expected up to 40 lower-case letters")


def test_no_domain_has_the_folder_in_which_another_hides_its_truth(environment):
    with pytest.raises(DomainError, match="not beginning with truth-"):
        environment(PARAMOVE_DOMAIN="truth-default")


def test_a_run_folder_that_cannot_be_made_is_told_with_another_place(tmp_path):
    taken = tmp_path / "runs"
    taken.touch()
    answer = launch("rule_learning", "--headless", "--runs", str(taken), PARAMOVE_DOMAIN="nowhere")
    assert answer.returncode in (1, 77)
    assert answer.stderr.startswith(f"{taken}: ")
    assert f"--runs {tempfile.gettempdir()}/paramove_runs" in answer.stderr


def test_a_socket_folder_that_cannot_be_made_is_told_with_the_variable(tmp_path):
    (tmp_path / "paramove").touch()
    answer = launch("rule_learning", "--headless", "--runs", str(tmp_path), XDG_RUNTIME_DIR=str(tmp_path))
    assert answer.returncode != 0
    assert "XDG_RUNTIME_DIR" in answer.stderr
    assert "Traceback" not in answer.stderr


def test_an_empty_folder_is_a_workspace_before_the_installed_one(tmp_path):
    answer = launch("rule_learning", "--check", cwd=tmp_path)
    assert answer.returncode == 0, answer.stderr
    assert f"workspace {tmp_path}, then {ROOT}" in answer.stdout


def test_what_the_folder_replaces_is_named_at_the_start(workspace):
    """Whatever it is replaced with; a new file, such as an own node, replaces nothing."""
    workspace.write("nodes: {main: {module: nodes.silent_actor, ends_run: true, parameters: {lasts_s: 0.1}}}")
    (workspace.root / "nodes" / "camera.py").write_text("SUBSCRIBES = ()\nPUBLISHES = ()\n")
    answer = launch("test", cwd=workspace.root)
    assert answer.returncode == 0, answer.stderr
    assert re.search(r"^replaced there: .*nodes/camera\.py$", answer.stdout, re.MULTILINE)


@pytest.mark.parametrize("where", ["nodes", "the folder itself"])
def test_a_name_that_is_no_text_stops_no_run(tmp_path, where):
    name = os.fsdecode(b"cell_\xff")
    root = tmp_path / name if where == "the folder itself" else tmp_path
    shutil.copytree(ROOT / "tests/supervision/nodes", root / "nodes")
    (root / "launch").mkdir()
    (root / "launch" / "test.yaml").write_text(
        "nodes: {main: {module: nodes.silent_actor, ends_run: true, parameters: {lasts_s: 0.1}}}"
    )
    if root == tmp_path:
        (root / where / f"{name}.py").write_text("")
    answer = launch("test", cwd=root)
    assert answer.returncode == 0, answer.stderr
    assert "exit_code: 0" in (root / "runs" / "latest" / "run.yaml").read_text()
