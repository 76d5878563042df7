"""The planned motion moves a body in physics: held by friction alone, servos no stronger than their data sheets."""

from __future__ import annotations

from itertools import pairwise

import mujoco
import numpy as np
import pytest

from paramove.motion.plans import PlannedMotion
from tests.motion.servo_reaching import description, pick_and_place, reaching
from tests.robots.servo_arms import ARMS, ArmModel

STIFFNESS, DAMPING = 30.0, 0.6
"""Of a position loop, in stall torques per rad and per rad/s."""
GRIPPER_SHARE = 0.2
"""Of the stall torque with which the gripper closes, as limited by its current: what it may do all the time."""
NEAR = 0.01
PLACES = {
    "open_manipulator_x": ("red_cube", (0.20, 0.0, 0.0155), (0.12, 0.14, 0.0165)),
    "koch_v1_1": ("red_cube", (0.16, 0.0, 0.0155), (0.11, 0.12, 0.0165)),
}


class PlayedArm:
    """An arm at its table, its joints driven by torques after a planned motion."""

    def __init__(self, name: str, motion: PlannedMotion) -> None:
        robot, plan = description(name), reaching(name)
        assert robot.chain is not None
        self.scene = ArmModel(robot, "scene.xml")
        model = self.scene.model
        start = robot.base_pose.copy()
        start[[*robot.chain.indices, robot.chain.gripper_index]] = motion.angles[0]
        self.scene.place(start)
        self._qpos = [model.joint(name).qposadr[0] for name in plan.arm.joints]
        self._dofs = [model.joint(name).dofadr[0] for name in plan.arm.joints]
        self._motors = [model.actuator(name).id for name in plan.arm.joints]
        stall = model.actuator_ctrlrange[self._motors, 1]
        self._maximum = stall * [*np.ones(len(stall) - 1), GRIPPER_SHARE]
        self._stiffness, self._damping = STIFFNESS * stall, DAMPING * stall
        self.largest_miss = np.zeros(len(stall) - 1)

    def play(self, motion: PlannedMotion) -> None:
        data, model = self.scene.data, self.scene.model
        steps = round(motion.times[1] / model.opt.timestep)
        rows = np.concatenate([motion.angles, np.repeat(motion.angles[-1:], 50, axis=0)])
        for here, there in pairwise(rows):
            speed = (there - here) / motion.times[1]
            for step in range(steps):
                away = here + step / steps * (there - here) - data.qpos[self._qpos]
                torque = self._stiffness * away + self._damping * (speed - data.qvel[self._dofs])
                data.ctrl[self._motors] = np.clip(torque, -self._maximum, self._maximum)
                mujoco.mj_step(model, data)
            self.largest_miss = np.maximum(self.largest_miss, np.abs(there - data.qpos[self._qpos])[:-1])

    def place_of(self, body: str) -> np.ndarray:
        return np.asarray(self.scene.data.body(body).xpos.copy())


@pytest.mark.parametrize("name", [robot.name for robot in ARMS])
def test_friction_alone_carries_the_cube_to_its_place(name: str) -> None:
    cube, source, place = PLACES[name]
    motion = pick_and_place(name, source, place)
    arm = PlayedArm(name, motion)
    before = {body: arm.place_of(body) for body in ("red_cube", "green_cube", "blue_cylinder")}
    np.testing.assert_allclose(before[cube][:2], source[:2], rtol=0, atol=1e-9)
    arm.play(motion)
    assert np.linalg.norm(arm.place_of(cube)[:2] - place[:2]) < NEAR
    np.testing.assert_allclose(arm.place_of(cube)[2], before[cube][2], rtol=0, atol=0.001)  # it stands
    for body in before.keys() - {cube}:
        np.testing.assert_allclose(arm.place_of(body), before[body], rtol=0, atol=0.001)
    assert (arm.largest_miss < np.deg2rad(2.0)).all()


@pytest.mark.parametrize("name", [robot.name for robot in ARMS])
def test_above_the_cube_nothing_is_carried(name: str) -> None:
    """So that the test above cannot pass by a body that sticks to the hand."""
    cube, source, place = PLACES[name]
    motion = pick_and_place(name, np.add(source, (0.0, 0.0, 0.03)), place)
    arm = PlayedArm(name, motion)
    before = arm.place_of(cube)
    arm.play(motion)
    np.testing.assert_allclose(arm.place_of(cube), before, rtol=0, atol=0.001)
