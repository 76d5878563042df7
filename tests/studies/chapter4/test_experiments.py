"""The pieces of work behind the report on chapter 4."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from studies.chapter4.experiments import QUICK, Scale, experiments
from studies.chapter4.kinds import IPHMM_3, KINDS, QPHMM_3
from studies.chapter4.summary import Interval, fitted_name, over_seeds
from studies.chapter4.targets import targets_of


def test_every_piece_has_a_name_of_its_own() -> None:
    work = experiments([0, 1], Scale())
    assert len({one.key() for one in work}) == len(work)
    assert len({one.label for one in work}) == len(work)


def test_another_seed_or_scale_is_another_piece() -> None:
    first = {one.label: one.key() for one in experiments([0], QUICK)}
    again = {one.label: one.key() for one in experiments([0], replace(QUICK, every=1))}
    changed = {label for label in first if first[label] != again[label]}
    assert changed == {label for label in first if label.startswith("models")}


def test_slow_models_come_last() -> None:
    names = [one.labels.get("name", "") for one in experiments([0], Scale())]
    first = next(number for number, name in enumerate(names) if "IPHMM" in name)
    assert all("IPHMM" in name for name in names[first:])


def test_an_interval_of_seeds_is_student_s() -> None:
    found = over_seeds([1.0, 2.0, 3.0, 4.0, 5.0])
    assert_allclose(found.mean, 3.0, rtol=1e-12)
    assert_allclose(found.high - found.mean, 2.776445 * np.sqrt(2.5 / 5.0), rtol=1e-5)
    assert np.isnan(over_seeds([1.0]).low)


def around(value: float) -> Interval:
    return Interval(value, value - 0.01, value + 0.01, 5, value - 0.02, value + 0.02)


def row(name: str, **changed: float) -> dict[str, object]:
    usual = {"theta": 0.8, "synthesis_pointing": 1.6, "correct": 0.99, "covered": 0.95}
    usual |= dict.fromkeys(("action", "redirect", "aborted", "stopped"), 1.0)
    measures = {key: around(value) for key, value in (usual | changed).items()}
    return {"name": name, "states": 20, **measures}


def summary(**changed: float) -> dict[str, object]:
    jerk = {"training": "9 pairs, demonstrated", "model": "linear", "jerk": around(0.5)}
    return {
        "models": [row(kind.name, **(changed if kind.name == QPHMM_3 else {})) for kind in KINDS],
        "classification": {"hmmlearn": around(0.88), "plain HMM": around(1.0)},
        "redirect": [{**jerk, "most_jerk": changed.get("most_jerk", 0.7)}],
    }


def test_all_goals_met() -> None:
    assert all(target.met for target in targets_of(summary()))


@pytest.mark.parametrize(
    ("measure", "value", "missed"),
    [
        ("theta", 1.3, "error of θ, QPHMM"),
        ("synthesis_pointing", 1.8, "synthesis, QPHMM"),
        ("correct", 0.89, "right action, every 3×3 model"),
        ("most_jerk", 1.3, "jerk of redirect, 9 demonstrations"),
    ],
)
def test_the_worst_model_decides(measure: str, value: float, missed: str) -> None:
    targets = targets_of(summary(**{measure: value}))
    assert [target.what for target in targets if not target.met] == [missed]


def test_a_goal_shows_how_its_seeds_differ() -> None:
    found = {target.what: target for target in targets_of(summary(synthesis_pointing=1.69))}["synthesis, QPHMM"]
    assert found.met
    assert "1.67 to 1.71" in found.measured


@pytest.mark.parametrize(
    ("hidden", "expected"), [([[0, 0], [0, 0]], "quadratic"), ([[0, 0], [0, 2]], "0 to 2 hidden units"), ([[], []], "")]
)
def test_a_row_is_named_by_what_was_fitted(hidden: list[list[int]], expected: str) -> None:
    name = fitted_name("NPHMM 3×3", [{"hidden": units} for units in hidden])
    assert name.startswith("NPHMM 3×3")
    assert name.removeprefix("NPHMM 3×3").count(expected) == 1 if expected else name == "NPHMM 3×3"


def test_two_by_two_models_are_no_goal() -> None:
    found = summary()
    found["models"] = [
        {**one, **row(one["name"], theta=9.0)} if "2×2" in one["name"] else one for one in found["models"]
    ]
    assert all(target.met for target in targets_of(found))
    assert IPHMM_3 in {one["name"] for one in found["models"]}
