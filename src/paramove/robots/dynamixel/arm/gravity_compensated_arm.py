"""Arms of Dynamixel servos that a person moves: without torque, or with currents that carry the arm's own weight."""

from __future__ import annotations

import time

import mujoco
import numpy as np

from paramove.documents import Floats, InputError
from paramove.robots import RobotDescription
from paramove.robots.dynamixel.arm.servo_arm import WATCHDOG_UNIT_S
from paramove.robots.dynamixel.bus.position_watch import POSITION, PositionWatch
from paramove.robots.dynamixel.bus.servo_chain import ServoChain, ServoError
from paramove.robots.dynamixel.bus.servo_models import CURRENT_MODE, PULSES_PER_TURN, model_named
from paramove.robots.dynamixel.bus.servo_port import PortLostError

WATCHDOG_S = 0.2
"""A servo without data for so long switches its current off by itself."""
CURRENT_FRACTION = 1.0 / 3.0
"""Of a servo's current limit: the maximum of a goal."""


class TorqueOffArm:
    """`release` its servos, then read their positions.

    Args:
        chain: At the arm's baud rate.
        description: Of an arm with servos; its units are those of this very arm.

    `release` and `measured` raise PortLostError and ServoError.
    """

    def __init__(self, chain: ServoChain, description: RobotDescription) -> None:
        self._chain = chain
        self._joints, self._numbers = description.joint_names, description.servo_ids
        self._models = [model_named(motor) for motor in description.motors]
        self._watch = PositionWatch(dict(zip(self._numbers, self._models, strict=True)))
        self._units = description.units
        middle = 0.5 * (description.units.lower + description.units.upper)
        self._middle = self._units.zero_counts + self._units.counts_per_rad * middle

    def release(self) -> None:
        """Torque off; who holds the arm carries its weight from now on."""
        for number, model in zip(self._numbers, self._models, strict=True):
            self._chain.write(number, model.registers["Torque Enable"], 0)

    def put_down(self) -> tuple[str, ...]:
        """Put the arm in its final state; without torque nothing is to be done.

        Returns:
            What failed, for people.
        """
        return ()

    def measured(self) -> tuple[int, Floats] | None:
        """When, ns of the monotonic clock, and the angles of all joints, [J], rad.

        None while a reply is missing, or has a position that cannot be true.

        Raises:
            ServoTimeoutError: A servo has not replied for long.
        """
        answers = self._watch.read(self._chain)
        if self._watch.missing(answers):
            return None
        positions = np.array([answers[number].values[POSITION] for number in self._numbers], dtype=np.float64)
        # A servo in the extended mode may begin in another turn.
        counts = positions - PULSES_PER_TURN * np.round((positions - self._middle) / PULSES_PER_TURN)
        at_ns = max(answers[number].at_ns for number in self._numbers)
        return at_ns, (counts - self._units.zero_counts) / self._units.counts_per_rad


class ArmWeight:
    """Torques of an arm's chain at rest, by its model, without anything that the arm holds."""

    def __init__(self, description: RobotDescription) -> None:
        self._model = mujoco.MjModel.from_xml_path(str(description.model_path))
        self._data = mujoco.MjData(self._model)
        joints = [self._model.joint(name) for name in description.joint_names]
        self._qpos = np.array([joint.qposadr[0] for joint in joints], dtype=np.intp)
        self._dof = np.array([joint.dofadr[0] for joint in joints], dtype=np.intp)

    def torques(self, angles: Floats) -> Floats:
        """That hold the arm still: [J] of all joints for their angles [J], rad; N m."""
        self._data.qpos[self._qpos] = angles
        mujoco.mj_forward(self._model, self._data)
        return np.array(self._data.qfrc_bias[self._dof])


