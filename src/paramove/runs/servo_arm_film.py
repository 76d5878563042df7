"""The film of a servo arm's tasks, drawn after the run from its recorded states."""

from __future__ import annotations

import math
from collections.abc import Sequence
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path

import mujoco
import numpy as np
from rich.console import Console
from rich.progress import track

from paramove.diagnosis import Eye, GraphicsError
from paramove.documents import Floats, replacing
from paramove.msgs.truth_pb2 import TruthState
from paramove.robots import RobotDescription
from paramove.runs.video import FRAMES_PER_S, SIZE, TEXT, VideoWriter, label, paste

LONGEST_S = 30.0
"""Of a film."""
FRONT = (0.704, 0.534, 0.283, 0.373)
"""Quaternion (w, x, y, z) of a camera before the table on the right that looks at its middle."""


@dataclass(frozen=True)
class FilmedArm:
    """An arm in a film.

    Attributes:
        robot: Its description.
        states: Recorded ones, in the frame of the world, or with a prefix in that of the arm's base.
        prefix: Of its names in the model.
    """

    robot: RobotDescription
    states: Sequence[TruthState]
    prefix: str = ""


def scene_of(robot: RobotDescription) -> mujoco.MjModel:
    """The scene beside a robot's model, with a camera before it."""
    spec = mujoco.MjSpec.from_file(str(robot.model_path.parent / "scene.xml"))
    spec.visual.global_.offwidth, spec.visual.global_.offheight = SIZE
    if spec.camera("front") is None:
        spec.worldbody.add_camera(name="front", pos=(0.62, -0.36, 0.26), quat=FRONT, fovy=30.0)
    return spec.compile()


def write_film(
    folder: Path, title: str, model: mujoco.MjModel, arms: Sequence[FilmedArm], console: Console
) -> Path | None:
    """Writes `tasks.mp4`: a world in the recorded states, as fast as it was; a long run is shown so many times as fast
    that it is over after `LONGEST_S`. None if nothing can be drawn.

    Args:
        folder: Where it is written.
        title: In the picture.
        model: Of the world, with a camera "front".
        arms: All that are in it. Where the things are, the states of the first one say.
        console: For progress and messages.
    """
    model.vis.global_.offwidth, model.vis.global_.offheight = SIZE
    data = mujoco.MjData(model)
    together = list(zip(*(arm.states for arm in arms), strict=False))  # one process published them all at each time
    times_s = 1e-9 * np.array([states[0].time_ns for states in together])
    rows = np.array([_qpos(model, arms, states) for states in together])
    speed = max(1, math.ceil((times_s[-1] - times_s[0]) / LONGEST_S))
    shown_s = np.arange(times_s[0], times_s[-1], speed / FRAMES_PER_S)
    path = folder / "tasks.mp4"
    try:
        eye = Eye(model, *SIZE)
    except GraphicsError as error:
        console.print(f"no film: {error}", markup=False, soft_wrap=True)
        return None
    with closing(eye), replacing(path) as unfinished, VideoWriter(unfinished) as writer:
        for time_s in track(shown_s, "video", console=console, transient=True):
            data.qpos[:] = [np.interp(time_s, times_s, column) for column in rows.T]
            mujoco.mj_forward(model, data)
            picture = eye.look(data, "front").copy()
            clock = f"{time_s - times_s[0]:5.1f} s" + (f", {speed} times as fast" if speed > 1 else "")
            paste(picture, label(f"{title}   {clock}", 24, TEXT, bold=True), 18, 14, True)
            writer.write(picture)
    return path


def _qpos(model: mujoco.MjModel, arms: Sequence[FilmedArm], states: Sequence[TruthState]) -> Floats:
    """Positions of all joints of the world in recorded states of its arms."""
    qpos: Floats = model.qpos0.copy()
    for arm, state in zip(arms, states, strict=True):
        for joint, angle in zip(arm.robot.joint_names, state.joint_positions, strict=True):
            qpos[model.joint(arm.prefix + joint).qposadr[0]] = angle
    origin, turn = base_of(model, arms[0])
    for body in states[0].objects:
        first = model.jnt_qposadr[model.body(body.name).jntadr[0]]
        x, y, z, w = body.quaternion_xyzw
        mujoco.mju_trnVecPose(qpos[first : first + 3], origin, turn, np.array([body.x, body.y, body.z]))
        mujoco.mju_mulQuat(qpos[first + 3 : first + 7], turn, np.array([w, x, y, z]))
    for i in np.flatnonzero(model.eq_type == mujoco.mjtEq.mjEQ_JOINT):  # fingers that a crank drives
        follower, leader = (model.jnt_qposadr[joint[i]] for joint in (model.eq_obj1id, model.eq_obj2id))
        qpos[follower] = np.polyval(model.eq_data[i, 4::-1], qpos[leader])
    return qpos


def base_of(model: mujoco.MjModel, arm: FilmedArm) -> tuple[Floats, Floats]:
    """Origin [3], m, and quaternion [4] (w, x, y, z) of the frame of an arm's states in the world."""
    if not arm.prefix or arm.robot.chain is None:
        return np.zeros(3), np.array([1.0, 0.0, 0.0, 0.0])
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    site, turn = data.site(arm.prefix + arm.robot.chain.sites.base), np.empty(4)
    mujoco.mju_mat2Quat(turn, site.xmat)
    return site.xpos.copy(), turn
