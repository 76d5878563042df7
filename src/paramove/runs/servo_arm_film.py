"""The film of a servo arm's tasks, drawn after the run from its recorded states."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import closing
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

FRONT = (0.704, 0.534, 0.283, 0.373)
"""Quaternion (w, x, y, z) of a camera before the table on the right that looks at its middle."""


def write_film(folder: Path, robot: RobotDescription, states: Sequence[TruthState], console: Console) -> Path | None:
    """Writes `tasks.mp4`: the robot's scene in the recorded states, as fast as it was. None if nothing can be drawn."""
    spec = mujoco.MjSpec.from_file(str(robot.model_path.parent / "scene.xml"))
    spec.visual.global_.offwidth, spec.visual.global_.offheight = SIZE
    if spec.camera("front") is None:
        spec.worldbody.add_camera(name="front", pos=(0.62, -0.36, 0.26), quat=FRONT, fovy=30.0)
    model = spec.compile()
    data = mujoco.MjData(model)
    times_s = 1e-9 * np.array([state.time_ns for state in states])
    rows = np.array([_qpos(model, robot, state) for state in states])
    shown_s = np.arange(times_s[0], times_s[-1], 1.0 / FRAMES_PER_S)
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
            paste(picture, label(f"{robot.name}   {time_s - times_s[0]:5.1f} s", 24, TEXT, bold=True), 18, 14, True)
            writer.write(picture)
    return path


def _qpos(model: mujoco.MjModel, robot: RobotDescription, state: TruthState) -> Floats:
    """Positions of all joints of the scene in a recorded state."""
    qpos: Floats = model.qpos0.copy()
    for joint, angle in zip(robot.joint_names, state.joint_positions, strict=True):
        qpos[model.joint(joint).qposadr[0]] = angle
    for body in state.objects:
        first = model.jnt_qposadr[model.body(body.name).jntadr[0]]
        x, y, z, w = body.quaternion_xyzw
        qpos[first : first + 7] = (body.x, body.y, body.z, w, x, y, z)
    for i in np.flatnonzero(model.eq_type == mujoco.mjtEq.mjEQ_JOINT):  # fingers that a crank drives
        follower, leader = (model.jnt_qposadr[joint[i]] for joint in (model.eq_obj1id, model.eq_obj2id))
        qpos[follower] = np.polyval(model.eq_data[i, 4::-1], qpos[leader])
    return qpos
