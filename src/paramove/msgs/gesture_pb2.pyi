from google.protobuf import timestamp_pb2 as _timestamp_pb2
from google.protobuf.internal import enum_type_wrapper as _enum_type_wrapper
from google.protobuf import descriptor as _descriptor
from google.protobuf import message as _message
from typing import ClassVar as _ClassVar, Mapping as _Mapping, Optional as _Optional, Union as _Union

DESCRIPTOR: _descriptor.FileDescriptor

class Gesture(_message.Message):
    __slots__ = ("captured", "kind", "object", "u_px", "v_px", "located", "frame", "x", "y", "confidence", "width_m", "height_m", "twin", "turn_rad", "length_m")
    class Kind(int, metaclass=_enum_type_wrapper.EnumTypeWrapper):
        __slots__ = ()
        KIND_UNSPECIFIED: _ClassVar[Gesture.Kind]
        KIND_APPEARED: _ClassVar[Gesture.Kind]
        KIND_MOVED: _ClassVar[Gesture.Kind]
        KIND_RESTED: _ClassVar[Gesture.Kind]
        KIND_VANISHED: _ClassVar[Gesture.Kind]
        KIND_POINTED_AT: _ClassVar[Gesture.Kind]
        KIND_HAND_APPEARED: _ClassVar[Gesture.Kind]
        KIND_HAND_VANISHED: _ClassVar[Gesture.Kind]
    KIND_UNSPECIFIED: Gesture.Kind
    KIND_APPEARED: Gesture.Kind
    KIND_MOVED: Gesture.Kind
    KIND_RESTED: Gesture.Kind
    KIND_VANISHED: Gesture.Kind
    KIND_POINTED_AT: Gesture.Kind
    KIND_HAND_APPEARED: Gesture.Kind
    KIND_HAND_VANISHED: Gesture.Kind
    CAPTURED_FIELD_NUMBER: _ClassVar[int]
    KIND_FIELD_NUMBER: _ClassVar[int]
    OBJECT_FIELD_NUMBER: _ClassVar[int]
    U_PX_FIELD_NUMBER: _ClassVar[int]
    V_PX_FIELD_NUMBER: _ClassVar[int]
    LOCATED_FIELD_NUMBER: _ClassVar[int]
    FRAME_FIELD_NUMBER: _ClassVar[int]
    X_FIELD_NUMBER: _ClassVar[int]
    Y_FIELD_NUMBER: _ClassVar[int]
    CONFIDENCE_FIELD_NUMBER: _ClassVar[int]
    WIDTH_M_FIELD_NUMBER: _ClassVar[int]
    HEIGHT_M_FIELD_NUMBER: _ClassVar[int]
    TWIN_FIELD_NUMBER: _ClassVar[int]
    TURN_RAD_FIELD_NUMBER: _ClassVar[int]
    LENGTH_M_FIELD_NUMBER: _ClassVar[int]
    captured: _timestamp_pb2.Timestamp
    kind: Gesture.Kind
    object: str
    u_px: float
    v_px: float
    located: bool
    frame: str
    x: float
    y: float
    confidence: float
    width_m: float
    height_m: float
    twin: bool
    turn_rad: float
    length_m: float
    def __init__(self, captured: _Optional[_Union[_timestamp_pb2.Timestamp, _Mapping]] = ..., kind: _Optional[_Union[Gesture.Kind, str]] = ..., object: _Optional[str] = ..., u_px: _Optional[float] = ..., v_px: _Optional[float] = ..., located: bool = ..., frame: _Optional[str] = ..., x: _Optional[float] = ..., y: _Optional[float] = ..., confidence: _Optional[float] = ..., width_m: _Optional[float] = ..., height_m: _Optional[float] = ..., twin: bool = ..., turn_rad: _Optional[float] = ..., length_m: _Optional[float] = ...) -> None: ...
