"""The loop of a servo arm: one thread that owns the port, plays the rows that the safety gate lets pass, and reads.

What HOAP-3 does on the robot is done here: a `StreamReader` holds the rows, which end in a stop ramp, and plays one a
period. So an arm whose driver has stopped comes to rest in the same way.
"""

from __future__ import annotations

import gc
import logging
import sys
import threading
from collections import deque
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Self

import numpy as np

from paramove.documents import Floats, InputError
from paramove.msgs.joint_trajectory_pb2 import JointTrajectory, TrajectoryStatus
from paramove.robots import RESTARTED, RobotDescription, ThisLaunch
from paramove.robots.dynamixel.arm.servo_arm import ArmReading, ServoArm, Timeouts
from paramove.robots.dynamixel.arm.servo_checks import JointServo
from paramove.robots.dynamixel.arm.stop_inputs import StopInputs
from paramove.robots.dynamixel.bus.clock import ClockLostError, EmulatorClock
from paramove.robots.dynamixel.bus.servo_chain import ServoChain
from paramove.robots.dynamixel.bus.servo_port import PortLostError, ServoPort
from paramove.robots.streaming import ArmDriver, DriverOutput, Frames, StreamReader
from paramove.safety import Fault, State

EXIT_SPEED_FRACTION = 0.5
"""Of the operating velocity."""
EXIT_PEAK = 1.875
"""Highest velocity of a movement with smooth ends, of its mean."""
SHORTEST_EXIT_S = 0.5
LONGEST_EXIT_S = 4.0
"""In total: a launcher kills a driver 5 s after its request to end."""
EXIT_MARGIN_S = 0.5
"""Until the arm has settled and every servo has its final settings."""
_log = logging.getLogger(__name__)

MOVING = (State.ARMED, State.STOPPING)
HOLDING = (*MOVING, State.HOLD, State.ESTOP)
HEALTH_STEPS, SUPPLY_STEPS = 10, 100
REOPEN_S = 0.5
WATCHDOG_FRACTION = 0.5
"""Of the servos' watchdog: after a longer pause of the loop they are asked whether they have stopped by themselves."""
REST_S = 0.0002
"""A loop that is late rests for so long each period: otherwise other threads hardly get the interpreter."""
SWITCH_S = 0.0005
"""Another thread that computes gives the interpreter back so soon: the loop needs it after each of its exchanges."""
NOT_EMULATED = "its servos are not emulated by this launch"
SETTLED_S, LONGEST_SETTLING_S = 0.1, 0.4
"""Servos lag behind their goals: an arm has come to rest when none moves by more than a pulse for so long."""
TICK_S = 0.02
"""Period of the driver's logic; on a fault it runs at once."""


@dataclass(frozen=True)
class LoopSettings:
    """How a servo arm is driven.

    Attributes:
        torque_off: Whether the arm goes limp when it is disarmed and at the end; by default it holds.
        timeouts: For servos and reads.
        standing_faults: That keep the arm from being armed, whatever its servos report.
        stop_inputs: Files that press the emergency stop.
        rest: Angles by joint, rad, to which the armed arm goes slowly at a normal end, and then goes limp; without time
            or where anything is wrong it holds. None: at the end it is left as when it is disarmed.
        emulated_by: The launch that emulates the servos, which is verified at every open of the port; None:
            they count as real.
        caution: A message to show in any case.
        link_timeout_s, checks_in_slices: See `ArmDriver`.
    """

    torque_off: bool = False
    timeouts: Timeouts = field(default_factory=Timeouts)
    standing_faults: tuple[Fault, ...] = ()
    stop_inputs: StopInputs = field(default_factory=StopInputs)
    rest: Mapping[str, float] | None = None
    emulated_by: ThisLaunch | None = None
    caution: str = ""
    link_timeout_s: float | None = None
    checks_in_slices: bool = False

    def why_no_program(self) -> str:
        """Why no program may arm the arm; "" if one may."""
        if self.emulated_by is None:
            return NOT_EMULATED
        return RESTARTED if self.emulated_by.restarted else ""


