"""HOAP-3's wire: what is sent arrives the same, and what is damaged is rejected and counted by the robot."""

from __future__ import annotations

import zlib

import numpy as np
import pytest

from paramove.msgs import hoap3_wire_pb2 as wire
from paramove.robots.hoap3.wire import batch_message, receive, state_message, state_of
from paramove.robots.streaming.stream import Playing, StreamBatch, StreamReader
from tests.robots.hoap3.movements import HOAP3, swing

PATH = swing(HOAP3, duration_s=1.2)
HELD = HOAP3.units.to_counts(PATH[0])


def reader() -> StreamReader:
    return StreamReader(HOAP3, HELD)


def sent() -> wire.StreamBatch:
    message = batch_message(StreamBatch.of(HOAP3, 7, 0, PATH[1:], 20))
    return wire.StreamBatch.FromString(message.SerializeToString())


def recoded(frames: np.ndarray, joints: int) -> wire.StreamBatch:
    content = frames.astype("<i2").tobytes()
    return wire.StreamBatch(epoch=7, period_us=1000, joint_count=joints, frames=content, crc=zlib.crc32(content))


def changed(**fields: int) -> wire.StreamBatch:
    message = sent()
    for name, value in fields.items():
        setattr(message, name, value)
    return message


def test_a_batch_is_played_as_it_was_written() -> None:
    robot = reader()
    assert receive(sent(), robot)
    assert robot.epoch == 7
    played = np.array([robot.play() for _ in range(len(PATH) - 1)])
    np.testing.assert_array_equal(played, HOAP3.units.to_counts(PATH[1:]))


@pytest.mark.parametrize(
    ("message", "facts"),
    [
        (wire.StreamBatch(), ("0 bytes", "0 16 bit")),
        (changed(crc=1), ("CRC",)),
        (changed(joint_count=27), ("27",)),
        (changed(epoch=0), ("epoch 0",)),
        (changed(period_us=2000), ("period 2000 us", "1000 us")),
        (recoded(HELD[None, :22], 22), ("22 joints", "28")),
        (recoded(np.repeat(HELD[None, :22], 10, axis=0), 28), ("440 bytes",)),
        (recoded(np.empty((0, 28)), 28), ("0 frames",)),
    ],
    ids=["empty", "crc", "joints", "epoch", "period", "22 joints", "22 as 28", "no frames"],
)
def test_what_is_damaged_is_rejected_and_counted(message: wire.StreamBatch, facts: tuple[str, ...]) -> None:
    robot = reader()
    assert not receive(message, robot)
    assert robot.rejected_batches == 1
    for fact in facts:
        assert fact in robot.rejection
    np.testing.assert_array_equal(robot.play(), HELD)


def test_a_report_arrives_as_the_robot_made_it() -> None:
    robot = reader()
    receive(sent(), robot)
    robot.play()
    receive(changed(crc=1), robot)
    state = robot.state(HELD, 1_500_000_000)
    message = wire.Hoap3State.FromString(state_message(state).SerializeToString())
    assert message.playing == wire.Hoap3State.PLAYING_FRAMES
    arrived = state_of(message)
    for name in ("captured_ns", "epoch", "next_index", "depth", "playing", "rejected_batches", "rejection"):
        assert getattr(arrived, name) == getattr(state, name)
    np.testing.assert_array_equal(arrived.counts, state.counts)
    np.testing.assert_array_equal(arrived.target_counts, state.target_counts)


def test_numbers_of_playing_are_those_of_the_wire_and_others_stand_for_nothing_known() -> None:
    known = {name.removeprefix("PLAYING_"): number for name, number in wire.Hoap3State.Playing.items()}
    assert {one.name: int(one) for one in Playing} == known
    assert state_of(wire.Hoap3State.FromString(b"\x28\x63")).playing == Playing.UNSPECIFIED
