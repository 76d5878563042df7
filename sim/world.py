"""The world in motion: robot, tool box, cylinders and the instructor's hand, 1 ms per step."""

from __future__ import annotations

import logging
import math
from collections.abc import Callable, Sequence

import mujoco
import numpy as np

from paramove.documents import Floats
from paramove.robots import RobotDescription
from sim import places, scene, tool_box
from sim.contact_watch import ContactRecord, ContactWatch
from sim.looks import Looks

_log = logging.getLogger(__name__)

STEP_S = 0.001
CLOSED_UP = (0.0, 1.0, 0.0, 0.0)  # quaternion w x y z: half a turn about x
OPENINGS_UP = (1.0, 0.0, 0.0, 0.0)


class SimulationError(RuntimeError):
    """The state of the world is no longer valid; the text names the degree of freedom."""


class World:
    """Physics of one seed's world.

    Positions that come in and go out are in the frame of the tool box's measures, that of HOAP-3's right shoulder,
    unless the name has world in it.

    Args:
        looks: How it looks; lights and cameras are part of the model.
        description: The robot's joints, in the order in which torques come.
        furnishings: Add what else is there.

    Attributes:
        shapes: Of the objects, by their names.
    """

    def __init__(self, looks: Looks, description: RobotDescription, furnishings: Sequence[scene.Furnish] = ()) -> None:
        self.model, self.mount = scene.build(looks, description, furnishings)
        self.data = mujoco.MjData(self.model)
        self.description = description
        model = self.model
        self.world_from_shoulder = self.mount.origin
        joints = [model.joint(name) for name in description.joint_names]
        self._qpos_index = np.array([joint.qposadr[0] for joint in joints])
        self._dof_index = np.array([joint.dofadr[0] for joint in joints])
        driven = description.joint_names if description.chain is None else ()  # servos bring their own torques
        self._actuators = np.array([model.actuator(name).id for name in driven], dtype=np.intp)
        self._body = {name: model.body(name).id for name in (*tool_box.COLOURS, "box", scene.HAND)}
        self._turns = looks.turns
        self._mocap = {name: int(model.body_mocapid[self._body[name]]) for name in ("box", scene.HAND)}
        self._weld = {name: model.equality(f"hold_{name}").id for name in tool_box.COLOURS}
        self._gripper = model.site(self.mount.gripper).id
        self.shapes = looks.measures.shapes(self.mount.object_width)
        self._watch = ContactWatch(model, self.mount.root, self.mount.sides)
        self._warnings = self.data.warning
        self.held_by_instructor: str | None = None
        self.last_touched_by: dict[str, str] = dict.fromkeys(tool_box.COLOURS, "")
        self._grasped: tuple[Floats, Floats] | None = None
        self.steps = 0
        self.reset()

    def reset(self) -> None:
        """Robot in its base pose, cylinders parked, box closed side up, hand away."""
        mujoco.mj_resetData(self.model, self.data)
        self.data.qpos[self._qpos_index] = self.description.base_pose
        for colour, place in zip(tool_box.COLOURS, places.PARKED, strict=True):
            self.place(colour, place)
        self.move_box(np.zeros(3), CLOSED_UP)
        self.move_hand(places.IDLE_FINGERTIP, np.array((0.2, -0.5, 0.8)))
        mujoco.mj_forward(self.model, self.data)

    # -- robot ------------------------------------------------------------------------------------------------------

    @property
    def time_s(self) -> float:
        """Simulated time since the start."""
        return self.steps * STEP_S

    def joint_positions(self) -> Floats:
        """[J], rad, in the order of the description."""
        return np.asarray(self.data.qpos[self._qpos_index])

    def joint_velocities(self) -> Floats:
        """[J], rad/s."""
        return np.asarray(self.data.qvel[self._dof_index])

    def apply(self, torques: Floats) -> None:
        """Torques of the motors in the next steps, [J], N m."""
        self.data.ctrl[self._actuators] = torques

    def step(self) -> None:
        """One millisecond.

        Raises:
            SimulationError: MuJoCo warns of a state that is not finite or of too many contacts.
        """
        mujoco.mj_step(self.model, self.data)
        self.steps += 1
        if self._warnings.number.any():
            raise SimulationError(self._what_is_wrong())
        touched = self._watch.update(self.data).touched
        for name in touched:
            self.last_touched_by[name] = "robot"
        if self.held_by_instructor is not None and self.held_by_instructor not in touched:
            self.last_touched_by[self.held_by_instructor] = "instructor"

    @property
    def contacts(self) -> ContactRecord:
        """What the robot touched since the start."""
        return self._watch.record

    def contact_names(self) -> list[str]:
        """Pairs that the robot is part of, in the latest step."""
        return [self._watch.name_of(pair) for pair in self.contacts.present]

    def gripper(self) -> tuple[Floats, Floats]:
        """Where the gripper is: position [3], rotation [3, 3] (x along the forearm, y from the pads to the thumb)."""
        position = self.data.site_xpos[self._gripper] - self.world_from_shoulder
        return np.asarray(position), self.data.site_xmat[self._gripper].reshape(3, 3).copy()

    # -- objects ----------------------------------------------------------------------------------------------------

    def position(self, name: str) -> Floats:
        """Centre of a cylinder, [3]."""
        return np.asarray(self.data.xpos[self._body[name]] - self.world_from_shoulder)

    def axis(self, name: str) -> Floats:
        """Direction of a cylinder's axis, [3], pointing up."""
        axis = self.data.xmat[self._body[name]].reshape(3, 3)[:, 2]
        return np.asarray(axis * (1.0 if axis[2] >= 0 else -1.0))

    def speed(self, name: str) -> float:
        """Of a cylinder's centre, m/s."""
        first = self.model.joint(name).dofadr[0]
        return float(np.linalg.norm(self.data.qvel[first : first + 3]))

    def quaternion(self, name: str) -> Floats:
        """Of a body, (w, x, y, z)."""
        return np.asarray(self.data.xquat[self._body[name]].copy())

    def place(self, name: str, centre: Floats) -> None:
        """Put an object upright at `centre`, at rest: to set a scene, not part of any story."""
        self._put(name, centre, _about_z(0.0 if self.shapes[name].kind == "cylinder" else self._turns[name]))

    def lay(self, name: str) -> None:
        """Lay an object on its side where it stands, turned somehow, at rest."""
        scene.slow_rolling(self.model)
        shape, (x, y, z) = self.shapes[name], self.position(name)
        turn = _multiply(_about_z(self._turns[name]), np.array((0.5**0.5, 0.5**0.5, 0.0, 0.0)))
        self._put(name, np.array((x, y, z - shape.half_height + shape.half_width)), turn)

    def _put(self, name: str, centre: Floats, quaternion: Floats) -> None:
        joint = self.model.joint(name)
        first = joint.qposadr[0]
        self.data.qpos[first : first + 3] = centre + self.world_from_shoulder
        self.data.qpos[first + 3 : first + 7] = quaternion
        self.data.qvel[joint.dofadr[0] : joint.dofadr[0] + 6] = 0.0

    # -- instructor -------------------------------------------------------------------------------------------------

    def move_hand(self, fingertip: Floats, backward: Floats) -> None:
        """Bring the instructor's hand: its fingertip [3], and the direction [3] from there to the wrist."""
        self.data.mocap_pos[self._mocap[scene.HAND]] = fingertip + self.world_from_shoulder
        self.data.mocap_quat[self._mocap[scene.HAND]] = hand_quaternion(backward)

    def move_box(self, offset: Floats, quaternion: tuple[float, ...] | Floats) -> None:
        """Bring the box to `offset` [3] from its place, turned by the quaternion (w, x, y, z)."""
        self.data.mocap_pos[self._mocap["box"]] = self.world_from_shoulder + tool_box.CENTRE + offset
        self.data.mocap_quat[self._mocap["box"]] = quaternion

    def openings_up(self) -> bool:
        """Which way the box lies."""
        return bool(abs(self.data.mocap_quat[self._mocap["box"]][0]) > 0.5)

    def grasp(self, name: str) -> None:
        """The instructor's hand holds the cylinder as it lies now, until `release`."""
        hand = self._mocap[scene.HAND]
        back = _conjugate(self.data.mocap_quat[hand])
        away = self.data.xpos[self._body[name]] - self.data.mocap_pos[hand]
        self._grasped = (_rotate(back, away), _multiply(back, self.data.xquat[self._body[name]]))
        self._hold(name, *self._grasped)
        self.data.eq_active[self._weld[name]] = 1
        self.held_by_instructor = name

    def straighten(self, fraction: float) -> None:
        """Turn the held cylinder upright under the fingertip, by `fraction` 0 to 1 of the rotation."""
        if self.held_by_instructor is None or self._grasped is None:
            return
        back = _conjugate(self.data.mocap_quat[self._mocap[scene.HAND]])
        (offset, turn), half_height = self._grasped, self.shapes[self.held_by_instructor].half_height
        upright = _upright_near(_multiply(_conjugate(back), turn))
        goal = _multiply(back, upright)
        goal_offset = _rotate(back, np.array((0.0, 0.0, -half_height)))
        if goal @ turn < 0:
            goal = -goal
        between = (1 - fraction) * turn + fraction * goal
        self._hold(
            self.held_by_instructor, (1 - fraction) * offset + fraction * goal_offset, between / np.linalg.norm(between)
        )

    def release(self) -> None:
        """The instructor lets go."""
        if self.held_by_instructor is not None:
            self.data.eq_active[self._weld[self.held_by_instructor]] = 0
        self.held_by_instructor = self._grasped = None

    def _hold(self, name: str, offset: Floats, turn: Floats) -> None:
        """MuJoCo's weld data: anchor on the object, its position and rotation in the hand, torque scale."""
        row = self.model.eq_data[self._weld[name]]
        row[0:3] = 0.0
        row[3:6] = offset
        row[6:10] = turn

    def _what_is_wrong(self) -> str:
        kinds = {
            mujoco.mjtWarning.mjWARN_BADQPOS: "position",
            mujoco.mjtWarning.mjWARN_BADQVEL: "velocity",
            mujoco.mjtWarning.mjWARN_BADQACC: "acceleration",
            mujoco.mjtWarning.mjWARN_BADCTRL: "torque",
        }
        warnings = []
        for number in np.flatnonzero(self._warnings.number):
            kind = mujoco.mjtWarning(int(number))
            place = int(self._warnings.lastinfo[number])
            if kind not in kinds:
                warnings.append(f"{kind.name.removeprefix('mjWARN_').lower()} ({place})")
                continue
            name = (
                self.model.actuator(place).name if kind == mujoco.mjtWarning.mjWARN_BADCTRL else self._dof(kind, place)
            )
            warnings.append(f"{kinds[kind]} of {name} is not finite or larger than 1e10")
        return f"simulation stopped at {self.time_s:.3f} s: {'; '.join(warnings)}; later states are not valid"

    def _dof(self, kind: mujoco.mjtWarning, place: int) -> str:
        starts = self.model.jnt_qposadr if kind == mujoco.mjtWarning.mjWARN_BADQPOS else self.model.jnt_dofadr
        joint = int(np.searchsorted(starts, place, side="right")) - 1
        within = place - int(starts[joint])
        kind_name = "qpos" if kind == mujoco.mjtWarning.mjWARN_BADQPOS else "dof"
        return f"joint {self.model.joint(joint).name} ({kind_name} {place}" + (
            f", its part {within})" if within else ")"
        )