class GravityCompensatedArm(TorqueOffArm):
    """As an arm without torque, but every reading renews the currents that carry its weight. The gripper is limp.

    A servo's torque is taken as proportional to its current, as from 0 to stall; friction holds what that misses.

    Args:
        chain: At the arm's baud rate.
        description: Of an arm with a chain; its units are those of this very arm.

    Raises:
        InputError: A servo of the chain has no current mode.
    """

    def __init__(self, chain: ServoChain, description: RobotDescription) -> None:
        super().__init__(chain, description)
        if description.chain is None:
            raise InputError(f"{description.name} has no chain in its robot.yaml: it is not a servo arm")
        self._carrying = description.chain.indices
        self._weight = ArmWeight(description)
        self._per_torque = np.zeros(description.n_joints)
        for index in self._carrying:
            model = model_named(description.motors[index])
            if model.current_unit is None:
                raise InputError(
                    f"{description.joint_names[index]} has a {model.name}, which has no current mode: lead this arm "
                    "without --float"
                )
            amperes = model.stall_amperes / model.stall_torque
            sign = np.sign(description.units.counts_per_rad[index])
            self._per_torque[index] = sign * amperes / model.current_unit
        self._maximum: dict[int, int] = {}
        self._modes: dict[int, int] = {}
        self._commanded_s = 0.0

    def release(self) -> None:
        """Each servo in turn: torque off, current mode, and the current that carries its part of the arm."""
        while (measured := super().measured()) is None:
            pass  # until it gives up
        torques = self._weight.torques(measured[1])
        for index, number in enumerate(self._numbers):
            registers = self._models[index].registers
            if index in self._carrying:
                self._modes[number] = self._chain.read(number, registers["Operating Mode"])
                self._maximum[number] = int(CURRENT_FRACTION * self._chain.read(number, registers["Current Limit"]))
            self._chain.write(number, registers["Torque Enable"], 0)
            if index in self._carrying:
                self._chain.write(number, registers["Operating Mode"], CURRENT_MODE)
                self._chain.write(number, registers["Torque Enable"], 1)
                self._chain.write(number, registers["Goal Current"], self._current(index, torques))

    def measured(self) -> tuple[int, Floats] | None:
        """As of an arm without torque; without a position for 0.2 s, the currents are 0 until there is one."""
        measured = super().measured()
        age_s = time.monotonic() - self._commanded_s
        if measured is not None:
            if age_s > 0.5 * WATCHDOG_S:
                self._renew_watchdogs()
            self._carry(self._weight.torques(measured[1]))
            self._commanded_s = time.monotonic()
        elif age_s > WATCHDOG_S:
            self._carry(np.zeros(len(self._numbers)))
        return measured

    def put_down(self) -> tuple[str, ...]:
        """Torque off, and the former mode; each servo on its own. The arm falls unless it is held.

        A servo without a connection switches its current off by its watchdog.
        """
        failed = []
        for index in self._carrying:
            number, registers = self._numbers[index], self._models[index].registers
            try:
                self._chain.write(number, registers["Torque Enable"], 0)
                self._chain.write(number, registers["Bus Watchdog"], 0)
                if number in self._modes:
                    self._chain.write(number, registers["Operating Mode"], self._modes[number])
            except (ServoError, PortLostError) as error:
                failed.append(f"{self._joints[index]}: {error}")
        return tuple(failed)

    def _carry(self, torques: Floats) -> None:
        goals = {self._numbers[index]: self._current(index, torques) for index in self._carrying}
        self._chain.sync_write(self._models[self._carrying[0]].registers["Goal Current"], goals)

    def _current(self, index: int, torques: Floats) -> int:
        """Of one servo, in its units."""
        maximum = self._maximum[self._numbers[index]]
        return max(-maximum, min(maximum, round(float(self._per_torque[index] * torques[index]))))

    def _renew_watchdogs(self) -> None:
        """One that has tripped locks the goals until 0 is written."""
        for index in self._carrying:
            register = self._models[index].registers["Bus Watchdog"]
            for value in (0, round(WATCHDOG_S / WATCHDOG_UNIT_S)):
                self._chain.write(self._numbers[index], register, value)
