from google.protobuf import timestamp_pb2 as _timestamp_pb2
from google.protobuf.internal import containers as _containers
from google.protobuf.internal import enum_type_wrapper as _enum_type_wrapper
from google.protobuf import descriptor as _descriptor
from google.protobuf import message as _message
from typing import ClassVar as _ClassVar, Iterable as _Iterable, Mapping as _Mapping, Optional as _Optional, Union as _Union

DESCRIPTOR: _descriptor.FileDescriptor

class StreamBatch(_message.Message):
    __slots__ = ("epoch", "first_index", "period_us", "joint_count", "stop_ramp_frames", "frames", "crc")
    EPOCH_FIELD_NUMBER: _ClassVar[int]
    FIRST_INDEX_FIELD_NUMBER: _ClassVar[int]
    PERIOD_US_FIELD_NUMBER: _ClassVar[int]
    JOINT_COUNT_FIELD_NUMBER: _ClassVar[int]
    STOP_RAMP_FRAMES_FIELD_NUMBER: _ClassVar[int]
    FRAMES_FIELD_NUMBER: _ClassVar[int]
    CRC_FIELD_NUMBER: _ClassVar[int]
    epoch: int
    first_index: int
    period_us: int
    joint_count: int
    stop_ramp_frames: int
    frames: bytes
    crc: int
    def __init__(self, epoch: _Optional[int] = ..., first_index: _Optional[int] = ..., period_us: _Optional[int] = ..., joint_count: _Optional[int] = ..., stop_ramp_frames: _Optional[int] = ..., frames: _Optional[bytes] = ..., crc: _Optional[int] = ...) -> None: ...

class Hoap3State(_message.Message):
    __slots__ = ("captured", "epoch", "next_index", "depth", "playing", "counts", "rejected_batches", "rejection", "target_counts")
    class Playing(int, metaclass=_enum_type_wrapper.EnumTypeWrapper):
        __slots__ = ()
        PLAYING_UNSPECIFIED: _ClassVar[Hoap3State.Playing]
        PLAYING_NOTHING: _ClassVar[Hoap3State.Playing]
        PLAYING_FRAMES: _ClassVar[Hoap3State.Playing]
        PLAYING_STOP_RAMP: _ClassVar[Hoap3State.Playing]
        PLAYING_HELD: _ClassVar[Hoap3State.Playing]
    PLAYING_UNSPECIFIED: Hoap3State.Playing
    PLAYING_NOTHING: Hoap3State.Playing
    PLAYING_FRAMES: Hoap3State.Playing
    PLAYING_STOP_RAMP: Hoap3State.Playing
    PLAYING_HELD: Hoap3State.Playing
    CAPTURED_FIELD_NUMBER: _ClassVar[int]
    EPOCH_FIELD_NUMBER: _ClassVar[int]
    NEXT_INDEX_FIELD_NUMBER: _ClassVar[int]
    DEPTH_FIELD_NUMBER: _ClassVar[int]
    PLAYING_FIELD_NUMBER: _ClassVar[int]
    COUNTS_FIELD_NUMBER: _ClassVar[int]
    REJECTED_BATCHES_FIELD_NUMBER: _ClassVar[int]
    REJECTION_FIELD_NUMBER: _ClassVar[int]
    TARGET_COUNTS_FIELD_NUMBER: _ClassVar[int]
    captured: _timestamp_pb2.Timestamp
    epoch: int
    next_index: int
    depth: int
    playing: Hoap3State.Playing
    counts: _containers.RepeatedScalarFieldContainer[int]
    rejected_batches: int
    rejection: str
    target_counts: _containers.RepeatedScalarFieldContainer[int]
    def __init__(self, captured: _Optional[_Union[_timestamp_pb2.Timestamp, _Mapping]] = ..., epoch: _Optional[int] = ..., next_index: _Optional[int] = ..., depth: _Optional[int] = ..., playing: _Optional[_Union[Hoap3State.Playing, str]] = ..., counts: _Optional[_Iterable[int]] = ..., rejected_batches: _Optional[int] = ..., rejection: _Optional[str] = ..., target_counts: _Optional[_Iterable[int]] = ...) -> None: ...