def log_warnings_of_mujoco(say: Callable[[str], None] = _log.warning) -> None:
    """Send MuJoCo's own warnings to the log instead of a file in the working directory."""
    mujoco.set_mju_user_warning(say)


def hand_quaternion(backward: Floats) -> tuple[float, float, float, float]:
    """Rotation (w, x, y, z) of the hand whose z axis is `backward` and whose back, the x axis, looks up.

    Plain floats: it is called every millisecond, and numpy takes longer for three numbers than the physics step.
    """
    x, y, z = (float(value) for value in backward)
    length, flat = math.sqrt(x * x + y * y + z * z), math.hypot(x, y)
    if length < 1e-9 or flat < 1e-6 * length:
        raise ValueError(f"backward direction {backward} of the hand: a direction that is not vertical expected")
    # A turn about z to where the hand points, then a pitch about y: columns (-up, side, backward).
    yaw, pitch = math.atan2(y, x), math.atan2(flat, z)
    cos_yaw, sin_yaw, cos_pitch, sin_pitch = (
        math.cos(yaw / 2),
        math.sin(yaw / 2),
        math.cos(pitch / 2),
        math.sin(pitch / 2),
    )
    # R_z(yaw) R_y(pitch) has its x axis downwards; half a turn about z puts the back of the hand up.
    w, i, j, k = cos_yaw * cos_pitch, -sin_yaw * sin_pitch, cos_yaw * sin_pitch, sin_yaw * cos_pitch
    return -k, j, -i, w


def _upright_near(turn: Floats) -> Floats:
    """The upright rotation (either end up) that is reached from `turn` by the smallest one."""
    axis = _rotate(turn, np.array((0.0, 0.0, 1.0)))
    goal = np.array((0.0, 0.0, 1.0 if axis[2] >= 0 else -1.0))
    cross, cosine = np.cross(axis, goal), float(axis @ goal)
    swing = np.array((1.0 + cosine, *cross))
    return _multiply(swing / np.linalg.norm(swing), turn)


def _about_z(angle: float) -> Floats:
    return np.array((math.cos(angle / 2), 0.0, 0.0, math.sin(angle / 2)))


def _multiply(a: Floats, b: Floats) -> Floats:
    product = np.zeros(4)
    mujoco.mju_mulQuat(product, a, b)
    return product


def _conjugate(quaternion: Floats) -> Floats:
    return np.asarray(quaternion * (1.0, -1.0, -1.0, -1.0))


def _rotate(quaternion: Floats, vector: Floats) -> Floats:
    turned = np.zeros(3)
    mujoco.mju_rotVecQuat(turned, vector, quaternion)
    return turned
