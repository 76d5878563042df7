"""The stream: what the reader rejects, and that it never plays anything but a smooth movement."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from paramove.robots.joint_units import JointRangeError
from paramove.robots.streaming.stream import Playing, StreamBatch, StreamReader
from paramove.safety.stopping import stop_ramp
from tests.robots.hoap3.movements import HOAP3, swing

EPOCH = 7
LIMITS = HOAP3.motion_limits
PATH = swing(HOAP3, duration_s=1.2)


def reader() -> StreamReader:
    return StreamReader(HOAP3, HOAP3.units.to_counts(PATH[0]))


def cut(first: int, cover: int, epoch: int = EPOCH) -> StreamBatch:
    """Rows first … first + cover of the path, then a stop ramp, or the path's end."""
    rows = PATH[1:][first : first + cover]
    ahead = PATH[1:][first + cover : first + cover + 400]
    ramp = stop_ramp(rows[-1], ahead, LIMITS) if len(ahead) else rows[:0]
    return StreamBatch.of(HOAP3, epoch, first, np.concatenate([rows, ramp]), len(ramp))


def played_to_rest(robot: StreamReader) -> np.ndarray:
    frames = [robot.target]
    while not robot.at_rest:
        frames.append(robot.play())
    return np.array(frames, dtype=np.float64)


def test_a_batch_alone_is_a_movement_that_ends_at_rest() -> None:
    robot = reader()
    assert robot.playing == Playing.NOTHING
    assert robot.offer(cut(0, 300))
    assert robot.playing == Playing.FRAMES
    frames = played_to_rest(robot)
    assert robot.playing == Playing.HELD
    assert len(frames) > 350
    assert np.abs(np.diff(frames[-4:], axis=0)).max() <= 1  # counts


def test_successive_batches_play_the_whole_path_exactly() -> None:
    robot, frames = reader(), []
    for start in range(0, len(PATH) - 1, 67):
        assert robot.offer(cut(max(0, start), 400)), robot.rejection
        frames += [robot.play() for _ in range(67)]
    expected = HOAP3.units.to_counts(PATH[1:])
    np.testing.assert_array_equal(np.array(frames)[: len(expected)], expected)


@settings(deadline=None, max_examples=60, derandomize=True)
@given(stalls=st.lists(st.integers(min_value=0, max_value=450), min_size=1, max_size=12), data=st.data())
def test_any_pattern_of_stalls_and_losses_stays_within_velocity_and_acceleration(
    stalls: list[int], data: st.DataObject
) -> None:
    """Ticks of random length, some batches lost: the frames that are played keep the limits, the ramps included."""
    robot, frames = reader(), []
    for stall in stalls:
        guard = data.draw(st.integers(min_value=0, max_value=150))
        first = robot.next_index + guard
        lost = data.draw(st.integers(min_value=0, max_value=4)) == 0
        if not lost and first < len(PATH) - 1:
            robot.offer(cut(first, data.draw(st.integers(min_value=50, max_value=400))))
        frames += [robot.play() for _ in range(stall)]
    frames += [*played_to_rest(robot)[1:], *([robot.target] * 8)]
    counts = np.array([reader().target] * 8 + frames, dtype=np.float64)
    per_rad = np.abs(HOAP3.units.counts_per_rad)
    assert (np.abs(np.diff(counts, axis=0)) <= per_rad * HOAP3.velocity * 1e-3 + 1).all()
    for span in (4, 16):
        bend = np.abs(counts[2 * span :] - 2 * counts[span:-span] + counts[: -2 * span])
        assert (bend <= per_rad * HOAP3.stop_acceleration * (span * 1e-3) ** 2 + 2).all()


def changed(**fields: int) -> StreamBatch:
    return replace(cut(0, 300), **fields)


def of_frames(frames: np.ndarray, first_index: int = 0) -> StreamBatch:
    return StreamBatch(EPOCH, first_index, 1000, frames.astype(np.int16), 0)


HELD = HOAP3.units.to_counts(PATH[0])
JUMP = np.repeat(HELD[None], 20, axis=0)
JUMP[10:, 6] += 424  # 2 deg within one frame, as in a published recording
RADIANS = np.rint(np.repeat(PATH[:1], 20, axis=0))


@pytest.mark.parametrize(
    ("batch", "reason"),
    [
        (changed(period_us=2000), "period 2000 us, allowed 1000 us"),
        (changed(epoch=0), "epoch 0"),
        (changed(stop_ramp_frames=10_000), "stop ramp of 10000"),
        (of_frames(np.empty((0, 28))), "0 frames"),
        (of_frames(JUMP), "right_shoulder_pitch: a step of 424 counts from 18810 to 19234, allowed 57"),
        (of_frames(RADIANS), "head_tilt: 0 counts, allowed 15 to 75"),
        (of_frames(np.full((10, 28), 32767)), "32767 counts, allowed"),
        (of_frames(np.zeros((10, 20))), "20 joints, allowed 28"),
    ],
)
def test_bad_batches_are_refused_and_nothing_is_played(batch: StreamBatch, reason: str) -> None:
    robot = reader()
    assert not robot.offer(batch)
    assert reason in robot.rejection
    assert robot.rejected_batches == 1
    assert robot.at_rest
    np.testing.assert_array_equal(robot.play(), HELD)


