"""HOAP-3's wire: batches of the stream and the robot's reports as messages."""

from __future__ import annotations

import zlib

import numpy as np

from paramove.msgs import hoap3_wire_pb2 as wire
from paramove.robots.streaming import Playing, StreamBatch, StreamReader, StreamState

_FRAME_TYPE = np.dtype("<i2")
_PLAYING = {int(one): one for one in Playing}


def batch_message(batch: StreamBatch) -> wire.StreamBatch:
    """A batch as it is sent."""
    content = batch.frames.astype(_FRAME_TYPE).tobytes()
    return wire.StreamBatch(
        epoch=batch.epoch,
        first_index=batch.first_index,
        period_us=batch.period_us,
        joint_count=batch.frames.shape[1],
        stop_ramp_frames=batch.stop_ramp_frames,
        frames=content,
        crc=zlib.crc32(content),
    )


def receive(message: wire.StreamBatch, reader: StreamReader) -> bool:
    """Offer a received batch to the robot's reader; one that is damaged is rejected and counted there, too."""
    n_joints = message.joint_count
    n_bytes = _FRAME_TYPE.itemsize * n_joints
    crc = zlib.crc32(message.frames)
    if not n_joints or len(message.frames) % n_bytes:
        reader.reject(f"{len(message.frames)} bytes, which are no frames of {n_joints} 16 bit numbers")
        return False
    if crc != message.crc:
        reader.reject(f"CRC {crc:08x}, the batch has {message.crc:08x}")
        return False
    frames = np.frombuffer(message.frames, dtype=_FRAME_TYPE).reshape(-1, n_joints).astype(np.int16)
    return reader.offer(
        StreamBatch(message.epoch, message.first_index, message.period_us, frames, message.stop_ramp_frames)
    )


def state_message(state: StreamState) -> wire.Hoap3State:
    """The robot's report as it is sent."""
    message = wire.Hoap3State(
        epoch=state.epoch,
        next_index=state.next_index,
        depth=state.depth,
        playing=wire.Hoap3State.Playing.Name(state.playing),
        counts=state.counts.tolist(),
        target_counts=state.target_counts.tolist(),
        rejected_batches=state.rejected_batches,
        rejection=state.rejection,
    )
    message.captured.FromNanoseconds(state.captured_ns)
    return message


def state_of(message: wire.Hoap3State) -> StreamState:
    """The report in a received message."""
    return StreamState(
        message.captured.ToNanoseconds(),
        message.epoch,
        message.next_index,
        message.depth,
        _PLAYING.get(message.playing, Playing.UNSPECIFIED),
        np.array(message.counts, dtype=np.int64),
        np.array(message.target_counts, dtype=np.int64),
        message.rejected_batches,
        message.rejection,
    )
