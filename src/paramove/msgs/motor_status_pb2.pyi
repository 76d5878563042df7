from google.protobuf import timestamp_pb2 as _timestamp_pb2
from google.protobuf.internal import containers as _containers
from google.protobuf import descriptor as _descriptor
from google.protobuf import message as _message
from typing import ClassVar as _ClassVar, Iterable as _Iterable, Mapping as _Mapping, Optional as _Optional, Union as _Union

DESCRIPTOR: _descriptor.FileDescriptor

class MotorStatus(_message.Message):
    __slots__ = ("captured", "motors", "warnings")
    CAPTURED_FIELD_NUMBER: _ClassVar[int]
    MOTORS_FIELD_NUMBER: _ClassVar[int]
    WARNINGS_FIELD_NUMBER: _ClassVar[int]
    captured: _timestamp_pb2.Timestamp
    motors: _containers.RepeatedCompositeFieldContainer[Motor]
    warnings: _containers.RepeatedScalarFieldContainer[str]
    def __init__(self, captured: _Optional[_Union[_timestamp_pb2.Timestamp, _Mapping]] = ..., motors: _Optional[_Iterable[_Union[Motor, _Mapping]]] = ..., warnings: _Optional[_Iterable[str]] = ...) -> None: ...

class Motor(_message.Message):
    __slots__ = ("joint", "id", "model", "responding", "age_s", "torque", "voltage_v", "temperature_c", "hardware_error")
    JOINT_FIELD_NUMBER: _ClassVar[int]
    ID_FIELD_NUMBER: _ClassVar[int]
    MODEL_FIELD_NUMBER: _ClassVar[int]
    RESPONDING_FIELD_NUMBER: _ClassVar[int]
    AGE_S_FIELD_NUMBER: _ClassVar[int]
    TORQUE_FIELD_NUMBER: _ClassVar[int]
    VOLTAGE_V_FIELD_NUMBER: _ClassVar[int]
    TEMPERATURE_C_FIELD_NUMBER: _ClassVar[int]
    HARDWARE_ERROR_FIELD_NUMBER: _ClassVar[int]
    joint: str
    id: int
    model: str
    responding: bool
    age_s: float
    torque: bool
    voltage_v: float
    temperature_c: float
    hardware_error: int
    def __init__(self, joint: _Optional[str] = ..., id: _Optional[int] = ..., model: _Optional[str] = ..., responding: bool = ..., age_s: _Optional[float] = ..., torque: bool = ..., voltage_v: _Optional[float] = ..., temperature_c: _Optional[float] = ..., hardware_error: _Optional[int] = ...) -> None: ...
