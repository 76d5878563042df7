from google.protobuf import timestamp_pb2 as _timestamp_pb2
from google.protobuf.internal import containers as _containers
from google.protobuf.internal import enum_type_wrapper as _enum_type_wrapper
from google.protobuf import descriptor as _descriptor
from google.protobuf import message as _message
from typing import ClassVar as _ClassVar, Iterable as _Iterable, Mapping as _Mapping, Optional as _Optional, Union as _Union

DESCRIPTOR: _descriptor.FileDescriptor

class SafetyState(_message.Message):
    __slots__ = ("captured", "state", "faults", "limited_frames", "rejected_trajectories")
    class State(int, metaclass=_enum_type_wrapper.EnumTypeWrapper):
        __slots__ = ()
        STATE_UNSPECIFIED: _ClassVar[SafetyState.State]
        STATE_DISCONNECTED: _ClassVar[SafetyState.State]
        STATE_DISARMED: _ClassVar[SafetyState.State]
        STATE_ARMED: _ClassVar[SafetyState.State]
        STATE_STOPPING: _ClassVar[SafetyState.State]
        STATE_HOLD: _ClassVar[SafetyState.State]
        STATE_ESTOP: _ClassVar[SafetyState.State]
    STATE_UNSPECIFIED: SafetyState.State
    STATE_DISCONNECTED: SafetyState.State
    STATE_DISARMED: SafetyState.State
    STATE_ARMED: SafetyState.State
    STATE_STOPPING: SafetyState.State
    STATE_HOLD: SafetyState.State
    STATE_ESTOP: SafetyState.State
    CAPTURED_FIELD_NUMBER: _ClassVar[int]
    STATE_FIELD_NUMBER: _ClassVar[int]
    FAULTS_FIELD_NUMBER: _ClassVar[int]
    LIMITED_FRAMES_FIELD_NUMBER: _ClassVar[int]
    REJECTED_TRAJECTORIES_FIELD_NUMBER: _ClassVar[int]
    captured: _timestamp_pb2.Timestamp
    state: SafetyState.State
    faults: _containers.RepeatedCompositeFieldContainer[SafetyFault]
    limited_frames: int
    rejected_trajectories: int
    def __init__(self, captured: _Optional[_Union[_timestamp_pb2.Timestamp, _Mapping]] = ..., state: _Optional[_Union[SafetyState.State, str]] = ..., faults: _Optional[_Iterable[_Union[SafetyFault, _Mapping]]] = ..., limited_frames: _Optional[int] = ..., rejected_trajectories: _Optional[int] = ...) -> None: ...

class SafetyFault(_message.Message):
    __slots__ = ("code", "joint", "detail")
    CODE_FIELD_NUMBER: _ClassVar[int]
    JOINT_FIELD_NUMBER: _ClassVar[int]
    DETAIL_FIELD_NUMBER: _ClassVar[int]
    code: str
    joint: str
    detail: str
    def __init__(self, code: _Optional[str] = ..., joint: _Optional[str] = ..., detail: _Optional[str] = ...) -> None: ...

class ArmRequest(_message.Message):
    __slots__ = ("captured", "source", "armed", "reason", "by_person")
    CAPTURED_FIELD_NUMBER: _ClassVar[int]
    SOURCE_FIELD_NUMBER: _ClassVar[int]
    ARMED_FIELD_NUMBER: _ClassVar[int]
    REASON_FIELD_NUMBER: _ClassVar[int]
    BY_PERSON_FIELD_NUMBER: _ClassVar[int]
    captured: _timestamp_pb2.Timestamp
    source: str
    armed: bool
    reason: str
    by_person: bool
    def __init__(self, captured: _Optional[_Union[_timestamp_pb2.Timestamp, _Mapping]] = ..., source: _Optional[str] = ..., armed: bool = ..., reason: _Optional[str] = ..., by_person: bool = ...) -> None: ...

class LinkState(_message.Message):
    __slots__ = ("captured", "hosts")
    CAPTURED_FIELD_NUMBER: _ClassVar[int]
    HOSTS_FIELD_NUMBER: _ClassVar[int]
    captured: _timestamp_pb2.Timestamp
    hosts: _containers.RepeatedScalarFieldContainer[str]
    def __init__(self, captured: _Optional[_Union[_timestamp_pb2.Timestamp, _Mapping]] = ..., hosts: _Optional[_Iterable[str]] = ...) -> None: ...

class StopRequest(_message.Message):
    __slots__ = ("captured", "source")
    CAPTURED_FIELD_NUMBER: _ClassVar[int]
    SOURCE_FIELD_NUMBER: _ClassVar[int]
    captured: _timestamp_pb2.Timestamp
    source: str
    def __init__(self, captured: _Optional[_Union[_timestamp_pb2.Timestamp, _Mapping]] = ..., source: _Optional[str] = ...) -> None: ...
