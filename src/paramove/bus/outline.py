"""How many points a serialised trajectory has, found without decoding them."""

from __future__ import annotations

from google.protobuf.descriptor_pb2 import FieldDescriptorProto, FileDescriptorProto  # type: ignore[import-untyped]
from google.protobuf.descriptor_pool import DescriptorPool  # type: ignore[import-untyped]
from google.protobuf.message_factory import GetMessageClass  # type: ignore[import-untyped]

from paramove.msgs.joint_trajectory_pb2 import JointTrajectory

_POINTS = JointTrajectory.DESCRIPTOR.fields_by_name["points"]
_FILE = FileDescriptorProto(name="outline.proto", syntax="proto3")
_FILE.message_type.add(name="Outline").field.add(
    name=_POINTS.name,
    number=_POINTS.number,
    type=FieldDescriptorProto.TYPE_BYTES,
    label=FieldDescriptorProto.LABEL_REPEATED,
)
_POOL = DescriptorPool()
_POOL.Add(_FILE)
_OUTLINE = GetMessageClass(_POOL.FindMessageTypeByName("Outline"))
"""A trajectory whose points are undecoded bytes."""


def number_of_points(payload: bytes) -> int:
    """Of a serialised JointTrajectory; raises DecodeError for other bytes."""
    return len(getattr(_OUTLINE.FromString(payload), _POINTS.name))
