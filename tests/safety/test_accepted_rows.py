"""What was let pass: where new rows may begin, the early stop along it, and giving way to what holds a joint."""

from __future__ import annotations

import numpy as np

from paramove.safety.accepted_rows import AcceptedRows
from paramove.safety.gate_io import Measured
from paramove.safety.stopping import stop_ramp
from tests.safety.small_arm import HOME, LIMITS, PATH

NOTHING = PATH[:0]


def at(index: int, positions: np.ndarray = HOME) -> Measured:
    return Measured(0, positions, HOME, False, index)


def filled() -> AcceptedRows:
    rows = AcceptedRows(LIMITS)
    rows.accept(0, PATH[:30], stop_ramp(PATH[29], PATH[30:], LIMITS), at(0))
    return rows


def test_at_first_the_robot_holds_what_it_says() -> None:
    rows = AcceptedRows(LIMITS)
    assert rows.allowed_from(at(7)) == (7, 7)
    np.testing.assert_array_equal(rows.before(7, at(7)), HOME[None])
    assert rows.held(10) is None
    assert not rows.unplayed(0)
    assert rows.early_ramp(0, at(0)) is None
    assert rows.end_index == 0


def test_accepted_rows_are_known_until_they_are_cleared() -> None:
    rows = filled()
    end = rows.end_index
    assert end > 30
    assert rows.allowed_from(at(5)) == (5, end)
    assert rows.unplayed(end - 1)
    assert not rows.unplayed(end)
    assert rows.held(end - 1) is None
    held = rows.held(end)
    assert held is not None
    assert np.abs(held - PATH[29]).max() > 0.0
    np.testing.assert_array_equal(rows.before(20, at(5)), PATH[17:20])
    np.testing.assert_array_equal(rows.before(1, at(0)), np.concatenate([HOME[None], PATH[:1]]))
    rows.clear()
    assert rows.held(end) is None
    assert rows.end_index == end


def test_later_rows_take_the_place_of_earlier_ones_and_little_of_what_was_played_is_kept() -> None:
    rows = filled()
    targets = rows.accept(20, PATH[20:40], NOTHING, at(15))
    assert (targets.first_index, targets.ramp_rows, targets.end_index) == (20, 0, 40)
    assert rows.end_index > 40  # of all ever given
    np.testing.assert_array_equal(rows.before(40, at(15)), PATH[37:40])
    # Rows before the third that was played when it came are no longer known.
    assert rows.allowed_from(at(0)) == (13, 40)
    np.testing.assert_array_equal(rows.before(13, at(0)), PATH[12:13])
    np.testing.assert_array_equal(rows.held(40), PATH[39])


def test_an_early_stop_runs_along_what_was_accepted() -> None:
    rows = filled()
    targets = rows.early_ramp(10, at(8))
    assert targets is not None
    assert (targets.first_index, targets.ramp_rows) == (10, len(targets.rows))
    np.testing.assert_allclose(targets.rows, stop_ramp(PATH[9], PATH[10:30], LIMITS), rtol=0, atol=1e-6)
    assert LIMITS.first_violation(targets.rows, PATH[6:10], stopping=True) is None
    assert rows.allowed_from(at(8))[1] == targets.end_index


def test_no_early_stop_from_rows_that_are_played_or_not_there() -> None:
    end = filled().end_index
    assert filled().early_ramp(7, at(8)) is None
    assert filled().early_ramp(end, at(8)) is None
    assert filled().early_ramp(end + 5, at(8)) is None
    assert filled().early_ramp(8, at(8)) is not None


def test_a_path_that_rests_needs_no_stop_and_one_that_already_brakes_hard_gets_none() -> None:
    rows = AcceptedRows(LIMITS)
    rows.accept(0, np.zeros((30, 3)), NOTHING, at(0))
    assert rows.early_ramp(3, at(0)) is None
    rows = AcceptedRows(LIMITS)
    cruise = np.outer(0.01 * np.arange(1, 40), LIMITS.velocity)
    braking = np.outer(0.4 - 0.01 * 0.5 ** np.arange(5), LIMITS.velocity)
    rows.accept(0, np.concatenate([cruise, braking]), NOTHING, at(0))
    assert rows.early_ramp(36, at(30)) is None


def test_giving_way_ends_at_the_measured_pose_after_the_ramp() -> None:
    rows = filled()
    ramp = rows.early_ramp(10, at(8))
    assert ramp is not None
    there = np.array([0.3, 0.1, -0.2])
    targets = rows.move_to_measured(ramp, at(8, there))
    assert targets is not None
    assert (targets.first_index, targets.ramp_rows) == (10, len(targets.rows))
    np.testing.assert_array_equal(targets.rows[: len(ramp.rows)], ramp.rows)
    np.testing.assert_allclose(targets.rows[-1], there, rtol=0, atol=1e-12)
    assert rows.allowed_from(at(8))[1] == targets.end_index
    assert LIMITS.first_violation(targets.rows[len(ramp.rows) :], ramp.rows[-1:], rest_at_end=True) is None


def test_without_a_ramp_it_begins_where_the_last_row_ends_or_the_robot_is() -> None:
    rows = filled()
    end = rows.end_index
    targets = rows.move_to_measured(None, at(end, np.full(3, 0.1)))
    assert targets is not None
    assert (targets.first_index, targets.ramp_rows) == (end, len(targets.rows))
    rows = AcceptedRows(LIMITS)
    targets = rows.move_to_measured(None, at(4, np.full(3, 0.1)))
    assert targets is not None
    assert targets.first_index == 4
    np.testing.assert_allclose(targets.rows[-1], 0.1, rtol=0, atol=1e-12)


def test_it_begins_at_the_last_row_itself() -> None:
    rows = AcceptedRows(LIMITS)
    rows.accept(0, np.array([[0.0, 0.0, 0.0], [0.02, 0.0, 0.0]]), NOTHING, at(0))
    targets = rows.move_to_measured(None, at(2, np.array([0.02, 0.0, 0.0])))
    assert targets is not None
    np.testing.assert_array_equal(targets.rows, [[0.02, 0.0, 0.0]])


def test_a_pose_outside_the_range_is_given_way_to_as_far_as_allowed_and_an_unknown_one_not() -> None:
    rows = AcceptedRows(LIMITS)
    targets = rows.move_to_measured(None, at(0, np.array([1.9, -1.9, 0.0])))
    assert targets is not None
    np.testing.assert_allclose(targets.rows[-1], [1.5, -1.5, 0.0], rtol=0, atol=1e-12)
    assert AcceptedRows(LIMITS).move_to_measured(None, at(0, np.array([np.nan, 0.0, 0.0]))) is None
    rows = filled()
    ramp = rows.early_ramp(10, at(8))
    assert rows.move_to_measured(ramp, at(8, np.array([0.0, np.nan, 0.0]))) is ramp
