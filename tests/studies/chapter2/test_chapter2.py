"""The experiments of thesis chapter 2: the movement, single trainings, and the report on a short version of all."""

import json
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose
from typer.testing import CliRunner

from studies.__main__ import app
from studies.chapter2 import experiment, figures, findings
from studies.chapter2.drawing import ellipse
from studies.chapter2.figures import FIGURES, PLAIN_5, TIMED_5, TIMED_10, Setting
from studies.chapter2.movement import PARAMETER_SETS, demonstration, prototype, training_set
from studies.chapter2.training import trained

PROPERTY = settings(max_examples=25, deadline=None, derandomize=True)


def test_the_prototype_goes_out_along_its_slope_and_back_to_the_axis() -> None:
    movement = prototype(0.2, np.array([0.0, 0.5, 1.0, 1.5, 2.0]))
    assert_allclose(movement, [[0, 0], [0.5, 0.1], [1, 0.2], [1.5, 0.1], [2, 0]], rtol=0.0, atol=1e-12)


@PROPERTY
@given(st.floats(-0.25, 0.25), st.integers(20, 100), st.integers(0, 999))
def test_a_performance_is_its_prototype_at_another_rate_and_with_noise(p: float, frames: int, seed: int) -> None:
    movement = demonstration(p, frames, np.random.default_rng(seed))
    assert movement.shape == (frames, 2)
    times = np.linspace(0.0, 2.0, 2001)
    gap = np.abs(movement[:, None] - prototype(p, times)[None]).max(axis=2).min(axis=1)
    assert gap.max() < 0.0055
    out = int((movement[:, 0] <= 1.0).sum())
    assert 0.35 * frames - 2 <= out <= 0.65 * frames + 2


@pytest.mark.parametrize("name", PARAMETER_SETS)
def test_parameters_of_a_set_lie_within_the_bound_about_zero(name: str) -> None:
    fractions = PARAMETER_SETS[name](np.random.default_rng(0))  # type: ignore[index]
    assert len(fractions) == 10
    assert np.abs(fractions).max() <= 1.0
    assert_allclose(fractions.mean(), 0.0, rtol=0.0, atol=1e-12)
    assert len(training_set(0, parameters=name)) == 10  # type: ignore[arg-type]


def test_an_ellipse_has_mahalanobis_distance_one() -> None:
    covariance = np.array([[0.4, 0.1], [0.1, 0.2]])
    offset = ellipse(np.array([1.0, 2.0]), covariance) - [1.0, 2.0]
    distance = np.einsum("ni,ij,nj->n", offset, np.linalg.inv(covariance), offset)
    assert_allclose(distance, 1.0, rtol=1e-12, atol=0.0)


@pytest.mark.parametrize(
    "setting", [Setting("ergodic", 5), Setting("skips", 6), PLAIN_5, TIMED_5], ids=lambda setting: setting.kind
)
def test_the_likelihood_never_falls(setting: Setting) -> None:
    training = trained(setting, 0, 15)
    assert len(training.snapshots) == len(training.log_likelihoods) == 16
    steps = np.diff(training.log_likelihoods)
    assert (steps > -1e-6 * np.abs(training.log_likelihoods[0])).all()


def test_time_restrictions_keep_the_means_on_the_axis_where_a_plain_chain_leaves_it() -> None:
    plain, timed = trained(PLAIN_5, 0, 150), trained(TIMED_5, 0, 50)
    assert experiment.drift(plain.snapshots[0], PLAIN_5) < findings.ON_AXIS
    assert experiment.drift(plain.snapshots[-1], PLAIN_5) > findings.ON_AXIS
    assert experiment.drift(timed.snapshots[-1], TIMED_5) < 0.5 * findings.ON_AXIS
    assert experiment.unevenness(timed.snapshots[-1]) < 1.3


def test_five_iterations_suffice_with_time_restrictions_from_simple_means() -> None:
    there = trained(TIMED_10, 0, 5).snapshots[-1].means
    simple = trained(Setting("durations", 10, d_min=3, d_max=6, start="simple"), 0, 5).snapshots[-1].means
    assert_allclose(simple, there, rtol=0.0, atol=0.05)


@pytest.fixture(scope="module")
def short() -> experiment.Experiment:
    """Everything with 20 iterations and few repetitions."""
    with pytest.MonkeyPatch.context() as patch:
        for kind in figures.LAST:
            patch.setitem(figures.LAST, kind, 20)  # type: ignore[arg-type]
        for name, value in {"RANDOM_STARTS": 2, "RANDOM_ITERATIONS": 20, "SETS": 1, "SET_ITERATIONS": 2}.items():
            patch.setattr(experiment, name, value)
        return experiment.run_experiment(0)


def test_the_command_writes_a_report_of_every_figure_that_needs_no_other_file(
    short: experiment.Experiment, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for kind in figures.LAST:
        monkeypatch.setitem(figures.LAST, kind, 20)
    monkeypatch.setattr(experiment, "run_experiment", lambda seed, report: short)
    answer = CliRunner().invoke(app, ["chapter2", "--out", str(tmp_path), "--json", str(tmp_path / "numbers.json")])
    assert answer.exit_code == 0, answer.output
    numbers = json.loads((tmp_path / "numbers.json").read_text(encoding="utf-8"))
    assert "report: " in answer.output
    page = (tmp_path / "report.html").read_text(encoding="utf-8")
    for figure in FIGURES:
        assert f"Figure {figure.number}: " in page
        assert (tmp_path / f"figure_{figure.number}.png").stat().st_size > 2000
    assert page.count("src='data:image/png;base64,") == page.count("<img")
    assert [word for word in ("http:", "https:", "<script", "<link") if word in page] == []
    assert json.loads((tmp_path / "chapter2.json").read_text(encoding="utf-8")) == numbers
    assert {row["as_in_the_thesis"] for row in numbers["figures"]} <= {"yes", "in part", "no"}
    assert [row["figure"] for row in numbers["figures"]] == [f"2.{number}" for number in range(8, 25)]


def test_sequences_drawn_along_a_branch_are_rough_but_likely(short: experiment.Experiment) -> None:
    drawn = short.sampled
    assert drawn["drawn_roughness"] > 5.0 * drawn["training_roughness"]
    assert drawn["drawn_log_likelihood"] > drawn["training_log_likelihood"] - 1.0