class ServoLoop:
    """An arm that is driven while this is a context: in a thread of its own, or by `run_to` in an emulator's time.

    Args:
        driver: Trajectories through the gate.
        description: Of the arm.
        servos: Its servos, in the order of the robot's joint vector.
        port: Closed; it is opened here, and again after it was lost.
        settings: How it is driven.
        on_output: Called in the loop's thread when `take` has something.

    Raises:
        InputError: On entering: the port is missing, forbidden or in use.
    """

    def __init__(
        self,
        driver: ArmDriver,
        description: RobotDescription,
        servos: tuple[JointServo, ...],
        port: ServoPort,
        settings: LoopSettings,
        on_output: Callable[[], None],
    ) -> None:
        self.driver = driver
        self.lost = ""
        """Why the port is not open; "" while it is."""
        self.pressed = ""
        """Why the emergency stop is pressed, for people; "" if it is not."""
        self._description = description
        self._period_s = 1e-6 * description.stream.period_us
        self._period_ns = 1000 * description.stream.period_us
        self._port, self._clock = port, port.clock
        self._servos = servos
        self._settings = settings
        self._on_output = on_output
        self.arm = ServoArm(servos, ServoChain(port), self._period_s, settings.timeouts)
        """The servos; others after the port was lost and opened again."""
        self._reader: StreamReader | None = None
        self._output: deque[DriverOutput] = deque()
        self._inbox: deque[Callable[[], None]] = deque()
        self._step = 0
        self._begun_s, self._pause_s = self._now_s, 0.0
        self._urgent = self._ended = self._normal_end = False
        self._tick_steps = max(1, round(TICK_S / self._period_s))
        self._reopen_s = 0.0
        self._paced = isinstance(port.clock, EmulatorClock)
        self._due_ns = self._period_ns
        self._stopped, self._woken = threading.Event(), threading.Event()
        self._thread = threading.Thread(target=self._run, name="servo_loop", daemon=True)

    @property
    def _now_s(self) -> float:
        return 1e-9 * self._clock.now_ns

    def __enter__(self) -> Self:
        self._open()
        if not self._paced:
            self._thread.start()
        return self

    def __exit__(self, kind: type[BaseException] | None, *_: object) -> None:
        self._normal_end = kind is None
        self._stopped.set()
        self._woken.set()
        if isinstance(self._clock, EmulatorClock):
            self._run()
            self._clock.close()
        else:
            self._thread.join()
        self._port.close()

    def take(self) -> list[DriverOutput]:
        """The driver's output since the last call."""
        return [self._output.popleft() for _ in range(len(self._output))]

    def run_to(self, time_ns: int) -> None:
        """All periods up to a time, in the thread of the caller, if the clock is that of an emulator.

        Raises ClockLostError when the emulator has ended.
        """
        while self._paced and self._due_ns <= time_ns:
            self._clock.wait_until(self._due_ns)
            self._due_ns += self._period_ns
            self._one_period()

    def hand_over(self, act: Callable[[], None]) -> None:
        """What the next period does first, in the thread that uses the driver."""
        self._inbox.append(act)

    def stop_waits(self) -> None:
        """A stop waits in the driver: act on it at once, or as soon as the servos have answered what they are asked."""
        if self._paced:
            self._tick(self._clock.now_ns)
        else:
            self._woken.set()

    @property
    def has_failed(self) -> bool:
        """Whether the loop has ended without a request; its thread has logged why."""
        return self._ended and not self._stopped.is_set()

    def _run(self) -> None:
        try:
            due_s = self._now_s
            while not self._stopped.is_set():
                # Lost periods are not made up for.
                due_s = max(due_s + self._period_s, self._now_s - self._period_s)
                self._one_period()
                self._on_output()
                self._rest_until(due_s)
            rests = self._normal_end and self._settings.rest is not None and self._goes_to(self._settings.rest)
            self._end(rests)
        finally:
            self._ended = True

    def _rest_until(self, due_s: float) -> None:
        """The next period; a stop that comes meanwhile is acted on at once."""
        if not self._woken.wait(max(REST_S, due_s - self._now_s)):
            return
        self._woken.clear()
        if self.driver.has_stop:
            self._tick(self._clock.now_ns)
            self._on_output()
        self._stopped.wait(max(REST_S, due_s - self._now_s))

    def _one_period(self) -> None:
        begun_s, self._begun_s = self._begun_s, self._now_s
        self._pause_s = self._begun_s - begun_s
        for _ in range(len(self._inbox)):
            self._inbox.popleft()()
        self._look_at_emergency_stop()
        try:
            if self.lost:
                self._reopen()
            if not self.lost:
                self._move_and_read()
        except PortLostError as error:
            self.lost = str(error)
            self._reopen_s = self._now_s + REOPEN_S
            self._reader = None
            self._report(Fault("port_lost", "", f"{error} The arm rests by its servos' own watchdog; arm again"))
        now_ns = self._clock.now_ns
        is_due = self._step % self._tick_steps == 0
        if is_due or self._urgent or self.driver.has_stop or self.driver.is_cut_off(now_ns):
            self._tick(now_ns)
        self._step += 1

    def _look_at_emergency_stop(self) -> None:
        if not self._settings.stop_inputs.are_there:
            return
        self.pressed = self._settings.stop_inputs.pressed()
        self.driver.on_emergency(bool(self.pressed))
        self._urgent |= bool(self.pressed) and self.driver.state is not State.ESTOP

    def _move_and_read(self) -> None:
        reader = self._reader
        if reader is not None and self.arm.holds:
            self.arm.command(reader.play())
        reading = self.arm.measured()
        if reading is None:
            return
        if reader is None or not self.arm.holds:
            reader = self._reader = StreamReader(self._description, reading.counts)
        fault = self._fault(reading)
        if fault is not None and self.driver.state in MOVING:  # else the checks before arming detect it
            self._report(fault)
        if self.driver.wants_to_arm and self.driver.state not in MOVING:
            reading = self._prepare() or reading  # the checks took longer than a reading counts
            self._urgent = True
            reader = self._reader = StreamReader(self._description, reading.counts)
        elif self.arm.holds and self.driver.state not in HOLDING and reader.at_rest:
            self._let_go(self._settings.torque_off)  # not before the stop ramp is over
        self.driver.on_robot_state(reader.state(reading.counts, reading.at_ns), reading.at_ns)

    def _prepare(self) -> ArmReading | None:
        """Check the servos and let them hold their positions, before the gate gets the arming request."""
        began_ns = self._clock.now_ns
        faults = self._settings.standing_faults or self.arm.check() or self.arm.take_hold()
        self.driver.on_arming_checks(faults, began_ns)
        return self.arm.measured()

    def _fault(self, reading: ArmReading) -> Fault | None:
        fault = self.arm.fault_of_answers(reading)
        if self.arm.holds and self._pause_s > WATCHDOG_FRACTION * self._settings.timeouts.watchdog_s:
            fault = self.arm.look_after_watchdogs() or fault
        if self._step % HEALTH_STEPS == 0:
            fault = self.arm.look_after() or fault
        elif self._step % SUPPLY_STEPS == HEALTH_STEPS // 2:
            fault = self.arm.look_after_supply() or fault
        return fault

    def _report(self, fault: Fault) -> None:
        self.driver.on_fault(fault)
        self._urgent = True

    def _tick(self, now_ns: int) -> None:
        self._urgent = False
        output = self.driver.tick(now_ns)
        if output.stream is not None and self._reader is not None:
            self._reader.offer(output.stream)
        self._output.append(output)

    def _open(self) -> None:
        """Raises InputError also if servos that are driven as emulated no longer are."""
        self._port.open()
        reason = self._settings.emulated_by and self._settings.emulated_by.why_not_servos(self._port.device)
        if reason:
            self._port.close()
            raise InputError(f"{self._port.name} does not lead to the servos of this launch: {reason}. Launch again")

    def _reopen(self) -> None:
        """Under the same name, which is that of the adapter and not of its USB socket."""
        if self._now_s < self._reopen_s:
            return
        try:
            self._open()
        except InputError as error:
            self.lost = str(error)
            self._reopen_s = self._now_s + REOPEN_S
            return
        self.lost = ""
        chain, timeouts = ServoChain(self._port), self._settings.timeouts
        self.arm = ServoArm(self._servos, chain, self._period_s, timeouts, self.arm.watch)

    def _let_go(self, torque_off: bool) -> None:
        for failed in self.arm.let_go(torque_off):
            _log.warning("a servo did not take its final settings: %s", failed)

    def _goes_to(self, rest: Mapping[str, float]) -> bool:
        """Go to rest, slowly and through the gate; whether the arm arrived. On any fault it does not."""
        ends_s, name, reason = self._now_s + LONGEST_EXIT_S, "", "it is not armed"
        reader = self._reader
        if reader is not None and not reader.at_rest:
            reader, reason = None, "it was moving, and stops"
        while reader is not None and not self.lost and self.driver.state is State.ARMED:
            if not name:
                start = self._description.units.to_radians(reader.target)
                message, duration_s = movement_to(self._description, start, rest, f"rest {self._clock.now_ns}")
                reason = f"it would take {duration_s:.1f} s, and a launcher would kill this driver before"
                if self._now_s + duration_s + EXIT_MARGIN_S > ends_s:
                    break
                name, reason = message.id, "it was stopped before it arrived"
                self.driver.on_trajectory(message, self._clock.now_ns)
            elif self._now_s > ends_s:
                reason = "it took too long"
                break
            begun_ns = self._clock.now_ns
            self.driver.check_on()
            self._one_period()
            self._clock.wait_until(begun_ns + self._period_ns)
            statuses = [one for output in self.take() for one in output.statuses if one.trajectory_id == name]
            if statuses and statuses[-1].state == TrajectoryStatus.STATE_SUCCEEDED:
                return True
            if statuses and statuses[-1].code == "busy":  # the movement before has not settled yet
                name = ""
            elif statuses and statuses[-1].reason:
                reason = statuses[-1].reason
                break
        _log.warning("the arm holds its position and does not go to rest: %s", self.lost or reason)
        return False

    def _end(self, rests: bool) -> None:
        """Come to rest by the rows of the reader, wait for the servos, then write their final settings."""
        measured: deque[Frames] = deque(maxlen=1 + round(SETTLED_S / self._period_s))
        stands_s = None
        try:
            while self.arm.holds and self._reader is not None:
                self.arm.command(self._reader.play())
                if self._reader.at_rest:
                    stands_s = stands_s or self._now_s
                    reading = self.arm.measured()
                    if reading is not None:
                        measured.append(reading.counts)
                    settled = len(measured) == measured.maxlen and np.ptp(measured, axis=0).max() <= 1
                    if settled or self._now_s - stands_s > LONGEST_SETTLING_S:
                        break
                self._clock.wait_until(self._clock.now_ns + self._period_ns)
        except (PortLostError, ClockLostError) as error:
            self.lost = str(error)
        if not self.lost:
            self._let_go(self._settings.torque_off if self._settings.rest is None else rests)


def prefer_the_loop() -> None:
    """Makes other threads of this process, which is to be there for the loop alone, keep the interpreter for less long.

    They give it back sooner, and what is there already is not looked through for garbage again, which takes periods.
    """
    sys.setswitchinterval(SWITCH_S)
    gc.freeze()


def movement_to(
    description: RobotDescription, start: Floats, angles: Mapping[str, float], name: str
) -> tuple[JointTrajectory, float]:
    """A straight movement in the joints that `angles` names, rad, from the pose `start` [J], rad, and its duration, s.

    It is judged by the safety gate as any other.
    """
    indices = [description.index(joint) for joint in angles]
    goal = np.array(list(angles.values()))
    slow = EXIT_SPEED_FRACTION * description.operating_velocity[indices]
    duration_s = float(max(SHORTEST_EXIT_S, (EXIT_PEAK * np.abs(goal - start[indices]) / slow).max(initial=0.0)))
    message = JointTrajectory(id=name, joints=list(angles))
    for time_s, point in ((0.0, start[indices]), (duration_s, goal)):
        message.points.add(time_s=time_s, position_rad=point.tolist())
    return message, duration_s
