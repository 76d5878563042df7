"""The firmware's log is judged as strictly as the gate judges what it lets pass."""

from pathlib import Path

import numpy as np
import pytest

from sim.simulator import FIRMWARE_LOG
from studies.faults.firmware_log import FILE, largest_step, read_frames
from tests.robots.hoap3.movements import HOAP3

BASE = HOAP3.units.to_counts(HOAP3.base_pose).astype(np.int32)
ELBOW = HOAP3.index("right_elbow")


def at_speed(deg_per_s: float, milliseconds: int = 200) -> np.ndarray:
    """The elbow at an even speed from the base pose on, with a start and an end that are within the limits."""
    frames = np.repeat(BASE[None], milliseconds, axis=0)
    ramp = np.clip(np.minimum(np.arange(milliseconds), np.arange(milliseconds)[::-1]) / 80, 0.0, 1.0)
    frames[:, ELBOW] += np.cumsum(ramp * deg_per_s * 0.209).round().astype(np.int32)
    return frames


def test_at_rest_nothing_steps() -> None:
    step = largest_step(np.repeat(BASE[None], 50, axis=0), HOAP3)
    assert (step.share, step.bend_share, step.counts, step.frames) == (0.0, 0.0, 0, 50)
    assert step.within_limits


def test_a_movement_at_the_limit_is_within_it_and_a_faster_one_is_not() -> None:
    assert 0.95 < largest_step(at_speed(180.0), HOAP3).share <= 1.0
    assert largest_step(at_speed(180.0), HOAP3).within_limits
    fast = largest_step(at_speed(200.0), HOAP3)
    assert not fast.within_limits
    assert fast.joint == "right_elbow"


def test_a_jump_is_found_with_its_joint_and_time() -> None:
    frames = np.repeat(BASE[None], 100, axis=0)
    frames[60:, ELBOW] += 300
    step = largest_step(frames, HOAP3)
    assert (step.joint, step.counts, step.at_ms) == ("right_elbow", 300, 60)
    assert step.share > 5
    assert not step.within_limits


def test_a_sudden_halt_is_a_change_of_speed_beyond_the_limit() -> None:
    frames = at_speed(150.0)
    frames[100:, ELBOW] = frames[99, ELBOW]
    step = largest_step(frames, HOAP3)
    assert step.share <= 1.0
    assert step.bend_share > 1.0
    assert not step.within_limits


@pytest.mark.parametrize("cut", [0, 1, 55])
def test_a_log_that_was_cut_off_is_read_up_to_its_last_whole_frame(tmp_path: Path, cut: int) -> None:
    frames = at_speed(90.0, 100)
    content = frames.astype("<i2").tobytes()
    (tmp_path / FILE).write_bytes(content[: len(content) - cut])
    read = read_frames(tmp_path / FILE, HOAP3.n_joints)
    np.testing.assert_array_equal(read, frames[: 100 if not cut else 99])


def test_the_simulator_writes_the_file_that_is_read() -> None:
    assert FIRMWARE_LOG == FILE
