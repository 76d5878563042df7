"""Demonstration sets: what was written is read bit by bit; what is asked for is given."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from numpy.testing import assert_allclose

from paramove.demonstrations.demonstration_set import DemonstrationSet
from paramove.demonstrations.movement import DemonstrationError, Movement
from paramove.documents import name_fault
from paramove.phmm import InterpolativePHMM
from tests.demonstrations.movements import POINTS, TARGET, a_set, movement

NUMBERS = st.floats(-10.0, 10.0, allow_nan=False, width=64)
TEXTS = st.text(st.characters(codec="utf-8", exclude_categories=("C", "Z")), min_size=1, max_size=12)
NAMES = TEXTS.filter(lambda text: not name_fault(text))


@st.composite
def any_movement(draw):
    count = draw(st.integers(2, 9))
    steps = draw(st.lists(st.integers(10**6, 9 * 10**7), min_size=count - 1, max_size=count - 1))
    return Movement(
        time=np.concatenate([[0], np.cumsum(steps)]) / 1e9,
        positions=draw(arrays(np.float64, (count, 2, 3), elements=NUMBERS)),
        point_names=("wrist", "index"),
        frame="somewhere",
        action=draw(NAMES),
        theta=draw(arrays(np.float64, 2, elements=NUMBERS)),
        parameter_names=("u", "v"),
        subject=draw(TEXTS),
        repetition=draw(st.integers(0, 99)),
        side=draw(st.sampled_from(["left", "right"])),
        recording=draw(st.sampled_from(["a.mcap", "b.mcap"])),
    )


@settings(deadline=None, max_examples=40, derandomize=True)
@given(movements=st.lists(any_movement(), min_size=1, max_size=5))
def test_what_was_written_is_read_bit_by_bit(tmp_path_factory, movements):
    folder = tmp_path_factory.mktemp("sets") / "set"
    DemonstrationSet(tuple(movements), "a text: with 'quotes' # and more").write(folder)
    read = DemonstrationSet.load(folder)
    assert len(read) == len(movements)
    assert read.description == "a text: with 'quotes' # and more"
    for was, now in zip(movements, read, strict=True):
        assert now.positions.tobytes() == (was.positions).tobytes()
        assert now.theta.tobytes() == was.theta.tobytes()
        assert now.time.tobytes() == was.time.tobytes()
        for name in ("point_names", "frame", "action", "parameter_names", "subject", "repetition", "side", "recording"):
            assert getattr(now, name) == getattr(was, name)


def test_sequences_are_what_models_take(tmp_path):
    a_set().write(tmp_path / "set")
    found = DemonstrationSet.load(tmp_path / "set").sequences(subject="P1", rate_hz=25.0)
    assert found.theta.shape == (6, 3)
    assert found.labels == ["reaching"] * 6
    assert set(found.subjects) == {"P1"}
    assert {sequence.shape for sequence in found.sequences} == {(46, 15)}
    assert all(sequence.dtype == np.float64 for sequence in found.sequences)
    model = InterpolativePHMM(4, 4, 6, resampled_frames=20)
    everything = DemonstrationSet.load(tmp_path / "set").sequences()
    assert len(everything.sequences) == 12
    rng = np.random.default_rng(0)
    targets = [(x, y, -0.1) for x in (0.3, 0.4) for y in (-0.1, 0.1)]
    grid = DemonstrationSet(tuple(movement(target + rng.normal(0.0, 1e-3, 3)) for target in targets for _ in range(3)))
    shown = grid.sequences()
    cells = shown.theta[:, :2].round(1)
    hands = [sequence[:, 9:] for sequence in shown.sequences]  # wrist and index; the shoulder does not move
    model.fit(hands, cells)
    assert np.isfinite(model.log_likelihood(hands[0], cells[0]))


def test_demonstrations_carry_their_description():
    shown = a_set().demonstrations()
    assert shown.description.action == "reaching"
    assert shown.description.point_names == POINTS
    assert shown.description.parameter_names == TARGET
    assert shown.description.frame == "body"
    assert shown.description.duration == pytest.approx(1.8)
    two = DemonstrationSet((movement(), movement(action="pointing")))
    with pytest.raises(DemonstrationError, match="a model is of one action; choose among pointing, reaching"):
        two.demonstrations()
    assert len(two.demonstrations("pointing").sequences) == 1


def test_what_is_not_there_is_told_with_what_is():
    with pytest.raises(DemonstrationError, match=r"action waving .*there are the actions reaching and the subjects P1"):
        a_set().select(action="waving")


@pytest.mark.parametrize(
    ("change", "detail"),
    [
        ({"point_names": ("a", "b", "c", "d", "e")}, r"point names \(a, b, c, d, e\), but \(sternum"),
        ({"frame": "laboratory"}, "frame 'laboratory', but 'body'"),
        ({"parameter_names": ("u", "v", "w")}, r"parameter names \(u, v, w\), but \(target_x"),
    ],
)
def test_movements_that_differ_are_no_set(change, detail):
    with pytest.raises(DemonstrationError, match=detail):
        DemonstrationSet((movement(), replace(movement(source="b.mcap, 1 to 2 s"), **change)))


@pytest.mark.parametrize(
    ("change", "detail"),
    [
        ({"time": np.zeros(1), "positions": np.zeros((1, 5, 3))}, "1 frame; a movement has at least 2"),
        ({"time": np.array([0.0, 0.0]), "positions": np.zeros((2, 5, 3))}, "times do not begin at 0 and increase"),
        ({"positions": np.zeros((2, 5, 3))}, r"positions have shape \(2, 5, 3\), expected \(91, 5, 3\)"),
        ({"theta": np.zeros(2)}, r"theta has shape \(2,\)"),
        ({"theta": np.array([0.0, np.nan, 0.0])}, "theta is not finite"),
    ],
)
def test_what_is_no_movement_is_refused_with_its_source(change, detail):
    with pytest.raises(DemonstrationError, match=r"labels.yaml:7: a.mcap, 0 to 1 s: " + detail):
        replace(movement(source="labels.yaml:7: a.mcap, 0 to 1 s"), **change)


def test_frames_that_are_not_finite_are_numbered():
    positions = movement().positions.copy()
    positions[[3, 4, 5, 9], 2] = np.nan
    with pytest.raises(DemonstrationError, match="not finite in frames 3-5, 9;"):
        replace(movement(), positions=positions)


def test_a_set_is_never_written_over_another(tmp_path):
    a_set().write(tmp_path / "set")
    before = {path.name: path.read_bytes() for path in (tmp_path / "set").iterdir()}
    with pytest.raises(DemonstrationError, match="holds a demonstration set already"):
        a_set().write(tmp_path / "set")
    assert {path.name: path.read_bytes() for path in (tmp_path / "set").iterdir()} == before


def test_persons_are_brought_to_one_arm_length():
    large = replace(movement(subject="P2"), positions=1.3 * movement().positions)
    both = DemonstrationSet((movement(), large))
    assert_allclose(
        *[one.point("index") for one in DemonstrationSet((movement(), large)).scaled_to_arm(0.5)], rtol=0.0, atol=1e-12
    )
    middle = both.scaled_to_arm()
    assert_allclose(middle[0].positions, 1.15 * movement().positions, rtol=1e-12, atol=1e-15)
    assert_allclose(middle[0].theta, 1.15 * movement().theta, rtol=1e-12, atol=0.0)
