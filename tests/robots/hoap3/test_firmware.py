"""The emulated position loop: stiff, within its torques, and it follows the stream in physics."""

from __future__ import annotations

import mujoco
import numpy as np

from paramove.robots.hoap3.firmware import Firmware
from tests.robots.hoap3.movements import HOAP3, ROBOT_DESCRIPTION, swing

MODEL = mujoco.MjModel.from_xml_path(str(ROBOT_DESCRIPTION / "scene.xml"))
QPOS = np.array([MODEL.joint(name).qposadr[0] for name in HOAP3.joint_names])
QVEL = np.array([MODEL.joint(name).dofadr[0] for name in HOAP3.joint_names])


def simulate(start: np.ndarray, frames: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Positions and torques, each [N, 28], while `frames` are played; order of the description."""
    data = mujoco.MjData(MODEL)
    data.qpos[QPOS] = start
    firmware = Firmware(HOAP3)
    firmware.reset(start)
    positions, torques = np.empty((2, len(frames), 28))
    for i, frame in enumerate(frames):
        torque = firmware.step(frame, data.qpos[QPOS], data.qvel[QVEL])
        data.ctrl[:] = torque
        mujoco.mj_step(MODEL, data)
        positions[i], torques[i] = data.qpos[QPOS], torque
    assert not any(warning.number for warning in data.warning)
    return positions, torques


def test_gravity_moves_a_stretched_arm_by_less_than_a_fifth_of_a_degree() -> None:
    pose = HOAP3.base_pose.copy()
    pose[[HOAP3.index(f"{side}_shoulder_pitch") for side in ("right", "left")]] = 0.0
    pose[HOAP3.index("right_elbow")] = pose[HOAP3.index("right_shoulder_roll")] = 0.0
    frame = HOAP3.units.to_counts(pose)
    positions, torques = simulate(pose, np.repeat(frame[None], 600, axis=0))
    sag_deg = np.rad2deg(np.abs(positions[-1] - HOAP3.units.to_radians(frame)))
    assert sag_deg.max() < 0.2
    assert np.abs(torques[-1, HOAP3.index("right_shoulder_pitch")]) > 0.4  # N m: it does carry the arm
    assert np.ptp(positions[-100:], axis=0).max() < np.deg2rad(0.01)


def test_a_fast_swing_is_followed_within_a_few_degrees_and_arrives() -> None:
    path = swing(HOAP3, duration_s=0.9)
    frames = HOAP3.units.to_counts(np.concatenate([path, np.repeat(path[-1:], 400, axis=0)]))
    positions, torques = simulate(path[0], frames)
    error_deg = np.rad2deg(np.abs(positions - HOAP3.units.to_radians(frames)))
    geared = HOAP3.velocity_loop
    assert error_deg[:, geared].max() < 2.0
    assert error_deg[-1].max() < 0.3
    assert (np.abs(torques) <= HOAP3.torque_peak + 1e-12).all()


def test_loop_is_the_manuals() -> None:
    """V_d = 12/64 of the error in counts/ms, at most 57; PWM = 350/16 of the velocity error."""
    joint = HOAP3.index("right_elbow")
    firmware = Firmware(HOAP3)
    pose = HOAP3.units.to_radians(HOAP3.units.to_counts(HOAP3.base_pose))
    rad_per_count = 1 / HOAP3.units.counts_per_rad[joint]
    step = HOAP3.firmware.torque_per_pwm_step
    for error, velocity in ((10, 0.0), (10, 1.5), (-20, 0.5)):
        target = HOAP3.units.to_counts(pose)
        target[joint] += error
        speeds = np.zeros(28)
        speeds[joint] = velocity * rad_per_count * 1000
        pwm = 350 / 16 * (12 / 64 * error - velocity)
        torque = firmware.step(target, pose, speeds)[joint]
        np.testing.assert_allclose(torque, np.sign(rad_per_count) * step * pwm, rtol=1e-9, atol=1e-12)
    far = HOAP3.units.to_counts(pose)
    far[joint] -= 5000
    at_limit = np.zeros(28)
    at_limit[joint] = -57 * rad_per_count * 1000
    np.testing.assert_allclose(firmware.step(far, pose, at_limit)[joint], 0.0, rtol=0, atol=1e-9)


def test_servos_move_no_faster_than_they_can() -> None:
    wrist, head = HOAP3.index("right_wrist"), HOAP3.index("head_pan")
    target = HOAP3.base_pose.copy()
    target[[wrist, head]] = np.deg2rad([80.0, 50.0])
    positions, _ = simulate(HOAP3.base_pose, np.repeat(HOAP3.units.to_counts(target)[None], 600, axis=0))
    for joint, limit_deg in ((wrist, 450.0), (head, 300.0)):
        speed = np.rad2deg(np.diff(positions[:, joint])).max() * 1000
        assert 0.8 * limit_deg < speed < 1.15 * limit_deg
        np.testing.assert_allclose(positions[-1, joint], target[joint], rtol=0, atol=np.deg2rad(1.0))
