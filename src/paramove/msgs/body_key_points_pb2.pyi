from google.protobuf import timestamp_pb2 as _timestamp_pb2
from google.protobuf.internal import containers as _containers
from google.protobuf import descriptor as _descriptor
from google.protobuf import message as _message
from typing import ClassVar as _ClassVar, Iterable as _Iterable, Mapping as _Mapping, Optional as _Optional, Union as _Union

DESCRIPTOR: _descriptor.FileDescriptor

class BodyKeyPoints(_message.Message):
    __slots__ = ("captured", "certainty", "points", "px_per_m")
    CAPTURED_FIELD_NUMBER: _ClassVar[int]
    CERTAINTY_FIELD_NUMBER: _ClassVar[int]
    POINTS_FIELD_NUMBER: _ClassVar[int]
    PX_PER_M_FIELD_NUMBER: _ClassVar[int]
    captured: _timestamp_pb2.Timestamp
    certainty: float
    points: _containers.RepeatedCompositeFieldContainer[KeyPoint]
    px_per_m: float
    def __init__(self, captured: _Optional[_Union[_timestamp_pb2.Timestamp, _Mapping]] = ..., certainty: _Optional[float] = ..., points: _Optional[_Iterable[_Union[KeyPoint, _Mapping]]] = ..., px_per_m: _Optional[float] = ...) -> None: ...

class KeyPoint(_message.Message):
    __slots__ = ("name", "x", "y", "deviation", "depth", "certainty")
    NAME_FIELD_NUMBER: _ClassVar[int]
    X_FIELD_NUMBER: _ClassVar[int]
    Y_FIELD_NUMBER: _ClassVar[int]
    DEVIATION_FIELD_NUMBER: _ClassVar[int]
    DEPTH_FIELD_NUMBER: _ClassVar[int]
    CERTAINTY_FIELD_NUMBER: _ClassVar[int]
    name: str
    x: float
    y: float
    deviation: float
    depth: float
    certainty: float
    def __init__(self, name: _Optional[str] = ..., x: _Optional[float] = ..., y: _Optional[float] = ..., deviation: _Optional[float] = ..., depth: _Optional[float] = ..., certainty: _Optional[float] = ...) -> None: ...
