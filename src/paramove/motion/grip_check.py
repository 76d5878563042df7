"""Whether an emulated gripper would feel what it holds: rehearsed in the robot's model and scene before a run.

Equality constraints and contacts of MuJoCo are soft by default, and the lighter the fingers the softer: the servo then
closes fully although the fingers stand at an object, and the run ends with "felt nothing in the hand".
"""

from __future__ import annotations

from pathlib import Path

import mujoco
import numpy as np

from paramove.documents import Floats
from paramove.motion.gripper_arm import GripperArm
from paramove.motion.model_check import qpos_addresses
from paramove.robots import DescriptionError, RobotDescription

STIFF = 'solref="0.002 1" solimp="0.99 0.9999 0.0001"'
"""Of a coupling that follows its joint to a fraction of a percent, as in the arms of `robot_description/`."""
HARD = 'solref="0.004 1" solimp="0.95 0.99 0.001"'
"""Of an object that fingers hardly enter."""
MAX_YIELD = 0.05
"""Opening ξ by which a gripper may close further although its fingers are held."""
CLEARLY = 0.9
"""Fraction of `felt_opening` below which a run would feel nothing; objects lower in the hand stop it earlier."""
OVERLOAD = 0.7
"""Fraction of its power with which a servo overloads after some seconds (see `docs/how-to/add_an_arm.md`)."""
HELD_AT = 0.3
"""Opening ξ at which coupled fingers are held."""
CLOSING_S = 1.0
STEP_S = 0.001
_IMMOVABLE = 1e6
DEFAULT_GAINS = (800, 0, 0)
"""P, I, D of a servo that `robot.yaml` sets none of."""
_FULL_PWM_COUNTS = 128.0 * 885.0
"""Position error, counts, times P for full power (e-Manual, "Position PID Gain")."""


def check_grip(robot: RobotDescription, scene: Path) -> None:
    """Closes the gripper on held fingers, then on each object of the scene that it should be able to hold.

    Args:
        robot: A servo arm; of others nothing is checked.
        scene: MJCF with the arm and things to grasp, whose free joints make them so.

    Raises DescriptionError: what gives way, and what to change.
    """
    if robot.chain is None or robot.bus is None:
        return
    try:
        model = mujoco.MjModel.from_xml_path(str(scene))
    except ValueError as error:
        raise DescriptionError(f"{scene} cannot be emulated: {error}") from error
    arm = GripperArm.of(robot, "")
    for name in robot.joint_names:
        if mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_JOINT, name) < 0:
            raise DescriptionError(f"{scene} has no joint {name!r}: it must include {robot.model_path.name}")
    rehearsal = _Rehearsal(robot, arm, model)
    stopped_at = rehearsal.opening_with_held_fingers()
    if stopped_at < HELD_AT - MAX_YIELD:
        raise DescriptionError(
            f"{robot.model_path}: with its fingers held at an opening of {HELD_AT:g} the gripper still closes to "
            f"{stopped_at:.2f}, and would feel nothing in the hand: give each <joint> of <equality> that follows "
            f"{arm.joints[-1]} {STIFF}"
        )
    for body, width in _things(model):
        if not model.body(body).name:
            raise DescriptionError(f"{scene}: a body with a free joint has no name, give it one such as red_cube")
        low, high = robot.chain.object_width
        if not low <= width <= high:
            continue
        stopped_at = rehearsal.opening_on(body)
        if stopped_at < CLEARLY * arm.felt_opening:
            raise DescriptionError(
                f"{scene}: closed on {model.body(body).name}, {1e3 * width:.0f} mm wide, the gripper stops at an "
                f"opening of {stopped_at:.3f}, felt_opening is {arm.felt_opening:g}: it would feel nothing in the "
                f"hand. Give the object's geom {HARD} or more mass, or set felt_opening of robot.yaml below that"
            )
        power = rehearsal.power_at(stopped_at)
        if robot.chain.grip_current_ma is None and power >= OVERLOAD:
            raise DescriptionError(
                f"{scene}: closed on {model.body(body).name}, the gripper uses {100 * power:.0f} % of its power, "
                f"at {100 * OVERLOAD:.0f} % it overloads: set closed_deg of robot.yaml nearer to "
                f"{np.rad2deg(arm.angle_of(stopped_at)):.1f} deg, where it stops, or lower P of position_gains"
            )


