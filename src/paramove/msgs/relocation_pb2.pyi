from google.protobuf import timestamp_pb2 as _timestamp_pb2
from google.protobuf.internal import containers as _containers
from google.protobuf.internal import enum_type_wrapper as _enum_type_wrapper
from google.protobuf import descriptor as _descriptor
from google.protobuf import message as _message
from typing import ClassVar as _ClassVar, Iterable as _Iterable, Mapping as _Mapping, Optional as _Optional, Union as _Union

DESCRIPTOR: _descriptor.FileDescriptor

class RelocationGoal(_message.Message):
    __slots__ = ("id", "kind", "object", "frame", "to", "attempt", "avoid", "asked_again", "object_width_m", "object_height_m", "object_turn_rad", "object_length_m", "plan_only")
    class Kind(int, metaclass=_enum_type_wrapper.EnumTypeWrapper):
        __slots__ = ()
        KIND_UNSPECIFIED: _ClassVar[RelocationGoal.Kind]
        KIND_RELOCATE: _ClassVar[RelocationGoal.Kind]
        KIND_OFFER_HAND: _ClassVar[RelocationGoal.Kind]
        KIND_TAKE: _ClassVar[RelocationGoal.Kind]
        KIND_PLACE_HELD: _ClassVar[RelocationGoal.Kind]
        KIND_REST: _ClassVar[RelocationGoal.Kind]
        KIND_RELEASE: _ClassVar[RelocationGoal.Kind]
        KIND_FETCH: _ClassVar[RelocationGoal.Kind]
    KIND_UNSPECIFIED: RelocationGoal.Kind
    KIND_RELOCATE: RelocationGoal.Kind
    KIND_OFFER_HAND: RelocationGoal.Kind
    KIND_TAKE: RelocationGoal.Kind
    KIND_PLACE_HELD: RelocationGoal.Kind
    KIND_REST: RelocationGoal.Kind
    KIND_RELEASE: RelocationGoal.Kind
    KIND_FETCH: RelocationGoal.Kind
    ID_FIELD_NUMBER: _ClassVar[int]
    KIND_FIELD_NUMBER: _ClassVar[int]
    OBJECT_FIELD_NUMBER: _ClassVar[int]
    FRAME_FIELD_NUMBER: _ClassVar[int]
    FROM_FIELD_NUMBER: _ClassVar[int]
    TO_FIELD_NUMBER: _ClassVar[int]
    ATTEMPT_FIELD_NUMBER: _ClassVar[int]
    AVOID_FIELD_NUMBER: _ClassVar[int]
    ASKED_AGAIN_FIELD_NUMBER: _ClassVar[int]
    OBJECT_WIDTH_M_FIELD_NUMBER: _ClassVar[int]
    OBJECT_HEIGHT_M_FIELD_NUMBER: _ClassVar[int]
    OBJECT_TURN_RAD_FIELD_NUMBER: _ClassVar[int]
    OBJECT_LENGTH_M_FIELD_NUMBER: _ClassVar[int]
    PLAN_ONLY_FIELD_NUMBER: _ClassVar[int]
    id: str
    kind: RelocationGoal.Kind
    object: str
    frame: str
    to: Position
    attempt: int
    avoid: _containers.RepeatedCompositeFieldContainer[Position]
    asked_again: bool
    object_width_m: float
    object_height_m: float
    object_turn_rad: float
    object_length_m: float
    plan_only: bool
    def __init__(self, id: _Optional[str] = ..., kind: _Optional[_Union[RelocationGoal.Kind, str]] = ..., object: _Optional[str] = ..., frame: _Optional[str] = ..., to: _Optional[_Union[Position, _Mapping]] = ..., attempt: _Optional[int] = ..., avoid: _Optional[_Iterable[_Union[Position, _Mapping]]] = ..., asked_again: bool = ..., object_width_m: _Optional[float] = ..., object_height_m: _Optional[float] = ..., object_turn_rad: _Optional[float] = ..., object_length_m: _Optional[float] = ..., plan_only: bool = ..., **kwargs) -> None: ...

