from google.protobuf.internal import containers as _containers
from google.protobuf.internal import enum_type_wrapper as _enum_type_wrapper
from google.protobuf import descriptor as _descriptor
from google.protobuf import message as _message
from typing import ClassVar as _ClassVar, Iterable as _Iterable, Mapping as _Mapping, Optional as _Optional, Union as _Union

DESCRIPTOR: _descriptor.FileDescriptor

class Clock(_message.Message):
    __slots__ = ("time_ns", "tick", "period_ns", "lockstep", "published")
    TIME_NS_FIELD_NUMBER: _ClassVar[int]
    TICK_FIELD_NUMBER: _ClassVar[int]
    PERIOD_NS_FIELD_NUMBER: _ClassVar[int]
    LOCKSTEP_FIELD_NUMBER: _ClassVar[int]
    PUBLISHED_FIELD_NUMBER: _ClassVar[int]
    time_ns: int
    tick: int
    period_ns: int
    lockstep: bool
    published: _containers.RepeatedCompositeFieldContainer[TopicMark]
    def __init__(self, time_ns: _Optional[int] = ..., tick: _Optional[int] = ..., period_ns: _Optional[int] = ..., lockstep: bool = ..., published: _Optional[_Iterable[_Union[TopicMark, _Mapping]]] = ...) -> None: ...

class TopicMark(_message.Message):
    __slots__ = ("topic", "epoch", "sequence")
    TOPIC_FIELD_NUMBER: _ClassVar[int]
    EPOCH_FIELD_NUMBER: _ClassVar[int]
    SEQUENCE_FIELD_NUMBER: _ClassVar[int]
    topic: str
    epoch: int
    sequence: int
    def __init__(self, topic: _Optional[str] = ..., epoch: _Optional[int] = ..., sequence: _Optional[int] = ...) -> None: ...

class TickDone(_message.Message):
    __slots__ = ("node", "pid", "kind", "tick", "published", "watched_pid")
    class Kind(int, metaclass=_enum_type_wrapper.EnumTypeWrapper):
        __slots__ = ()
        KIND_UNSPECIFIED: _ClassVar[TickDone.Kind]
        KIND_JOIN: _ClassVar[TickDone.Kind]
        KIND_DONE: _ClassVar[TickDone.Kind]
        KIND_LEAVE: _ClassVar[TickDone.Kind]
    KIND_UNSPECIFIED: TickDone.Kind
    KIND_JOIN: TickDone.Kind
    KIND_DONE: TickDone.Kind
    KIND_LEAVE: TickDone.Kind
    NODE_FIELD_NUMBER: _ClassVar[int]
    PID_FIELD_NUMBER: _ClassVar[int]
    KIND_FIELD_NUMBER: _ClassVar[int]
    TICK_FIELD_NUMBER: _ClassVar[int]
    PUBLISHED_FIELD_NUMBER: _ClassVar[int]
    WATCHED_PID_FIELD_NUMBER: _ClassVar[int]
    node: str
    pid: int
    kind: TickDone.Kind
    tick: int
    published: _containers.RepeatedCompositeFieldContainer[TopicMark]
    watched_pid: int
    def __init__(self, node: _Optional[str] = ..., pid: _Optional[int] = ..., kind: _Optional[_Union[TickDone.Kind, str]] = ..., tick: _Optional[int] = ..., published: _Optional[_Iterable[_Union[TopicMark, _Mapping]]] = ..., watched_pid: _Optional[int] = ...) -> None: ...
