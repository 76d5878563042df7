from google.protobuf.internal import containers as _containers
from google.protobuf import descriptor as _descriptor
from google.protobuf import message as _message
from typing import ClassVar as _ClassVar, Iterable as _Iterable, Mapping as _Mapping, Optional as _Optional, Union as _Union

DESCRIPTOR: _descriptor.FileDescriptor

class TruthLayout(_message.Message):
    __slots__ = ("seed", "openings", "rules", "world_from_shoulder", "camera_from_world", "camera_intrinsics", "surface_z", "light_levels", "pixel_noise", "world_from_table", "objects")
    SEED_FIELD_NUMBER: _ClassVar[int]
    OPENINGS_FIELD_NUMBER: _ClassVar[int]
    RULES_FIELD_NUMBER: _ClassVar[int]
    WORLD_FROM_SHOULDER_FIELD_NUMBER: _ClassVar[int]
    CAMERA_FROM_WORLD_FIELD_NUMBER: _ClassVar[int]
    CAMERA_INTRINSICS_FIELD_NUMBER: _ClassVar[int]
    SURFACE_Z_FIELD_NUMBER: _ClassVar[int]
    LIGHT_LEVELS_FIELD_NUMBER: _ClassVar[int]
    PIXEL_NOISE_FIELD_NUMBER: _ClassVar[int]
    WORLD_FROM_TABLE_FIELD_NUMBER: _ClassVar[int]
    OBJECTS_FIELD_NUMBER: _ClassVar[int]
    seed: int
    openings: _containers.RepeatedCompositeFieldContainer[TruthOpening]
    rules: _containers.RepeatedCompositeFieldContainer[TruthRule]
    world_from_shoulder: _containers.RepeatedScalarFieldContainer[float]
    camera_from_world: _containers.RepeatedScalarFieldContainer[float]
    camera_intrinsics: _containers.RepeatedScalarFieldContainer[float]
    surface_z: float
    light_levels: _containers.RepeatedScalarFieldContainer[float]
    pixel_noise: float
    world_from_table: _containers.RepeatedScalarFieldContainer[float]
    objects: _containers.RepeatedCompositeFieldContainer[TruthObject]
    def __init__(self, seed: _Optional[int] = ..., openings: _Optional[_Iterable[_Union[TruthOpening, _Mapping]]] = ..., rules: _Optional[_Iterable[_Union[TruthRule, _Mapping]]] = ..., world_from_shoulder: _Optional[_Iterable[float]] = ..., camera_from_world: _Optional[_Iterable[float]] = ..., camera_intrinsics: _Optional[_Iterable[float]] = ..., surface_z: _Optional[float] = ..., light_levels: _Optional[_Iterable[float]] = ..., pixel_noise: _Optional[float] = ..., world_from_table: _Optional[_Iterable[float]] = ..., objects: _Optional[_Iterable[_Union[TruthObject, _Mapping]]] = ...) -> None: ...

class TruthOpening(_message.Message):
    __slots__ = ("name", "x", "y", "radius")
    NAME_FIELD_NUMBER: _ClassVar[int]
    X_FIELD_NUMBER: _ClassVar[int]
    Y_FIELD_NUMBER: _ClassVar[int]
    RADIUS_FIELD_NUMBER: _ClassVar[int]
    name: str
    x: float
    y: float
    radius: float
    def __init__(self, name: _Optional[str] = ..., x: _Optional[float] = ..., y: _Optional[float] = ..., radius: _Optional[float] = ...) -> None: ...

class TruthObject(_message.Message):
    __slots__ = ("name", "width", "height")
    NAME_FIELD_NUMBER: _ClassVar[int]
    WIDTH_FIELD_NUMBER: _ClassVar[int]
    HEIGHT_FIELD_NUMBER: _ClassVar[int]
    name: str
    width: float
    height: float
    def __init__(self, name: _Optional[str] = ..., width: _Optional[float] = ..., height: _Optional[float] = ...) -> None: ...

class TruthRule(_message.Message):
    __slots__ = ("object", "opening")
    OBJECT_FIELD_NUMBER: _ClassVar[int]
    OPENING_FIELD_NUMBER: _ClassVar[int]
    object: str
    opening: str
    def __init__(self, object: _Optional[str] = ..., opening: _Optional[str] = ...) -> None: ...

