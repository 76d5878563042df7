from google.protobuf import timestamp_pb2 as _timestamp_pb2
from google.protobuf.internal import containers as _containers
from google.protobuf.internal import enum_type_wrapper as _enum_type_wrapper
from google.protobuf import descriptor as _descriptor
from google.protobuf import message as _message
from typing import ClassVar as _ClassVar, Iterable as _Iterable, Mapping as _Mapping, Optional as _Optional, Union as _Union

DESCRIPTOR: _descriptor.FileDescriptor

class TrackedObjects(_message.Message):
    __slots__ = ("captured", "frame", "width_px", "height_px", "objects", "openings")
    CAPTURED_FIELD_NUMBER: _ClassVar[int]
    FRAME_FIELD_NUMBER: _ClassVar[int]
    WIDTH_PX_FIELD_NUMBER: _ClassVar[int]
    HEIGHT_PX_FIELD_NUMBER: _ClassVar[int]
    OBJECTS_FIELD_NUMBER: _ClassVar[int]
    OPENINGS_FIELD_NUMBER: _ClassVar[int]
    captured: _timestamp_pb2.Timestamp
    frame: str
    width_px: int
    height_px: int
    objects: _containers.RepeatedCompositeFieldContainer[TrackedObject]
    openings: _containers.RepeatedCompositeFieldContainer[Opening]
    def __init__(self, captured: _Optional[_Union[_timestamp_pb2.Timestamp, _Mapping]] = ..., frame: _Optional[str] = ..., width_px: _Optional[int] = ..., height_px: _Optional[int] = ..., objects: _Optional[_Iterable[_Union[TrackedObject, _Mapping]]] = ..., openings: _Optional[_Iterable[_Union[Opening, _Mapping]]] = ...) -> None: ...

class Opening(_message.Message):
    __slots__ = ("u_px", "v_px", "area_px", "width_px", "height_px")
    U_PX_FIELD_NUMBER: _ClassVar[int]
    V_PX_FIELD_NUMBER: _ClassVar[int]
    AREA_PX_FIELD_NUMBER: _ClassVar[int]
    WIDTH_PX_FIELD_NUMBER: _ClassVar[int]
    HEIGHT_PX_FIELD_NUMBER: _ClassVar[int]
    u_px: float
    v_px: float
    area_px: float
    width_px: float
    height_px: float
    def __init__(self, u_px: _Optional[float] = ..., v_px: _Optional[float] = ..., area_px: _Optional[float] = ..., width_px: _Optional[float] = ..., height_px: _Optional[float] = ...) -> None: ...

class TrackedObject(_message.Message):
    __slots__ = ("name", "kind", "u_px", "v_px", "area_px", "width_px", "height_px", "confidence", "left_px", "top_px", "outline", "lean", "twin")
    class Kind(int, metaclass=_enum_type_wrapper.EnumTypeWrapper):
        __slots__ = ()
        KIND_UNSPECIFIED: _ClassVar[TrackedObject.Kind]
        KIND_OBJECT: _ClassVar[TrackedObject.Kind]
        KIND_HAND: _ClassVar[TrackedObject.Kind]
    KIND_UNSPECIFIED: TrackedObject.Kind
    KIND_OBJECT: TrackedObject.Kind
    KIND_HAND: TrackedObject.Kind
    NAME_FIELD_NUMBER: _ClassVar[int]
    KIND_FIELD_NUMBER: _ClassVar[int]
    U_PX_FIELD_NUMBER: _ClassVar[int]
    V_PX_FIELD_NUMBER: _ClassVar[int]
    AREA_PX_FIELD_NUMBER: _ClassVar[int]
    WIDTH_PX_FIELD_NUMBER: _ClassVar[int]
    HEIGHT_PX_FIELD_NUMBER: _ClassVar[int]
    CONFIDENCE_FIELD_NUMBER: _ClassVar[int]
    LEFT_PX_FIELD_NUMBER: _ClassVar[int]
    TOP_PX_FIELD_NUMBER: _ClassVar[int]
    OUTLINE_FIELD_NUMBER: _ClassVar[int]
    LEAN_FIELD_NUMBER: _ClassVar[int]
    TWIN_FIELD_NUMBER: _ClassVar[int]
    name: str
    kind: TrackedObject.Kind
    u_px: float
    v_px: float
    area_px: float
    width_px: float
    height_px: float
    confidence: float
    left_px: float
    top_px: float
    outline: _containers.RepeatedCompositeFieldContainer[OutlinePoint]
    lean: float
    twin: bool
    def __init__(self, name: _Optional[str] = ..., kind: _Optional[_Union[TrackedObject.Kind, str]] = ..., u_px: _Optional[float] = ..., v_px: _Optional[float] = ..., area_px: _Optional[float] = ..., width_px: _Optional[float] = ..., height_px: _Optional[float] = ..., confidence: _Optional[float] = ..., left_px: _Optional[float] = ..., top_px: _Optional[float] = ..., outline: _Optional[_Iterable[_Union[OutlinePoint, _Mapping]]] = ..., lean: _Optional[float] = ..., twin: bool = ...) -> None: ...

class OutlinePoint(_message.Message):
    __slots__ = ("u_px", "v_px")
    U_PX_FIELD_NUMBER: _ClassVar[int]
    V_PX_FIELD_NUMBER: _ClassVar[int]
    u_px: float
    v_px: float
    def __init__(self, u_px: _Optional[float] = ..., v_px: _Optional[float] = ...) -> None: ...