class _Rehearsal:
    """A gripper that closes in its scene without gravity, on an arm that does not move."""

    def __init__(self, robot: RobotDescription, arm: GripperArm, model: mujoco.MjModel) -> None:
        self._robot = robot
        self._arm = arm
        self._model = model
        model.opt.gravity[:] = 0.0
        model.opt.timestep = STEP_S
        joint = model.joint(arm.joints[-1])
        self._qpos, self._dof = int(joint.qposadr[0]), int(joint.dofadr[0])
        of_joint = (model.eq_type == mujoco.mjtEq.mjEQ_JOINT) & (model.eq_obj2id == joint.id)
        self._couplings = np.flatnonzero(of_joint)
        self._fingers = [int(model.jnt_dofadr[model.eq_obj1id[one]]) for one in self._couplings]
        index = robot.index(arm.joints[-1])
        # With a set current a gripper presses with far less than its peak.
        is_limited = robot.chain is not None and robot.chain.grip_current_ma is not None
        self._torque = float((robot.torque_average if is_limited else robot.torque_peak)[index])
        counts_per_rad = abs(float(robot.units.counts_per_rad[index]))
        proportional = (robot.position_gains[index] or DEFAULT_GAINS)[0]
        self._power_per_rad = counts_per_rad * proportional / _FULL_PWM_COUNTS
        self._armature = model.dof_armature.copy()

    def opening_with_held_fingers(self) -> float:
        """Where the gripper stops whose coupled fingers cannot move from `HELD_AT`; there if none is coupled."""
        if not self._fingers:
            return HELD_AT
        data = self._opened(HELD_AT)
        self._model.dof_armature[:] = _IMMOVABLE
        self._model.dof_armature[self._dof] = self._armature[self._dof]
        return self._closed(data)

    def opening_on(self, body: int) -> float:
        """Where it stops on an object that stands between its fingers, the hand pointing down."""
        model = self._model
        data = self._opened(1.0)
        free = int(model.body(body).jntadr[0])
        model.dof_armature[:] = _IMMOVABLE
        first = int(model.jnt_dofadr[free])
        for dof in (self._dof, *self._fingers, *range(first, first + 6)):
            model.dof_armature[dof] = self._armature[dof]
        tip = data.site(self._arm.tip_site)
        hand = tip.xmat.reshape(3, 3)
        turn = np.column_stack([hand[:, 2], hand[:, 1], -hand[:, 0]])
        quaternion = np.empty(4)
        mujoco.mju_mat2Quat(quaternion, turn.ravel())
        at = int(model.jnt_qposadr[free])
        data.qpos[at : at + 7] = [*tip.xpos, *quaternion]
        return self._closed(data)

    def power_at(self, opening: float) -> float:
        """Fraction of its power with which the servo, commanded to close, presses at an opening."""
        return abs(self._power_per_rad * (self._arm.closed - self._arm.angle_of(opening)))

    def _opened(self, opening: float) -> mujoco.MjData:
        model = self._model
        data = mujoco.MjData(model)
        data.qpos[qpos_addresses(model, self._robot.joint_names)] = self._robot.base_pose
        data.qpos[self._qpos] = self._arm.angle_of(opening)
        for one in self._couplings:
            follower = int(model.jnt_qposadr[model.eq_obj1id[one]])
            data.qpos[follower] = np.polyval(model.eq_data[one, 4::-1], data.qpos[self._qpos])
        mujoco.mj_kinematics(model, data)
        return data

    def _closed(self, data: mujoco.MjData) -> float:
        """The opening after the servo has pressed for `CLOSING_S`."""
        for _ in range(round(CLOSING_S / STEP_S)):
            power = self._power_per_rad * (self._arm.closed - data.qpos[self._qpos])
            data.qfrc_applied[self._dof] = self._torque * float(np.clip(power, -1.0, 1.0))
            mujoco.mj_step(self._model, data)
        return self._arm.opening_of(float(data.qpos[self._qpos]))


def _things(model: mujoco.MjModel) -> list[tuple[int, float]]:
    """Bodies with a free joint, and how wide their boxes and round shapes are along their own y axis, m."""
    things = []
    for joint in np.flatnonzero(model.jnt_type == mujoco.mjtJoint.mjJNT_FREE):
        body = int(model.jnt_bodyid[joint])
        first, count = int(model.body_geomadr[body]), int(model.body_geomnum[body])
        widths = [_width(model, geom) for geom in range(first, first + count)]
        things.append((body, max(widths, default=0.0)))
    return things


def _width(model: mujoco.MjModel, geom: int) -> float:
    is_box = model.geom_type[geom] == mujoco.mjtGeom.mjGEOM_BOX
    size: Floats = model.geom_size[geom]
    return 2.0 * float(size[1] if is_box else size[0])