class Position(_message.Message):
    __slots__ = ("x", "y", "z")
    X_FIELD_NUMBER: _ClassVar[int]
    Y_FIELD_NUMBER: _ClassVar[int]
    Z_FIELD_NUMBER: _ClassVar[int]
    x: float
    y: float
    z: float
    def __init__(self, x: _Optional[float] = ..., y: _Optional[float] = ..., z: _Optional[float] = ...) -> None: ...

class RelocationStatus(_message.Message):
    __slots__ = ("captured", "goal_id", "state", "phase", "reason", "holding", "elbow_turn_rad", "in_the_way", "from_hull", "to_hull", "misfit")
    class State(int, metaclass=_enum_type_wrapper.EnumTypeWrapper):
        __slots__ = ()
        STATE_UNSPECIFIED: _ClassVar[RelocationStatus.State]
        STATE_ACCEPTED: _ClassVar[RelocationStatus.State]
        STATE_EXECUTING: _ClassVar[RelocationStatus.State]
        STATE_SUCCEEDED: _ClassVar[RelocationStatus.State]
        STATE_FAILED: _ClassVar[RelocationStatus.State]
        STATE_REJECTED: _ClassVar[RelocationStatus.State]
    STATE_UNSPECIFIED: RelocationStatus.State
    STATE_ACCEPTED: RelocationStatus.State
    STATE_EXECUTING: RelocationStatus.State
    STATE_SUCCEEDED: RelocationStatus.State
    STATE_FAILED: RelocationStatus.State
    STATE_REJECTED: RelocationStatus.State
    class Hull(int, metaclass=_enum_type_wrapper.EnumTypeWrapper):
        __slots__ = ()
        HULL_UNSPECIFIED: _ClassVar[RelocationStatus.Hull]
        HULL_INSIDE: _ClassVar[RelocationStatus.Hull]
        HULL_OUTSIDE: _ClassVar[RelocationStatus.Hull]
    HULL_UNSPECIFIED: RelocationStatus.Hull
    HULL_INSIDE: RelocationStatus.Hull
    HULL_OUTSIDE: RelocationStatus.Hull
    CAPTURED_FIELD_NUMBER: _ClassVar[int]
    GOAL_ID_FIELD_NUMBER: _ClassVar[int]
    STATE_FIELD_NUMBER: _ClassVar[int]
    PHASE_FIELD_NUMBER: _ClassVar[int]
    REASON_FIELD_NUMBER: _ClassVar[int]
    HOLDING_FIELD_NUMBER: _ClassVar[int]
    ELBOW_TURN_RAD_FIELD_NUMBER: _ClassVar[int]
    IN_THE_WAY_FIELD_NUMBER: _ClassVar[int]
    FROM_HULL_FIELD_NUMBER: _ClassVar[int]
    TO_HULL_FIELD_NUMBER: _ClassVar[int]
    MISFIT_FIELD_NUMBER: _ClassVar[int]
    captured: _timestamp_pb2.Timestamp
    goal_id: str
    state: RelocationStatus.State
    phase: str
    reason: str
    holding: bool
    elbow_turn_rad: float
    in_the_way: _containers.RepeatedScalarFieldContainer[int]
    from_hull: RelocationStatus.Hull
    to_hull: RelocationStatus.Hull
    misfit: bool
    def __init__(self, captured: _Optional[_Union[_timestamp_pb2.Timestamp, _Mapping]] = ..., goal_id: _Optional[str] = ..., state: _Optional[_Union[RelocationStatus.State, str]] = ..., phase: _Optional[str] = ..., reason: _Optional[str] = ..., holding: bool = ..., elbow_turn_rad: _Optional[float] = ..., in_the_way: _Optional[_Iterable[int]] = ..., from_hull: _Optional[_Union[RelocationStatus.Hull, str]] = ..., to_hull: _Optional[_Union[RelocationStatus.Hull, str]] = ..., misfit: bool = ...) -> None: ...
