from google.protobuf import timestamp_pb2 as _timestamp_pb2
from google.protobuf.internal import containers as _containers
from google.protobuf.internal import enum_type_wrapper as _enum_type_wrapper
from google.protobuf import descriptor as _descriptor
from google.protobuf import message as _message
from typing import ClassVar as _ClassVar, Iterable as _Iterable, Mapping as _Mapping, Optional as _Optional, Union as _Union

DESCRIPTOR: _descriptor.FileDescriptor

class Rules(_message.Message):
    __slots__ = ("captured", "frame", "rules")
    CAPTURED_FIELD_NUMBER: _ClassVar[int]
    FRAME_FIELD_NUMBER: _ClassVar[int]
    RULES_FIELD_NUMBER: _ClassVar[int]
    captured: _timestamp_pb2.Timestamp
    frame: str
    rules: _containers.RepeatedCompositeFieldContainer[Rule]
    def __init__(self, captured: _Optional[_Union[_timestamp_pb2.Timestamp, _Mapping]] = ..., frame: _Optional[str] = ..., rules: _Optional[_Iterable[_Union[Rule, _Mapping]]] = ...) -> None: ...

class Rule(_message.Message):
    __slots__ = ("object", "x", "y", "seen", "observations", "text")
    OBJECT_FIELD_NUMBER: _ClassVar[int]
    X_FIELD_NUMBER: _ClassVar[int]
    Y_FIELD_NUMBER: _ClassVar[int]
    SEEN_FIELD_NUMBER: _ClassVar[int]
    OBSERVATIONS_FIELD_NUMBER: _ClassVar[int]
    TEXT_FIELD_NUMBER: _ClassVar[int]
    object: str
    x: float
    y: float
    seen: _timestamp_pb2.Timestamp
    observations: int
    text: str
    def __init__(self, object: _Optional[str] = ..., x: _Optional[float] = ..., y: _Optional[float] = ..., seen: _Optional[_Union[_timestamp_pb2.Timestamp, _Mapping]] = ..., observations: _Optional[int] = ..., text: _Optional[str] = ...) -> None: ...

class ApplicationStage(_message.Message):
    __slots__ = ("captured", "stage", "step", "detail", "grasps", "retries")
    class Stage(int, metaclass=_enum_type_wrapper.EnumTypeWrapper):
        __slots__ = ()
        STAGE_UNSPECIFIED: _ClassVar[ApplicationStage.Stage]
        STAGE_CALIBRATE: _ClassVar[ApplicationStage.Stage]
        STAGE_LEARN: _ClassVar[ApplicationStage.Stage]
        STAGE_APPLY: _ClassVar[ApplicationStage.Stage]
        STAGE_DONE: _ClassVar[ApplicationStage.Stage]
        STAGE_FAILED: _ClassVar[ApplicationStage.Stage]
    STAGE_UNSPECIFIED: ApplicationStage.Stage
    STAGE_CALIBRATE: ApplicationStage.Stage
    STAGE_LEARN: ApplicationStage.Stage
    STAGE_APPLY: ApplicationStage.Stage
    STAGE_DONE: ApplicationStage.Stage
    STAGE_FAILED: ApplicationStage.Stage
    CAPTURED_FIELD_NUMBER: _ClassVar[int]
    STAGE_FIELD_NUMBER: _ClassVar[int]
    STEP_FIELD_NUMBER: _ClassVar[int]
    DETAIL_FIELD_NUMBER: _ClassVar[int]
    GRASPS_FIELD_NUMBER: _ClassVar[int]
    RETRIES_FIELD_NUMBER: _ClassVar[int]
    captured: _timestamp_pb2.Timestamp
    stage: ApplicationStage.Stage
    step: str
    detail: str
    grasps: int
    retries: int
    def __init__(self, captured: _Optional[_Union[_timestamp_pb2.Timestamp, _Mapping]] = ..., stage: _Optional[_Union[ApplicationStage.Stage, str]] = ..., step: _Optional[str] = ..., detail: _Optional[str] = ..., grasps: _Optional[int] = ..., retries: _Optional[int] = ...) -> None: ...

class Speech(_message.Message):
    __slots__ = ("captured", "request", "object", "text")
    class Request(int, metaclass=_enum_type_wrapper.EnumTypeWrapper):
        __slots__ = ()
        REQUEST_UNSPECIFIED: _ClassVar[Speech.Request]
        REQUEST_HAND_ME_AN_OBJECT: _ClassVar[Speech.Request]
        REQUEST_LET_GO: _ClassVar[Speech.Request]
        REQUEST_SHOW_RULES: _ClassVar[Speech.Request]
        REQUEST_SHOW_RULE_AGAIN: _ClassVar[Speech.Request]
        REQUEST_POINT_AT_OBJECT: _ClassVar[Speech.Request]
        REQUEST_HELP: _ClassVar[Speech.Request]
        REQUEST_THANK_YOU: _ClassVar[Speech.Request]
        REQUEST_POINT_AT_PLACE: _ClassVar[Speech.Request]
        REQUEST_STAND_OBJECT_AT_START: _ClassVar[Speech.Request]
    REQUEST_UNSPECIFIED: Speech.Request
    REQUEST_HAND_ME_AN_OBJECT: Speech.Request
    REQUEST_LET_GO: Speech.Request
    REQUEST_SHOW_RULES: Speech.Request
    REQUEST_SHOW_RULE_AGAIN: Speech.Request
    REQUEST_POINT_AT_OBJECT: Speech.Request
    REQUEST_HELP: Speech.Request
    REQUEST_THANK_YOU: Speech.Request
    REQUEST_POINT_AT_PLACE: Speech.Request
    REQUEST_STAND_OBJECT_AT_START: Speech.Request
    CAPTURED_FIELD_NUMBER: _ClassVar[int]
    REQUEST_FIELD_NUMBER: _ClassVar[int]
    OBJECT_FIELD_NUMBER: _ClassVar[int]
    TEXT_FIELD_NUMBER: _ClassVar[int]
    captured: _timestamp_pb2.Timestamp
    request: Speech.Request
    object: str
    text: str
    def __init__(self, captured: _Optional[_Union[_timestamp_pb2.Timestamp, _Mapping]] = ..., request: _Optional[_Union[Speech.Request, str]] = ..., object: _Optional[str] = ..., text: _Optional[str] = ...) -> None: ...
