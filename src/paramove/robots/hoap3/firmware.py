"""The position loop that runs on HOAP-3, 1 ms, emulated: target counts and measured joints in, torques out.

Geared joints (manual 7.1.1.1 and S2.2): V_d = Kpp/64 * position error, at most 57 counts/ms; PWM = Kpv/16 * velocity
error. That is a stiff position loop ("local high gain"). The torque of one PWM step is not published: an estimate,
`torque_per_pwm_step` in robot.yaml. The RC servos of head and hands run a PD loop whose set-point moves no faster than
the servo can (estimates).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from paramove.documents import Floats
from paramove.robots import DescriptionError, RobotDescription


class Firmware:
    """Torques of all joints of one robot, computed once a millisecond.

    In radians the geared loop is torque = d * (clip(Kpp/64/ms * error, v_max) - velocity), where d, in N m s/rad, is
    Kpv/16 * torque_per_pwm_step * counts per rad / 1000. Measured joints are exact; only targets are in counts.
    """

    def __init__(self, description: RobotDescription) -> None:
        p = description.firmware
        if p is None:
            raise DescriptionError(
                f"the description of {description.name} has no firmware; HOAP-3's loop needs one, servos do not"
            )
        units = description.units
        step_s = p.period_us * 1e-6
        counts_per_rad = np.abs(units.counts_per_rad)
        geared = description.velocity_loop
        # Geared joints: desired velocity = position_gain * error, torque = damping * (desired - velocity).
        position_gain = p.kpp / 64.0 / 1e-3
        damping = p.kpv / 16.0 * p.torque_per_pwm_step * counts_per_rad * 1e-3
        saturation = p.saturation_counts_per_ms * 1e3 / counts_per_rad
        # A servo has the same form: stiffness = damping * gain; its set-point is limited instead of the velocity.
        self._gain = np.where(geared, position_gain, p.servo_kp / p.servo_kv)
        self._damping = np.where(geared, damping, p.servo_kv)
        self._velocity_limit = np.where(geared, saturation, np.inf)
        self._set_point_step = np.where(geared, np.inf, description.velocity * step_s)
        self._torque_limit = description.torque_peak.copy()
        self._zero_counts = units.zero_counts
        self._rad_per_count = 1.0 / units.counts_per_rad
        self._set_point = description.base_pose.copy()
        self._target = np.empty(description.n_joints)
        self._torque = np.empty(description.n_joints)

    def reset(self, positions: Floats) -> None:
        """Start the servos' set-points at the given joint angles, [J], rad."""
        self._set_point[:] = positions

    def step(self, target_counts: NDArray[np.int16], positions: Floats, velocities: Floats) -> Floats:
        """Torques for the next millisecond.

        Args:
            target_counts: Joint units, [J], in the robot's order.
            positions: Measured, [J], rad.
            velocities: Measured, [J], rad/s.

        Returns:
            [J], N m, within the peak torques. The array is used again by the next call.
        """
        target, torque = self._target, self._torque
        np.subtract(target_counts, self._zero_counts, out=target)
        target *= self._rad_per_count
        target -= self._set_point
        _clip(target, self._set_point_step)
        self._set_point += target
        np.subtract(self._set_point, positions, out=torque)
        torque *= self._gain
        _clip(torque, self._velocity_limit)
        torque -= velocities
        torque *= self._damping
        _clip(torque, self._torque_limit)
        return torque


def _clip(values: Floats, limit: Floats) -> None:
    """Clip in place to ±limit. Cheaper than np.clip for 28 values."""
    np.minimum(values, limit, out=values)
    np.maximum(values, -limit, out=values)
