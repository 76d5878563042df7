"""What the robot reports of its stream and joints, in radians."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from foxglove_schemas_protobuf.JointState_pb2 import JointState
from foxglove_schemas_protobuf.JointStates_pb2 import JointStates

from paramove.documents import Floats
from paramove.robots import JointRangeError, RobotDescription
from paramove.robots.streaming.stream import Playing, StreamState
from paramove.safety import Measured


@dataclass(frozen=True, eq=False)
class RobotReport:
    """One report. Arrays [J], rad or rad/s; `velocities` are differences to the report before."""

    captured_ns: int
    epoch: int
    next_index: int
    playing: Playing
    rejected_batches: int
    rejection: str
    positions: Floats
    commanded: Floats
    velocities: Floats
    joint_names: tuple[str, ...]

    @classmethod
    def of(
        cls, state: StreamState, captured_ns: int, description: RobotDescription, before: RobotReport | None
    ) -> RobotReport | None:
        """In radians; None if the counts are not those of this robot: they are not replaced by invented ones."""
        units = description.units
        try:
            positions = units.to_radians(state.counts)
            # A robot that does not report its targets is taken to hold its position.
            commanded = units.to_radians(state.target_counts) if len(state.target_counts) else positions
        except JointRangeError:
            return None
        velocities = np.zeros(description.n_joints)
        if before is not None and captured_ns > before.captured_ns:
            velocities = (positions - before.positions) / ((captured_ns - before.captured_ns) * 1e-9)
        return cls(
            captured_ns,
            state.epoch,
            state.next_index,
            state.playing,
            state.rejected_batches,
            state.rejection,
            positions,
            commanded,
            velocities,
            description.joint_names,
        )

    @property
    def at_rest(self) -> bool:
        """Whether the robot plays nothing."""
        return self.playing in (Playing.NOTHING, Playing.HELD)

    def measured(self, epoch: int) -> Measured:
        """As input of the safety gate; of another epoch no row counts as played."""
        index = self.next_index if self.epoch == epoch else 0
        return Measured(self.captured_ns, self.positions, self.commanded, self.at_rest, index)

    def joint_states(self) -> JointStates:
        """As the standard message, all joints, rad and rad/s."""
        message = JointStates()
        message.timestamp.FromNanoseconds(self.captured_ns)
        for name, position, velocity in zip(self.joint_names, self.positions, self.velocities, strict=True):
            message.joints.append(JointState(name=name, position=position, velocity=velocity))
        return message
