from google.protobuf import timestamp_pb2 as _timestamp_pb2
from google.protobuf.internal import containers as _containers
from google.protobuf.internal import enum_type_wrapper as _enum_type_wrapper
from google.protobuf import descriptor as _descriptor
from google.protobuf import message as _message
from typing import ClassVar as _ClassVar, Iterable as _Iterable, Mapping as _Mapping, Optional as _Optional, Union as _Union

DESCRIPTOR: _descriptor.FileDescriptor

class JointTrajectory(_message.Message):
    __slots__ = ("captured", "id", "joints", "points", "phases")
    CAPTURED_FIELD_NUMBER: _ClassVar[int]
    ID_FIELD_NUMBER: _ClassVar[int]
    JOINTS_FIELD_NUMBER: _ClassVar[int]
    POINTS_FIELD_NUMBER: _ClassVar[int]
    PHASES_FIELD_NUMBER: _ClassVar[int]
    captured: _timestamp_pb2.Timestamp
    id: str
    joints: _containers.RepeatedScalarFieldContainer[str]
    points: _containers.RepeatedCompositeFieldContainer[TrajectoryPoint]
    phases: _containers.RepeatedCompositeFieldContainer[TrajectoryPhase]
    def __init__(self, captured: _Optional[_Union[_timestamp_pb2.Timestamp, _Mapping]] = ..., id: _Optional[str] = ..., joints: _Optional[_Iterable[str]] = ..., points: _Optional[_Iterable[_Union[TrajectoryPoint, _Mapping]]] = ..., phases: _Optional[_Iterable[_Union[TrajectoryPhase, _Mapping]]] = ...) -> None: ...

class TrajectoryPoint(_message.Message):
    __slots__ = ("time_s", "position_rad")
    TIME_S_FIELD_NUMBER: _ClassVar[int]
    POSITION_RAD_FIELD_NUMBER: _ClassVar[int]
    time_s: float
    position_rad: _containers.RepeatedScalarFieldContainer[float]
    def __init__(self, time_s: _Optional[float] = ..., position_rad: _Optional[_Iterable[float]] = ...) -> None: ...

class TrajectoryPhase(_message.Message):
    __slots__ = ("name", "start_s")
    NAME_FIELD_NUMBER: _ClassVar[int]
    START_S_FIELD_NUMBER: _ClassVar[int]
    name: str
    start_s: float
    def __init__(self, name: _Optional[str] = ..., start_s: _Optional[float] = ...) -> None: ...

class TrajectoryStatus(_message.Message):
    __slots__ = ("captured", "trajectory_id", "state", "time_s", "duration_s", "reason", "code")
    class State(int, metaclass=_enum_type_wrapper.EnumTypeWrapper):
        __slots__ = ()
        STATE_UNSPECIFIED: _ClassVar[TrajectoryStatus.State]
        STATE_ACCEPTED: _ClassVar[TrajectoryStatus.State]
        STATE_EXECUTING: _ClassVar[TrajectoryStatus.State]
        STATE_SUCCEEDED: _ClassVar[TrajectoryStatus.State]
        STATE_STOPPED: _ClassVar[TrajectoryStatus.State]
        STATE_REJECTED: _ClassVar[TrajectoryStatus.State]
    STATE_UNSPECIFIED: TrajectoryStatus.State
    STATE_ACCEPTED: TrajectoryStatus.State
    STATE_EXECUTING: TrajectoryStatus.State
    STATE_SUCCEEDED: TrajectoryStatus.State
    STATE_STOPPED: TrajectoryStatus.State
    STATE_REJECTED: TrajectoryStatus.State
    CAPTURED_FIELD_NUMBER: _ClassVar[int]
    TRAJECTORY_ID_FIELD_NUMBER: _ClassVar[int]
    STATE_FIELD_NUMBER: _ClassVar[int]
    TIME_S_FIELD_NUMBER: _ClassVar[int]
    DURATION_S_FIELD_NUMBER: _ClassVar[int]
    REASON_FIELD_NUMBER: _ClassVar[int]
    CODE_FIELD_NUMBER: _ClassVar[int]
    captured: _timestamp_pb2.Timestamp
    trajectory_id: str
    state: TrajectoryStatus.State
    time_s: float
    duration_s: float
    reason: str
    code: str
    def __init__(self, captured: _Optional[_Union[_timestamp_pb2.Timestamp, _Mapping]] = ..., trajectory_id: _Optional[str] = ..., state: _Optional[_Union[TrajectoryStatus.State, str]] = ..., time_s: _Optional[float] = ..., duration_s: _Optional[float] = ..., reason: _Optional[str] = ..., code: _Optional[str] = ...) -> None: ...
