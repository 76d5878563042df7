"""Which cases there are, what must follow, and which can share a run."""

from pathlib import Path

import pytest

from paramove.supervision.launch_file import load
from paramove.workspace import Workspace
from studies.faults.kill_cases import LAUNCHER, MOMENTS, CaseError, Expected, cases_of, runs_of

FILE = load(Workspace.at(Path(__file__).parents[3]), "rule_learning", ["sim", "real_time"]).file
NODES = [*FILE.nodes, LAUNCHER]


def test_every_process_is_killed_and_stopped_at_every_moment() -> None:
    cases = cases_of(FILE)
    assert len(cases) == len({case.name for case in cases}) == len(NODES) * 2 * len(MOMENTS)
    assert len(NODES) == 11


def test_what_must_follow_is_what_the_launch_file_says() -> None:
    killed = {case.node: case.expected for case in cases_of(FILE, signals=["KILL"], moments=["rest"])}
    on, ends = Expected.GOES_ON, Expected.ENDS
    assert killed == {
        **dict.fromkeys(["camera", "colour_tracker", "recognizer", "synthesizer", "recorder", "judge"], on),
        **dict.fromkeys(["operator", "rule_learner", "simulator"], ends),
        "arm_driver": Expected.ENDS_BACK,
        LAUNCHER: Expected.ALL_END,
    }
    (stopped,) = cases_of(FILE, [LAUNCHER], ["STOP"], ["rest"])
    assert stopped.expected is Expected.UNHARMED


def test_a_run_kills_each_node_once_and_ends_with_the_case_that_ends_it() -> None:
    cases = cases_of(FILE)
    groups = runs_of(cases)
    assert sorted(case.name for group in groups for case in group) == sorted(case.name for case in cases)
    for group in groups:
        assert len({case.node for case in group}) == len(group)
        assert len(group) == 1 or not any(case.ends_run for case in group)
    assert len(groups) < len(cases) / 1.5


@pytest.mark.parametrize(
    ("chosen", "words"),
    [
        (({"nodes": ["cam"]}), "no node 'cam'; there are .*camera.*launcher"),
        (({"signals": ["TERM"]}), "no signal 'TERM'; there are KILL, STOP"),
        (({"moments": ["never"]}), "no moment 'never'; there are moving, rest, holding"),
    ],
)
def test_an_unknown_name_is_refused_with_those_that_there_are(chosen: dict, words: str) -> None:
    with pytest.raises(CaseError, match=words):
        cases_of(FILE, **chosen)