class TruthState(_message.Message):
    __slots__ = ("time_ns", "objects", "hand", "gripper", "gripper_commanded", "joint_positions", "unwanted_contacts", "deepest_penetration_mm", "contacts", "instructor")
    TIME_NS_FIELD_NUMBER: _ClassVar[int]
    OBJECTS_FIELD_NUMBER: _ClassVar[int]
    HAND_FIELD_NUMBER: _ClassVar[int]
    GRIPPER_FIELD_NUMBER: _ClassVar[int]
    GRIPPER_COMMANDED_FIELD_NUMBER: _ClassVar[int]
    JOINT_POSITIONS_FIELD_NUMBER: _ClassVar[int]
    UNWANTED_CONTACTS_FIELD_NUMBER: _ClassVar[int]
    DEEPEST_PENETRATION_MM_FIELD_NUMBER: _ClassVar[int]
    CONTACTS_FIELD_NUMBER: _ClassVar[int]
    INSTRUCTOR_FIELD_NUMBER: _ClassVar[int]
    time_ns: int
    objects: _containers.RepeatedCompositeFieldContainer[TruthBody]
    hand: TruthBody
    gripper: _containers.RepeatedScalarFieldContainer[float]
    gripper_commanded: _containers.RepeatedScalarFieldContainer[float]
    joint_positions: _containers.RepeatedScalarFieldContainer[float]
    unwanted_contacts: int
    deepest_penetration_mm: float
    contacts: _containers.RepeatedScalarFieldContainer[str]
    instructor: str
    def __init__(self, time_ns: _Optional[int] = ..., objects: _Optional[_Iterable[_Union[TruthBody, _Mapping]]] = ..., hand: _Optional[_Union[TruthBody, _Mapping]] = ..., gripper: _Optional[_Iterable[float]] = ..., gripper_commanded: _Optional[_Iterable[float]] = ..., joint_positions: _Optional[_Iterable[float]] = ..., unwanted_contacts: _Optional[int] = ..., deepest_penetration_mm: _Optional[float] = ..., contacts: _Optional[_Iterable[str]] = ..., instructor: _Optional[str] = ...) -> None: ...

class TruthBody(_message.Message):
    __slots__ = ("name", "x", "y", "z", "quaternion_xyzw", "held_by_instructor", "last_touched_by")
    NAME_FIELD_NUMBER: _ClassVar[int]
    X_FIELD_NUMBER: _ClassVar[int]
    Y_FIELD_NUMBER: _ClassVar[int]
    Z_FIELD_NUMBER: _ClassVar[int]
    QUATERNION_XYZW_FIELD_NUMBER: _ClassVar[int]
    HELD_BY_INSTRUCTOR_FIELD_NUMBER: _ClassVar[int]
    LAST_TOUCHED_BY_FIELD_NUMBER: _ClassVar[int]
    name: str
    x: float
    y: float
    z: float
    quaternion_xyzw: _containers.RepeatedScalarFieldContainer[float]
    held_by_instructor: bool
    last_touched_by: str
    def __init__(self, name: _Optional[str] = ..., x: _Optional[float] = ..., y: _Optional[float] = ..., z: _Optional[float] = ..., quaternion_xyzw: _Optional[_Iterable[float]] = ..., held_by_instructor: bool = ..., last_touched_by: _Optional[str] = ...) -> None: ...

class TruthArm(_message.Message):
    __slots__ = ("time_ns", "points", "action", "target", "performance", "at_target")
    TIME_NS_FIELD_NUMBER: _ClassVar[int]
    POINTS_FIELD_NUMBER: _ClassVar[int]
    ACTION_FIELD_NUMBER: _ClassVar[int]
    TARGET_FIELD_NUMBER: _ClassVar[int]
    PERFORMANCE_FIELD_NUMBER: _ClassVar[int]
    AT_TARGET_FIELD_NUMBER: _ClassVar[int]
    time_ns: int
    points: _containers.RepeatedCompositeFieldContainer[TruthBody]
    action: str
    target: TruthBody
    performance: int
    at_target: bool
    def __init__(self, time_ns: _Optional[int] = ..., points: _Optional[_Iterable[_Union[TruthBody, _Mapping]]] = ..., action: _Optional[str] = ..., target: _Optional[_Union[TruthBody, _Mapping]] = ..., performance: _Optional[int] = ..., at_target: bool = ...) -> None: ...
