from google.protobuf import timestamp_pb2 as _timestamp_pb2
from google.protobuf.internal import containers as _containers
from google.protobuf.internal import enum_type_wrapper as _enum_type_wrapper
from google.protobuf import descriptor as _descriptor
from google.protobuf import message as _message
from typing import ClassVar as _ClassVar, Iterable as _Iterable, Mapping as _Mapping, Optional as _Optional, Union as _Union

DESCRIPTOR: _descriptor.FileDescriptor

class NodeStatus(_message.Message):
    __slots__ = ("node", "state", "detail", "pid", "captured", "processing_seconds", "processed", "published", "received", "parameters")
    class State(int, metaclass=_enum_type_wrapper.EnumTypeWrapper):
        __slots__ = ()
        STATE_UNSPECIFIED: _ClassVar[NodeStatus.State]
        STATE_STARTING: _ClassVar[NodeStatus.State]
        STATE_READY: _ClassVar[NodeStatus.State]
        STATE_DEGRADED: _ClassVar[NodeStatus.State]
        STATE_FAILED: _ClassVar[NodeStatus.State]
        STATE_STOPPED: _ClassVar[NodeStatus.State]
    STATE_UNSPECIFIED: NodeStatus.State
    STATE_STARTING: NodeStatus.State
    STATE_READY: NodeStatus.State
    STATE_DEGRADED: NodeStatus.State
    STATE_FAILED: NodeStatus.State
    STATE_STOPPED: NodeStatus.State
    NODE_FIELD_NUMBER: _ClassVar[int]
    STATE_FIELD_NUMBER: _ClassVar[int]
    DETAIL_FIELD_NUMBER: _ClassVar[int]
    PID_FIELD_NUMBER: _ClassVar[int]
    CAPTURED_FIELD_NUMBER: _ClassVar[int]
    PROCESSING_SECONDS_FIELD_NUMBER: _ClassVar[int]
    PROCESSED_FIELD_NUMBER: _ClassVar[int]
    PUBLISHED_FIELD_NUMBER: _ClassVar[int]
    RECEIVED_FIELD_NUMBER: _ClassVar[int]
    PARAMETERS_FIELD_NUMBER: _ClassVar[int]
    node: str
    state: NodeStatus.State
    detail: str
    pid: int
    captured: _timestamp_pb2.Timestamp
    processing_seconds: float
    processed: int
    published: _containers.RepeatedCompositeFieldContainer[TopicCount]
    received: _containers.RepeatedCompositeFieldContainer[TopicCount]
    parameters: _containers.RepeatedCompositeFieldContainer[NodeParameter]
    def __init__(self, node: _Optional[str] = ..., state: _Optional[_Union[NodeStatus.State, str]] = ..., detail: _Optional[str] = ..., pid: _Optional[int] = ..., captured: _Optional[_Union[_timestamp_pb2.Timestamp, _Mapping]] = ..., processing_seconds: _Optional[float] = ..., processed: _Optional[int] = ..., published: _Optional[_Iterable[_Union[TopicCount, _Mapping]]] = ..., received: _Optional[_Iterable[_Union[TopicCount, _Mapping]]] = ..., parameters: _Optional[_Iterable[_Union[NodeParameter, _Mapping]]] = ...) -> None: ...

class NodeParameter(_message.Message):
    __slots__ = ("name", "value", "request_id", "rejection", "late", "changed")
    NAME_FIELD_NUMBER: _ClassVar[int]
    VALUE_FIELD_NUMBER: _ClassVar[int]
    REQUEST_ID_FIELD_NUMBER: _ClassVar[int]
    REJECTION_FIELD_NUMBER: _ClassVar[int]
    LATE_FIELD_NUMBER: _ClassVar[int]
    CHANGED_FIELD_NUMBER: _ClassVar[int]
    name: str
    value: str
    request_id: str
    rejection: str
    late: bool
    changed: _timestamp_pb2.Timestamp
    def __init__(self, name: _Optional[str] = ..., value: _Optional[str] = ..., request_id: _Optional[str] = ..., rejection: _Optional[str] = ..., late: bool = ..., changed: _Optional[_Union[_timestamp_pb2.Timestamp, _Mapping]] = ...) -> None: ...

class TopicCount(_message.Message):
    __slots__ = ("topic", "messages", "lost", "repeated_", "rejected")
    TOPIC_FIELD_NUMBER: _ClassVar[int]
    MESSAGES_FIELD_NUMBER: _ClassVar[int]
    LOST_FIELD_NUMBER: _ClassVar[int]
    REPEATED__FIELD_NUMBER: _ClassVar[int]
    REJECTED_FIELD_NUMBER: _ClassVar[int]
    topic: str
    messages: int
    lost: int
    repeated_: int
    rejected: int
    def __init__(self, topic: _Optional[str] = ..., messages: _Optional[int] = ..., lost: _Optional[int] = ..., repeated_: _Optional[int] = ..., rejected: _Optional[int] = ...) -> None: ...
