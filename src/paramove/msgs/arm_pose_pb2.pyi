from google.protobuf import timestamp_pb2 as _timestamp_pb2
from google.protobuf.internal import containers as _containers
from google.protobuf import descriptor as _descriptor
from google.protobuf import message as _message
from typing import ClassVar as _ClassVar, Iterable as _Iterable, Mapping as _Mapping, Optional as _Optional, Union as _Union

DESCRIPTOR: _descriptor.FileDescriptor

class ArmPose(_message.Message):
    __slots__ = ("captured", "frame", "points")
    CAPTURED_FIELD_NUMBER: _ClassVar[int]
    FRAME_FIELD_NUMBER: _ClassVar[int]
    POINTS_FIELD_NUMBER: _ClassVar[int]
    captured: _timestamp_pb2.Timestamp
    frame: str
    points: _containers.RepeatedCompositeFieldContainer[BodyPoint]
    def __init__(self, captured: _Optional[_Union[_timestamp_pb2.Timestamp, _Mapping]] = ..., frame: _Optional[str] = ..., points: _Optional[_Iterable[_Union[BodyPoint, _Mapping]]] = ...) -> None: ...

class BodyPoint(_message.Message):
    __slots__ = ("name", "x", "y", "z")
    NAME_FIELD_NUMBER: _ClassVar[int]
    X_FIELD_NUMBER: _ClassVar[int]
    Y_FIELD_NUMBER: _ClassVar[int]
    Z_FIELD_NUMBER: _ClassVar[int]
    name: str
    x: float
    y: float
    z: float
    def __init__(self, name: _Optional[str] = ..., x: _Optional[float] = ..., y: _Optional[float] = ..., z: _Optional[float] = ...) -> None: ...