def test_late_duplicated_and_foreign_batches_are_refused_while_playing() -> None:
    robot = reader()
    assert robot.offer(cut(0, 300))
    for _ in range(10):
        robot.play()
    late, foreign, gap = cut(0, 300), cut(20, 300, epoch=8), cut(900, 100)
    for batch, reason in ((late, "too late"), (foreign, "allowed only at rest"), (gap, "a gap")):
        assert not robot.offer(batch)
        assert reason in robot.rejection
    assert robot.playing == Playing.FRAMES
    played_to_rest(robot)
    assert robot.offer(StreamBatch.of(HOAP3, 8, 0, HOAP3.units.to_radians(robot.target)[None], 0))


def test_a_movement_that_ends_without_a_ramp_is_refused() -> None:
    robot = reader()
    assert not robot.offer(StreamBatch.of(HOAP3, EPOCH, 0, PATH[1:500], 0))
    assert "speed changes" in robot.rejection


def test_state_reports_target_and_measured_counts() -> None:
    robot = reader()
    robot.offer(cut(0, 300))
    frame = robot.play()
    state = robot.state(HELD, captured_ns=1_500_000_000)
    assert (state.epoch, state.next_index, state.captured_ns) == (EPOCH, 1, 1_500_000_000)
    assert list(state.target_counts) == list(frame)
    assert list(state.counts) == list(HELD)


def test_counts_beyond_16_bits_never_become_a_batch() -> None:
    rows = np.repeat(PATH[:1], 3, axis=0)
    rows[1, 6] = np.deg2rad(40_000 / 209)
    with pytest.raises(JointRangeError, match="right_shoulder_pitch"):
        StreamBatch.of(HOAP3, EPOCH, 0, rows, 0)


def test_more_frames_than_the_buffer_takes_are_refused() -> None:
    robot = reader()
    assert robot.offer(of_frames(np.repeat(HELD[None], 5000, axis=0)))
    assert not robot.offer(of_frames(np.repeat(HELD[None], 5001, axis=0)))
    assert robot.rejection == "5001 frames, allowed 1 to 5000"
    appended = of_frames(HELD[None], 5000)
    assert not robot.offer(appended)
    assert robot.rejection == "5001 frames to be played, allowed 5000: the buffer is full"
    assert robot.depth == 5000
    robot.play()
    assert robot.offer(appended)


def moving() -> StreamReader:
    robot = reader()
    assert robot.offer(cut(0, 300))
    for _ in range(150):
        robot.play()
    return robot


def test_a_batch_that_overlaps_takes_the_place_of_what_it_overlaps() -> None:
    robot = moving()
    assert robot.offer(cut(200, 300))
    frames = [robot.play() for _ in range(350)]
    np.testing.assert_array_equal(frames, HOAP3.units.to_counts(PATH[151:501]))


def test_an_overlap_that_does_not_continue_the_movement_is_refused_and_the_ramp_plays() -> None:
    robot = moving()
    depth = robot.depth
    elsewhere = replace(cut(600, 300), first_index=200)
    assert not robot.offer(elsewhere)
    assert "a step of" in robot.rejection
    assert robot.depth == depth


def test_after_a_lost_batch_the_next_joins_or_is_a_gap() -> None:
    robot = moving()
    assert robot.offer(cut(267, 300)), "one lost of batches every 67 frames: still within what is there"
    robot = moving()
    end = robot.next_index + robot.depth
    assert not robot.offer(cut(end + 1, 300))
    assert robot.rejection == f"first index {end + 1}, allowed up to {end}: a gap"
    played = played_to_rest(robot)
    assert np.abs(np.diff(played[-4:], axis=0)).max() <= 1


def test_a_batch_repeated_changes_nothing_and_one_repeated_too_late_is_refused() -> None:
    robot = moving()
    batch = cut(200, 300)
    assert robot.offer(batch)
    depth = robot.depth
    assert robot.offer(batch)
    assert robot.depth == depth
    for _ in range(60):
        robot.play()
    assert not robot.offer(batch)
    assert robot.rejection == "first index 200, played up to 210: too late"
    assert robot.depth == depth - 60


def test_batches_in_the_wrong_order_are_played_smoothly_or_refused() -> None:
    robot = moving()
    assert robot.offer(cut(240, 300))
    assert robot.offer(cut(180, 300)), "the older one ends earlier, in its own ramp"
    frames = [*(robot.play() for _ in range(330))]
    np.testing.assert_array_equal(frames, HOAP3.units.to_counts(PATH[151:481]))
    played = played_to_rest(robot)
    assert np.abs(np.diff(played[-4:], axis=0)).max() <= 1


def test_accelerations_are_judged_over_a_frame_of_10_ms() -> None:
    slow = replace(HOAP3, stream=HOAP3.stream.model_copy(update={"period_us": 10_000}))
    robot = StreamReader(slow, HELD)
    path = PATH[10::10]
    assert robot.offer(StreamBatch.of(slow, EPOCH, 0, path, 0)), robot.rejection
    assert not robot.offer(StreamBatch.of(slow, EPOCH, 0, path[:60], 0))
    assert "counts in 1 frames" in robot.rejection
