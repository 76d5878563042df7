"""`paramove arm enable` and `disable`: what they ask, what they say, and their exit codes."""

from __future__ import annotations

import sys

import pytest
import typer
from typer.testing import CliRunner

from paramove.bus.endpoint import TopicTakenError
from paramove.cli.arm.enable import enable
from paramove.cli.arm.terminal_person import TerminalPerson
from paramove.cli.main import build
from paramove.msgs.safety_state_pb2 import SafetyFault, SafetyState

FAULTS = [SafetyFault(code=str(number), detail=f"reason {number}") for number in (1, 2)]
ANSWERS = {
    "armed": SafetyState(state=SafetyState.STATE_ARMED),
    "disarmed": SafetyState(state=SafetyState.STATE_DISARMED),
    "refused": SafetyState(state=SafetyState.STATE_HOLD, faults=FAULTS),
    "silent": None,
}


@pytest.fixture
def words(tmp_path, monkeypatch):
    """What the gate answers by the name of ANSWERS, and the words that it was told."""
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    monkeypatch.delenv("PARAMOVE_DOMAIN", raising=False)
    (tmp_path / "paramove" / "default").mkdir(parents=True)
    told = {"answer": "armed", "words": []}

    def request_arming(folder, armed, timeout_s, namespace):
        told["words"].append(armed)
        told["namespace"] = namespace
        if told["answer"] == "taken":
            raise TopicTakenError("operator says operator/arm already")
        return ANSWERS[told["answer"]]

    monkeypatch.setattr("paramove.operator.request_arming", request_arming)
    monkeypatch.setattr(TerminalPerson, "is_at_terminal", True)
    return told


def said(*typed, line=""):
    return CliRunner().invoke(build("arm"), ["arm", *typed], input=line)


@pytest.mark.parametrize(("line", "code", "heard"), [("y\n", 0, [True]), ("n\n", 1, []), ("", 1, [])])
def test_arming_asks_first(words, line, code, heard):
    done = said("enable", line=line)
    assert (done.exit_code, words["words"]) == (code, heard)
    assert "out of the arm's reach" in done.stdout
    assert ("ARMED: the arm may move" in done.stdout) == (code == 0)


@pytest.mark.parametrize(
    ("answer", "code", "detail"),
    [
        ("refused", 3, "hold, not armed: reason 1; reason 2"),
        ("disarmed", 69, "disarmed, not armed: the arm's driver does not answer"),
        ("silent", 69, "no data from a safety gate within 5 s"),
        ("taken", 75, "only one program may arm an arm; stop that one first; `paramove arm estop` stops the arm"),
    ],
)
def test_what_keeps_it_from_arming_is_told(words, answer, code, detail):
    words["answer"] = answer
    done = said("enable", "--yes")
    assert done.exit_code == code
    assert detail in done.stderr
    assert "ARMED" not in done.stdout


@pytest.mark.parametrize(("answer", "code"), [("disarmed", 0), ("refused", 3), ("silent", 69)])
def test_disarming_asks_nothing(words, answer, code):
    words["answer"] = answer
    done = said("disable")
    assert (done.exit_code, words["words"]) == (code, [False])
    assert ("DISARMED" in done.stdout) == (code == 0)
    assert ("reason 1; reason 2" in done.stderr) == (answer == "refused")


def test_where_nothing_runs_it_is_told(words):
    for name in ("enable", "disable"):
        done = said(name, "--domain", "other", *(["--yes"] if name == "enable" else []))
        assert done.exit_code == 69
        assert "nothing is running in" in done.stderr


def test_a_closed_standard_input_is_no_yes(words, monkeypatch):
    monkeypatch.undo()
    monkeypatch.setattr(sys, "stdin", None)
    with pytest.raises(typer.Exit) as caught:
        enable(yes=False)
    assert (caught.value.exit_code, words["words"]) == (1, [])


def test_what_has_no_terminal_arms_nothing_but_may_disarm(words, monkeypatch):
    monkeypatch.setattr(TerminalPerson, "is_at_terminal", False)
    done = said("enable", "--yes", line="y\n")
    assert (done.exit_code, words["words"]) == (1, [])
    assert "only a person at a terminal arms" in done.stderr
    words["answer"] = "disarmed"
    assert (said("disable").exit_code, words["words"]) == (0, [False])


def test_where_several_arms_run_a_person_names_one(words, monkeypatch):
    gates = {"left": None, "right": None}
    monkeypatch.setattr("paramove.bus.inspection.gates", lambda folder: gates)
    for name in ("enable", "disable"):
        done = said(name, *(["--yes"] if name == "enable" else []))
        assert (done.exit_code, words["words"]) == (2, [])
        assert "which one? --namespace left or --namespace right" in done.stderr
    done = said("enable", "--namespace", "lift", line="y\n")
    assert (done.exit_code, words["words"]) == (2, [])
    assert "no arm in the namespace 'lift'; did you mean 'left'?" in done.stderr
    done = said("enable", "--namespace", "right", line="y\n")
    assert (done.exit_code, words["words"], words["namespace"]) == (0, [True], "right")
    assert "right: Is everybody out of the arm's reach" in done.stdout


def test_the_only_arm_needs_no_name(words, monkeypatch):
    monkeypatch.setattr("paramove.bus.inspection.gates", lambda folder: {"left": None})
    assert said("enable", "--yes").exit_code == 0
    assert words["namespace"] == "left"
