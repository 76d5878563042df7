"""A servo arm as a launch file names it: its description, port and calibration."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Annotated, Literal

import numpy as np
from pydantic import ConfigDict, Field

from paramove.documents import InputError, OldNames
from paramove.robots import DescriptionError, RobotDescription, ThisLaunch
from paramove.robots.dynamixel.arm.driven_arm import DrivenArm
from paramove.robots.dynamixel.arm.servo_arm import Timeouts
from paramove.robots.dynamixel.arm.servo_checks import JointServo
from paramove.robots.dynamixel.arm.servo_loop import LoopSettings
from paramove.robots.dynamixel.arm.stop_inputs import StopInputs
from paramove.robots.dynamixel.bus.clock import Clock, EmulatorClock
from paramove.robots.dynamixel.bus.serial_adapters import SerialAdapter
from paramove.robots.dynamixel.bus.servo_models import ServoModel, model_named
from paramove.robots.dynamixel.bus.servo_port import ServoPort
from paramove.robots.dynamixel.calibration.arm_calibration import ArmCalibration
from paramove.safety import Fault

LATENCY_FRACTION = 0.8
"""Of the time for reading all servos: the timeout of one. A missing one costs periods, a delayed reply costs none."""


class EmulatedLimits(OldNames):
    """Limits for servos that the launch itself emulates, and for no others.

    Attributes:
        timeouts: For servos and reads: they share the processors with everything else, and may be delayed.
        nominal: Whether an arm that everybody assembles differently needs no calibration.
    """

    model_config = ConfigDict(extra="forbid", frozen=True)

    old_names = (("patience", "timeouts"),)

    timeouts: Timeouts = Timeouts()
    nominal: bool = False


class ServoArmSetup(OldNames):
    """Parameters of a servo arm.

    Attributes:
        robot: Folder of the arm's description.
        port: Of its bus, relative to the run's folder: a link in /dev/serial/by-id, named by the adapter's number.
        torque_off: Whether the arm goes limp when it is disarmed and at the end; by default it holds.
        timeouts: For servos and reads.
        calibration: File of `paramove arm calibrate`; without, zeros are those of the description.
        stop_file: The emergency stop is pressed while there is a file of this name, for programs that watch a button.
        stop_line: File in which the system presents the line of a stop button, such as /sys/class/gpio/gpio17/value;
            read at every period of the loop.
        stop_line_pressed: Its value while the button is pressed, or its wire is cut; only the other value is released.
        on_exit: At a normal end: left as when it is disarmed, or slowly to `rest_deg`, then limp.
        rest_deg: Where the arm can go limp without harm, degrees by joint; joints without stay where they are.
        emulated: Replaces `timeouts` where the driver verifies, at every open of the port, that this very
            launch emulates the servos; only then a program may arm them. None: they count as real in any case.
        link_timeout_s: Commands come from another host, and without a reply from there for so long the arm stops; the
            launcher sets it. None: there is no other host.
    """

    old_names = (("patience", "timeouts"),)

    robot: Path
    port: Path
    torque_off: bool = False
    timeouts: Timeouts = Timeouts()
    calibration: Path | None = None
    emulated: EmulatedLimits | None = None
    on_exit: Literal["as_disarmed", "rest_then_off"] = "as_disarmed"
    rest_deg: dict[str, Annotated[float, Field(allow_inf_nan=False)]] = {}  # noqa: RUF012 - pydantic copies it
    stop_file: Path | None = None
    stop_line: Path | None = None
    stop_line_pressed: Literal[0, 1] = 1
    link_timeout_s: Annotated[float, Field(gt=0.0, le=0.1)] | None = None

    def driven_arm(
        self,
        run_folder: Path,
        launch: ThisLaunch | None = None,
        paced_by: Path | None = None,
        checks_in_slices: bool = False,
    ) -> DrivenArm:
        """The arm, not yet driven.

        Args:
            run_folder: That relative names start from.
            launch: That may emulate the servos; None: none does.
            paced_by: The control socket of emulated servos that this loop paces, in lockstep.
            checks_in_slices: See `ArmDriver`; somebody has to call `DrivenArm.check_on`.

        Raises:
            InputError: Its description or calibration is missing or wrong, or is another arm's; or in lockstep its
                servos are not emulated.
        """
        description = RobotDescription.load(self.robot)
        reason = (launch or ThisLaunch()).why_not_servos(run_folder / self.port)
        emulated = None if reason else self.emulated
        timeouts = self.timeouts if emulated is None else emulated.timeouts
        if paced_by is not None and emulated is None:
            raise InputError(f"lockstep needs servos that this launch emulates: {reason or 'no `emulated` is given'}")
        pace = None if paced_by is None else EmulatorClock(paced_by)
        port = servo_port(description, str(run_folder / self.port), timeouts.read_s, pace)
        calibration = None
        if self.calibration is not None:
            calibration = ArmCalibration.load(self.calibration, SerialAdapter.at(run_folder / self.port).serial)
            description = calibrated(description, calibration)
        is_even = emulated is not None and emulated.nominal
        is_refused = self.emulated is not None and emulated is None
        settings = LoopSettings(
            self.torque_off,
            timeouts,
            () if is_even or calibration is not None else uncalibrated(description),
            StopInputs(self.stop_file, self.stop_line, self.stop_line_pressed),
            self._rest(description),
            emulated_by=None if emulated is None else launch,
            caution=f"{port.name} counts as a real arm, which a person arms: {reason}" if is_refused else "",
            link_timeout_s=self.link_timeout_s,
            checks_in_slices=checks_in_slices,
        )
        return DrivenArm(description, joint_servos(description, calibration), port, settings)

    def _rest(self, description: RobotDescription) -> dict[str, float] | None:
        """Angles at which the arm goes limp, rad; None: it does not. Raises InputError."""
        if self.on_exit != "rest_then_off":
            return None
        if not self.rest_deg:
            raise DescriptionError("on_exit is rest_then_off, which needs `rest_deg`: where can the arm go limp?")
        for joint in self.rest_deg:
            description.index(joint)
        return {joint: float(np.deg2rad(degrees)) for joint, degrees in self.rest_deg.items()}


def calibrated(description: RobotDescription, calibration: ArmCalibration) -> RobotDescription:
    """The description with the units of one arm, within the demonstrated travel. Raises CalibrationError."""
    d = description
    units = calibration.units(d.joint_names, d.lower, d.upper)
    soft_lower, soft_upper = np.maximum(d.soft_lower, units.lower), np.minimum(d.soft_upper, units.upper)
    return replace(d, units=units, lower=units.lower, upper=units.upper, soft_lower=soft_lower, soft_upper=soft_upper)


def servo_port(
    description: RobotDescription, name: str, read_s: float | None = None, clock: Clock | None = None
) -> ServoPort:
    """The port of a described arm, closed. Raises DescriptionError for a robot without a servo bus.

    Args:
        description: Of the arm.
        name: Of the port.
        read_s: That reading all servos may take; None: a period of the loop.
        clock: Of the loop; None: the machine's.
    """
    if description.bus is None:
        raise DescriptionError(f"{description.name} has no servo bus in its robot.yaml: it is driven by another node")
    return ServoPort(
        name, description.bus.baud_rate, LATENCY_FRACTION * (read_s or 1e-6 * description.stream.period_us), clock
    )


def uncalibrated(description: RobotDescription) -> tuple[Fault, ...]:
    """Of an arm whose zeros every owner has to measure."""
    if description.bus is None or not description.bus.calibrate:
        return ()
    message = (
        f"{description.name} is assembled differently by everybody, and this one is not calibrated: run `paramove arm "
        "calibrate`, then name its file as the driver's `calibration`"
    )
    return (Fault("not_calibrated", "", message),)


def joint_servos(description: RobotDescription, calibration: ArmCalibration | None = None) -> tuple[JointServo, ...]:
    """The servos of a described arm, in the order of its joint vector."""
    d = description
    calibrated = {} if calibration is None else calibration.joints
    rows = zip(
        d.joint_names, d.servo_ids, map(model_named, d.motors), d.position_gains, d.velocity.tolist(), strict=True
    )
    return tuple(
        JointServo(name, number, model, calibrated.get(name), _grip_current(d, name, model), gains, velocity)
        for name, number, model, gains, velocity in rows
    )


def _grip_current(description: RobotDescription, joint: str, model: ServoModel) -> int | None:
    """In the servo's units."""
    chain = description.chain
    if chain is None or joint != chain.gripper or chain.grip_current_ma is None:
        return None
    assert model.current_unit is not None  # as the description was checked
    return round(1e-3 * chain.grip_current_ma / model.current_unit)
