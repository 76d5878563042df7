from google.protobuf import timestamp_pb2 as _timestamp_pb2
from google.protobuf.internal import containers as _containers
from google.protobuf import descriptor as _descriptor
from google.protobuf import message as _message
from typing import ClassVar as _ClassVar, Iterable as _Iterable, Mapping as _Mapping, Optional as _Optional, Union as _Union

DESCRIPTOR: _descriptor.FileDescriptor

class ActionEstimate(_message.Message):
    __slots__ = ("captured", "frame", "actions", "progress", "effective_sample_size", "particles", "views", "lost", "degraded", "detail", "hand", "pointed", "target")
    CAPTURED_FIELD_NUMBER: _ClassVar[int]
    FRAME_FIELD_NUMBER: _ClassVar[int]
    ACTIONS_FIELD_NUMBER: _ClassVar[int]
    PROGRESS_FIELD_NUMBER: _ClassVar[int]
    EFFECTIVE_SAMPLE_SIZE_FIELD_NUMBER: _ClassVar[int]
    PARTICLES_FIELD_NUMBER: _ClassVar[int]
    VIEWS_FIELD_NUMBER: _ClassVar[int]
    LOST_FIELD_NUMBER: _ClassVar[int]
    DEGRADED_FIELD_NUMBER: _ClassVar[int]
    DETAIL_FIELD_NUMBER: _ClassVar[int]
    HAND_FIELD_NUMBER: _ClassVar[int]
    POINTED_FIELD_NUMBER: _ClassVar[int]
    TARGET_FIELD_NUMBER: _ClassVar[int]
    captured: _timestamp_pb2.Timestamp
    frame: str
    actions: _containers.RepeatedCompositeFieldContainer[ActionProbability]
    progress: _containers.RepeatedScalarFieldContainer[float]
    effective_sample_size: float
    particles: int
    views: int
    lost: bool
    degraded: bool
    detail: str
    hand: Location
    pointed: Location
    target: PointedTarget
    def __init__(self, captured: _Optional[_Union[_timestamp_pb2.Timestamp, _Mapping]] = ..., frame: _Optional[str] = ..., actions: _Optional[_Iterable[_Union[ActionProbability, _Mapping]]] = ..., progress: _Optional[_Iterable[float]] = ..., effective_sample_size: _Optional[float] = ..., particles: _Optional[int] = ..., views: _Optional[int] = ..., lost: bool = ..., degraded: bool = ..., detail: _Optional[str] = ..., hand: _Optional[_Union[Location, _Mapping]] = ..., pointed: _Optional[_Union[Location, _Mapping]] = ..., target: _Optional[_Union[PointedTarget, _Mapping]] = ...) -> None: ...

class ActionProbability(_message.Message):
    __slots__ = ("action", "probability", "parameters")
    ACTION_FIELD_NUMBER: _ClassVar[int]
    PROBABILITY_FIELD_NUMBER: _ClassVar[int]
    PARAMETERS_FIELD_NUMBER: _ClassVar[int]
    action: str
    probability: float
    parameters: _containers.RepeatedCompositeFieldContainer[ActionParameter]
    def __init__(self, action: _Optional[str] = ..., probability: _Optional[float] = ..., parameters: _Optional[_Iterable[_Union[ActionParameter, _Mapping]]] = ...) -> None: ...

class ActionParameter(_message.Message):
    __slots__ = ("name", "mean", "deviation", "covariance")
    NAME_FIELD_NUMBER: _ClassVar[int]
    MEAN_FIELD_NUMBER: _ClassVar[int]
    DEVIATION_FIELD_NUMBER: _ClassVar[int]
    COVARIANCE_FIELD_NUMBER: _ClassVar[int]
    name: str
    mean: float
    deviation: float
    covariance: _containers.RepeatedScalarFieldContainer[float]
    def __init__(self, name: _Optional[str] = ..., mean: _Optional[float] = ..., deviation: _Optional[float] = ..., covariance: _Optional[_Iterable[float]] = ...) -> None: ...

class Location(_message.Message):
    __slots__ = ("x", "y", "z", "x_deviation", "y_deviation", "z_deviation")
    X_FIELD_NUMBER: _ClassVar[int]
    Y_FIELD_NUMBER: _ClassVar[int]
    Z_FIELD_NUMBER: _ClassVar[int]
    X_DEVIATION_FIELD_NUMBER: _ClassVar[int]
    Y_DEVIATION_FIELD_NUMBER: _ClassVar[int]
    Z_DEVIATION_FIELD_NUMBER: _ClassVar[int]
    x: float
    y: float
    z: float
    x_deviation: float
    y_deviation: float
    z_deviation: float
    def __init__(self, x: _Optional[float] = ..., y: _Optional[float] = ..., z: _Optional[float] = ..., x_deviation: _Optional[float] = ..., y_deviation: _Optional[float] = ..., z_deviation: _Optional[float] = ...) -> None: ...

class PointedTarget(_message.Message):
    __slots__ = ("number", "arrived", "action", "location")
    NUMBER_FIELD_NUMBER: _ClassVar[int]
    ARRIVED_FIELD_NUMBER: _ClassVar[int]
    ACTION_FIELD_NUMBER: _ClassVar[int]
    LOCATION_FIELD_NUMBER: _ClassVar[int]
    number: int
    arrived: _timestamp_pb2.Timestamp
    action: str
    location: Location
    def __init__(self, number: _Optional[int] = ..., arrived: _Optional[_Union[_timestamp_pb2.Timestamp, _Mapping]] = ..., action: _Optional[str] = ..., location: _Optional[_Union[Location, _Mapping]] = ...) -> None: ...
