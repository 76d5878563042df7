from google.protobuf import timestamp_pb2 as _timestamp_pb2
from google.protobuf.internal import containers as _containers
from google.protobuf import descriptor as _descriptor
from google.protobuf import message as _message
from typing import ClassVar as _ClassVar, Iterable as _Iterable, Mapping as _Mapping, Optional as _Optional, Union as _Union

DESCRIPTOR: _descriptor.FileDescriptor

class PlaneCalibration(_message.Message):
    __slots__ = ("captured", "image_frame", "plane_frame", "plane_z", "plane_from_image", "correspondences", "object")
    CAPTURED_FIELD_NUMBER: _ClassVar[int]
    IMAGE_FRAME_FIELD_NUMBER: _ClassVar[int]
    PLANE_FRAME_FIELD_NUMBER: _ClassVar[int]
    PLANE_Z_FIELD_NUMBER: _ClassVar[int]
    PLANE_FROM_IMAGE_FIELD_NUMBER: _ClassVar[int]
    CORRESPONDENCES_FIELD_NUMBER: _ClassVar[int]
    OBJECT_FIELD_NUMBER: _ClassVar[int]
    captured: _timestamp_pb2.Timestamp
    image_frame: str
    plane_frame: str
    plane_z: float
    plane_from_image: _containers.RepeatedScalarFieldContainer[float]
    correspondences: _containers.RepeatedCompositeFieldContainer[PlaneCorrespondence]
    object: str
    def __init__(self, captured: _Optional[_Union[_timestamp_pb2.Timestamp, _Mapping]] = ..., image_frame: _Optional[str] = ..., plane_frame: _Optional[str] = ..., plane_z: _Optional[float] = ..., plane_from_image: _Optional[_Iterable[float]] = ..., correspondences: _Optional[_Iterable[_Union[PlaneCorrespondence, _Mapping]]] = ..., object: _Optional[str] = ...) -> None: ...

class PlaneCorrespondence(_message.Message):
    __slots__ = ("u_px", "v_px", "x", "y")
    U_PX_FIELD_NUMBER: _ClassVar[int]
    V_PX_FIELD_NUMBER: _ClassVar[int]
    X_FIELD_NUMBER: _ClassVar[int]
    Y_FIELD_NUMBER: _ClassVar[int]
    u_px: float
    v_px: float
    x: float
    y: float
    def __init__(self, u_px: _Optional[float] = ..., v_px: _Optional[float] = ..., x: _Optional[float] = ..., y: _Optional[float] = ...) -> None: ...
