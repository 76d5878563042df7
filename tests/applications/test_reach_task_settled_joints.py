"""Joints at rest: only from recent messages over a while."""

from __future__ import annotations

import numpy as np
import pytest
from foxglove_schemas_protobuf.JointState_pb2 import JointState
from foxglove_schemas_protobuf.JointStates_pb2 import JointStates

from paramove.applications.reach_task import SettledJoints

PERIOD_NS = 66_666_667


def joint_states(**joints: float) -> JointStates:
    return JointStates(joints=[JointState(name=name, position=angle) for name, angle in joints.items()])


def settled_joints(angles: list[float], other: float = 0.5) -> SettledJoints:
    settled = SettledJoints(("a", "b"))
    for number, angle in enumerate(angles):
        settled.handle(joint_states(b=other, a=angle, c=9.0), number * PERIOD_NS)
    return settled


def test_tells_the_newest_angles_in_order_once_they_rest() -> None:
    settled = settled_joints([0.2] * 6 + [0.201])
    np.testing.assert_allclose(settled.settled(6 * PERIOD_NS), [0.201, 0.5], rtol=0, atol=1e-12)


def test_tells_nothing_too_early_while_moving_or_when_stale() -> None:
    assert settled_joints([]).settled(0) is None
    assert settled_joints([0.2] * 3).settled(2 * PERIOD_NS) is None
    assert settled_joints(list(np.linspace(0.0, 0.1, 8))).settled(7 * PERIOD_NS) is None
    assert settled_joints([0.2] * 8).settled(40 * PERIOD_NS) is None


@pytest.mark.parametrize("bad", [np.nan, np.inf, 1e300])
def test_what_is_no_angle_counts_for_nothing(bad: float) -> None:
    settled = settled_joints([0.2] * 8)
    settled.handle(joint_states(a=bad, b=0.5), 8 * PERIOD_NS)
    settled.handle(joint_states(a=0.7), 8 * PERIOD_NS)
    np.testing.assert_allclose(settled.settled(8 * PERIOD_NS), [0.2, 0.5], rtol=0, atol=1e-12)
