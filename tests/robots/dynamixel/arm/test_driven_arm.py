"""A driven arm, with all of its threads, on an emulated bus: it moves as told, and rests when something is wrong."""

import contextlib
import os
import re
import select
import threading
import time
from dataclasses import replace

import numpy as np
import pytest

from dynamixel_emulator.body import HardwareError
from dynamixel_emulator.emulator import DynamixelEmulator
from dynamixel_emulator.servo import EmulatedServo
from dynamixel_emulator.wire_faults import WireFaults
from paramove.bus import topics
from paramove.documents.input_error import InputError
from paramove.msgs.safety_state_pb2 import LinkState, SafetyState, StopRequest
from paramove.robots.description import RobotDescription
from paramove.robots.dynamixel.arm.driven_arm import SLOW_NS, DrivenArm
from paramove.robots.dynamixel.arm.servo_arm import ServoArm, Timeouts
from paramove.robots.dynamixel.arm.servo_loop import LoopSettings
from paramove.robots.dynamixel.arm.setup import joint_servos, servo_port
from paramove.robots.dynamixel.arm.stop_inputs import StopInputs
from paramove.robots.dynamixel.bus.servo_port import ServoPort
from paramove.robots.streaming.driver import DriverOutput
from sim.emulated_arm import emulated_servos
from tests.robots.dynamixel.person import Person
from tests.robots.dynamixel.untrue_replies import OneAsTheNext, OneElsewhere

SETTINGS = LoopSettings(timeouts=Timeouts(silent_s=2.0, watchdog_s=2.54, read_s=1.0))
"""Other programs may keep the emulator waiting, and the test."""
LATENCY_S = 0.3
TORQUE_LOST = "lost its torque: it was switched off, lost power or was rebooted; the arm must be armed again"
ROBOT = RobotDescription.load("robot_description/open_manipulator_x")


class PersonAtEmulator(Person):
    """Also sees into the servos."""

    def __init__(self, arm: DrivenArm, emulator: DynamixelEmulator, port: ServoPort | None = None) -> None:
        super().__init__(arm)
        self.emulator, self.port = emulator, port

    def sends(self, target, duration_s: float = 1.0, name: str = "a") -> None:
        self.publish(name, ROBOT.joint_names, [(0.0, ROBOT.units.to_radians(self.goals())), (duration_s, target)])

    def moves(self) -> None:
        """Sends a long movement and returns while it is under way."""
        self.sends(self.away(), 3.0)
        self.hears_until(lambda: any(one.time_s > 0.5 for one in self.statuses))

    def away(self):
        target = ROBOT.base_pose.copy()
        target[[0, 1]] += [0.5, 0.3]
        return target

    def memory(self, name: str) -> list[int]:
        with self.emulator.lock:
            return [servo.memory[name] for servo in self.emulator.bus.servos]

    def goals(self) -> list[int]:
        return self.memory("Goal Position")


@pytest.fixture
def emulator(tmp_path):
    with DynamixelEmulator(emulated_servos(ROBOT), tmp_path / "port") as emulator:
        yield emulator


def port(emulator, latency_s: float = LATENCY_S):
    """By its link: a terminal's own name is another program's as soon as it is unplugged."""
    port = servo_port(ROBOT, str(emulator.link))
    port.latency_s = latency_s
    return port


@pytest.fixture
def person(emulator):
    closed = port(emulator)
    with DrivenArm(ROBOT, joint_servos(ROBOT), closed, SETTINGS) as arm:
        yield PersonAtEmulator(arm, emulator, closed)


def test_it_moves_as_it_is_told(person):
    person.arms_and_waits()
    person.sends(person.away())
    person.is_told("SUCCEEDED")
    np.testing.assert_array_equal(person.goals(), ROBOT.units.to_counts(person.away()))
    assert person.memory("Profile Velocity") == [servo.profile_velocity for servo in joint_servos(ROBOT)]
    steps = np.abs(np.diff(person.angles, axis=0)).max(axis=0)
    assert (steps < 0.1).all()  # it began where it stood and jumped nowhere
    person.hears_until(lambda: person.motors is not None)
    assert [motor.id for motor in person.motors.motors] == [11, 12, 13, 14, 15]
    assert all(motor.responding and motor.voltage_v == pytest.approx(12.0, abs=0.01) for motor in person.motors.motors)


def test_an_arm_with_a_joint_at_its_stop_a_little_beyond_its_range_moves(person):
    beyond = ROBOT.units.zero_counts[2] + ROBOT.units.counts_per_rad[2] * (ROBOT.upper[2] + np.deg2rad(0.3))
    with person.emulator.lock:
        person.emulator.bus.servos[2].turned(float(round(beyond)))
    person.hears_until(lambda: person.angles and person.angles[-1][2] > ROBOT.upper[2])  # believed after a while
    person.arms_and_waits()
    person.publish("a", ROBOT.joint_names[:1], [(0.0, [0.0]), (1.0, [0.2])])
    person.is_told("SUCCEEDED")
    assert person.goals()[2] == round(beyond)


def test_nothing_moves_before_it_is_armed(person):
    person.waits_for("DISARMED")
    person.sends(person.away())
    assert person.is_told("REJECTED").code == "not_armed"
    assert person.memory("Torque Enable") == [0] * 5


def test_what_is_wrong_with_the_servos_keeps_it_disarmed(person):
    with person.emulator.lock:
        person.emulator.bus.servos[1].memory["Operating Mode"] = 4
        person.emulator.bus.servos[3].memory["Hardware Error Status"] = 0x20
    person.waits_for("DISARMED")
    person.arms()
    person.hears_until(lambda: person.safety.faults)
    assert person.codes() == [("servo_settings", "joint2"), ("hardware_error", "joint4")]
    assert person.memory("Torque Enable") == [0] * 5


def test_a_word_to_arm_does_not_grow_old_while_the_servos_are_checked(person, monkeypatch):
    person.waits_for("DISARMED")
    check = ServoArm.check
    monkeypatch.setattr(ServoArm, "check", lambda arm: threading.Event().wait(1.2) or check(arm))
    person.arms()
    person.waits_for("ARMED")
    assert person.codes() == []


def test_torque_that_was_on_at_the_start_does_not_make_it_jump(person):
    with person.emulator.lock:
        servo = person.emulator.bus.servos[2]
        servo.memory["Goal Position"] = servo.memory["Present Position"]
        servo.memory["Torque Enable"] = 1
    before = person.memory("Present Position")
    person.arms_and_waits()
    assert person.goals() == before


def test_an_arm_that_is_not_heard_says_its_safety_no_oftener_than_the_topic_allows(person, emulator):
    person.waits_for("DISARMED")
    emulator.unplug()
    person.waits_for("DISCONNECTED")
    stamps = []
    while len(stamps) < 6:
        select.select([person.arm.readable], [], [], 0.1)
        stamps += [now_ns for topic, _, now_ns in person.arm.said() if topic is topics.ARM_SAFETY]
    assert min(np.diff(stamps)) >= SLOW_NS


def test_a_joint_that_jumps_stops_the_arm_and_its_angle_is_not_published(person):
    person.arms_and_waits()
    person.moves()
    person.emulator.faults = OneElsewhere(15, 2100)
    person.waits_for("HOLD")
    assert person.codes() == [("joint_jumped", ROBOT.joint_names[4])]
    assert "servo 15 (gripper) jumped by 184.6 deg" in person.safety.faults[0].detail
    assert np.abs(np.diff(person.angles, axis=0)).max() < 0.2


def test_a_stop_ends_the_movement_and_only_a_new_word_arms_again(person):
    person.arms_and_waits()
    person.moves()
    person.arm.on_stop(StopRequest(source="page"))
    person.waits_for("HOLD")
    assert person.is_told("STOPPED").reason == "stopped from the page by a person"
    rested = person.goals()
    assert rested != list(ROBOT.units.to_counts(person.away()))
    person.sends(person.away(), name="b")
    assert person.is_told("REJECTED").code == "not_armed"
    assert person.goals() == rested
    assert person.memory("Torque Enable") == [1] * 5
    person.arms()
    person.waits_for("ARMED")


def test_who_sends_a_stop_does_not_wait_for_servos_that_keep_the_loop_waiting(person, monkeypatch):
    """A loop that is late all the time would otherwise keep the stop from being taken at all."""
    person.arms_and_waits()
    person.moves()
    arm = person.arm._loop.arm
    reads, goes_on, measured = threading.Event(), threading.Event(), arm.measured

    def slowly_measured():
        reads.set()
        goes_on.wait(60.0)
        return measured()

    monkeypatch.setattr(arm, "measured", slowly_measured)
    assert reads.wait(60.0)
    sends = threading.Thread(target=person.arm.on_stop, args=(StopRequest(source="person"),))
    sends.start()
    sends.join(5.0)
    waits = sends.is_alive()
    goes_on.set()
    assert not waits
    person.waits_for("HOLD")
    assert ("person_stop", "") in person.codes()


def test_every_change_of_state_is_published_as_it_was_at_its_tick(person, monkeypatch):
    """Whatever state the driver has by then: it may be in its next tick."""
    changes = [SafetyState.STATE_ARMED, SafetyState.STATE_STOPPING, SafetyState.STATE_HOLD]
    outputs = [[DriverOutput(None, None, (), SafetyState(state=state))] for state in changes]
    monkeypatch.setattr(person.arm._loop, "take", lambda: outputs.pop(0) if outputs else [])
    said = [list(person.arm.said()) for _ in changes]
    assert [[one.state for topic, one, _ in some if topic is topics.ARM_SAFETY] for some in said] == [
        [state] for state in changes
    ]


def test_a_stop_waits_for_no_position_that_is_withheld(person):
    """In every eighth exchange a servo's reply is lost, and another one has its ID."""
    person.arms_and_waits()
    person.port.latency_s = 0.02
    person.moves()
    faults = OneAsTheNext(8)
    person.emulator.faults = faults
    person.hears_until(lambda: faults.exchanges > 40)
    before = faults.exchanges
    person.arm.on_stop(StopRequest(source="page"))
    person.waits_for("HOLD")
    assert person.is_told("STOPPED").reason == "stopped from the page by a person"
    assert faults.exchanges - before <= 40, "the ramp takes 20"


def by_file(folder):
    """An emergency stop, what presses it, what releases it, and what is said while it is pressed."""
    file = folder / "estop"
    return StopInputs(file=file), file.touch, file.unlink, f"the emergency stop is pressed: there is a file {file}"


def by_line(folder):
    """As `by_file`, by a button whose wire the system shows as a file."""
    line = folder / "value"
    line.write_text("0\n")
    said = f"the emergency stop is pressed: {line} reads '1', released is '0'"
    return StopInputs(line=line), lambda: line.write_text("1\n"), lambda: line.write_text("0\n"), said


@pytest.mark.parametrize("by", [by_file, by_line])
def test_an_emergency_stop_by_a_file_stays_and_its_release_moves_nothing(emulator, tmp_path, by):
    stop, press, release, said = by(tmp_path)
    arm = DrivenArm(ROBOT, joint_servos(ROBOT), port(emulator), replace(SETTINGS, stop_inputs=stop))
    with arm:
        person = PersonAtEmulator(arm, emulator)
        person.arms_and_waits()
        assert arm.trouble == ""
        person.moves()
        press()
        person.waits_for("ESTOP")
        assert arm.trouble == said
        told = ("emergency_stop", "the emergency stop is pressed; release it, then arm again")
        assert [(fault.code, fault.detail) for fault in person.safety.faults] == [told]
        assert person.is_told("STOPPED").reason == told[1]
        person.hears_until(lambda: np.ptp(person.angles[-30:], axis=0).max() < 1e-3)
        rested = person.goals()
        assert rested != list(ROBOT.units.to_counts(person.away()))
        person.arms()
        release()
        person.waits_for("DISARMED")
        assert person.goals() == rested
        assert arm.trouble == ""
        person.arms()
        person.waits_for("ARMED")


def test_a_lost_link_to_the_host_that_commands_stops_it_and_its_return_moves_nothing(emulator):
    with DrivenArm(ROBOT, joint_servos(ROBOT), port(emulator), replace(SETTINGS, link_timeout_s=0.5)) as arm:
        person = PersonAtEmulator(arm, emulator)
        replies, ended = threading.Event(), threading.Event()
        replies.set()

        def link():
            while not ended.wait(0.01):
                if replies.is_set():
                    arm.on_link(LinkState(hosts=["desk_pc"]), time.monotonic_ns())

        linked = threading.Thread(target=link)
        linked.start()
        try:
            person.arms_and_waits()
            person.moves()
            replies.clear()
            person.waits_for("HOLD")
            assert [fault.code for fault in person.safety.faults] == ["link_lost"]
            assert "desk_pc" in person.is_told("STOPPED").reason
            rested = person.goals()
            assert rested != list(ROBOT.units.to_counts(person.away()))
            replies.set()
            person.arms()
            person.waits_for("ARMED")
            assert person.goals() == rested
        finally:
            ended.set()
            linked.join()


@pytest.mark.parametrize(
    ("goes_wrong", "detail"),
    [
        (lambda servo: servo.memory.__setitem__("Torque Enable", 0), TORQUE_LOST),
        (lambda servo: servo.fail(HardwareError.OVERHEATING), "overheated (register 70 is 0x04); let it cool, and"),
        (lambda servo: servo.fail(HardwareError.OVERLOAD), "overloaded (register 70 is 0x20); take the load off"),
        (lambda servo: servo.fail(HardwareError.ENCODER), "motor encoder failed (register 70 is 0x08); the servo must"),
        (lambda servo: setattr(servo, "voltage", 5.0), "input voltage out of its limits (register 70 is 0x01); check"),
    ],
    ids=["torque", "heat", "load", "encoder", "voltage"],
)
def test_a_servo_in_trouble_stops_all_of_them_and_the_others_hold(person, monkeypatch, goes_wrong, detail):
    reboots = []
    monkeypatch.setattr(EmulatedServo, "reboot", reboots.append)
    person.arms_and_waits()
    person.moves()
    with person.emulator.lock:
        goes_wrong(person.emulator.bus.servos[1])
    person.waits_for("HOLD")
    fault = person.safety.faults[0]
    assert (fault.code, fault.joint) == ("torque_lost" if detail == TORQUE_LOST else "hardware_error", "joint2")
    assert detail in fault.detail
    assert fault.detail.startswith("servo 12 (joint2) has ")
    assert detail == TORQUE_LOST or fault.detail.endswith("then, once this driver has ended, `paramove arm reboot 12`")
    assert person.is_told("STOPPED").reason.startswith(fault.detail)
    assert [person.memory("Torque Enable")[place] for place in (0, 2, 3, 4)] == [1] * 4
    rested = person.goals()
    assert rested != list(ROBOT.units.to_counts(person.away()))
    heard = len(person.angles)
    person.hears_until(lambda: len(person.angles) > heard + 10)
    assert person.goals() == rested
    assert reboots == []


def test_a_servo_that_reboots_in_motion_stops_all_of_them_and_is_limp_until_somebody_arms_again(person):
    person.arms_and_waits()
    person.moves()
    with person.emulator.lock:
        person.emulator.bus.servos[1].reboot()
    person.waits_for("HOLD")
    assert person.codes()[0] in (("torque_lost", "joint2"), ("joint_silent", "joint2"))
    told = person.safety.faults[0].detail
    assert TORQUE_LOST in told or told.startswith("no data from servo 12 (joint2)")
    assert person.memory("Torque Enable") == [1, 0, 1, 1, 1]
    person.hears_until(lambda: person.emulator.bus.servos[1].listens)
    person.arms()  # one word is enough
    person.waits_for("ARMED")
    assert person.memory("Torque Enable") == [1] * 5


def test_a_wire_that_damages_a_fifth_of_the_answers_stops_the_arm(person):
    person.arms_and_waits()
    person.port.latency_s = 0.02
    person.moves()
    person.emulator.faults = WireFaults(damaged=0.2, seed=1)
    person.waits_for("HOLD")
    assert person.codes()[0][0] == "bus_noise"
    detail = r"\d+ of the last \d+ exchanges on the bus were damaged, allowed 20%: check cable, plugs and supply"
    assert re.match(detail, person.safety.faults[0].detail)
    rested = person.goals()
    assert person.is_told("STOPPED").reason == person.safety.faults[0].detail
    assert person.goals() == rested


def test_a_second_servo_of_one_id_stops_the_arm(person):
    person.arms_and_waits()
    person.port.latency_s = 0.02
    person.moves()
    with person.emulator.lock:
        person.emulator.bus.add(EmulatedServo("xl430_w250", 12, 1_000_000))
    person.waits_for("HOLD")
    assert person.codes()[0] in (("joint_silent", "joint2"), ("bus_noise", ""))
    told = person.safety.faults[0].detail
    assert told.startswith("no data from servo 12 (joint2)") or "two servos may have one ID" in told


def test_a_joint_that_is_held_stops_the_arm_and_is_named(person):
    person.arms_and_waits()
    person.moves()
    with person.emulator.lock:
        person.emulator.bus.servos[0].blocked = True
    person.waits_for("HOLD")
    (fault,) = person.safety.faults
    assert (fault.code, fault.joint) == ("following", "joint1")
    told = r"joint joint1 has been [0-9.]+ deg from its commanded position for 100 ms, allowed 10\.00 deg"
    assert re.match(told, fault.detail)
    person.hears_until(lambda: np.ptp(person.angles[-10:], axis=0).max() < 1e-3)
    held = person.memory("Present Position")
    np.testing.assert_allclose(person.goals(), held, rtol=0, atol=2)  # no wind-up: let go of, it does not move


@contextlib.contextmanager
def name_taken(name):
    """Another device has this name meanwhile, as /dev/ttyUSB0 is another adapter after a while."""
    taken = []
    while not taken or (os.ttyname(taken[-1]) != name and len(taken) < 50):
        taken += os.openpty()
    yield
    for end in taken:
        os.close(end)


def test_pulled_out_and_plugged_in_again_it_is_disarmed(emulator, tmp_path, monkeypatch):
    link = tmp_path / "usb-FTDI_0001-if00-port0"
    with DynamixelEmulator(emulator.bus.servos, link) as linked:
        port = servo_port(ROBOT, str(link))
        port.latency_s = LATENCY_S
        settings = LoopSettings(timeouts=Timeouts(silent_s=0.5, watchdog_s=0.5, read_s=1.0))
        with DrivenArm(ROBOT, joint_servos(ROBOT), port, settings) as arm:
            person = PersonAtEmulator(arm, linked)
            person.arms_and_waits()
            person.moves()
            opened = []
            monkeypatch.setattr(ServoPort, "open", lambda port, was=ServoPort.open: (opened.append(port), was(port)))
            before = linked.port
            linked.unplug()
            person.waits_for("DISCONNECTED")
            assert "cable" in arm.trouble or "Plug in" in arm.trouble
            assert "is its cable plugged in?" in person.is_told("STOPPED").reason
            assert [code for code, _ in person.codes()] == ["port_lost", "robot_silent"]
            person.hears_until(lambda: person.memory("Bus Watchdog") == [0xFF] * 5)  # they stop by themselves
            assert not any(person.memory("Present Velocity"))
            assert len(opened) < 10  # it is asked for twice a second
            with name_taken(before):
                linked.plug_in()
            assert linked.port != before
            with linked.lock:
                linked.bus.servos[1].memory["Drive Mode"] = 1  # what was plugged in may be set otherwise
            person.waits_for("DISARMED")
            assert arm.trouble == ""
            assert person.codes()[0] == ("port_lost", "")
            rested = person.memory("Present Position")
            person.arms()
            person.hears_until(lambda: person.codes() == [("servo_settings", "joint2")])
            with linked.lock:
                linked.bus.servos[1].memory["Drive Mode"] = 0
            person.arms()
            person.waits_for("ARMED")
            assert person.memory("Present Position") == rested


@pytest.mark.parametrize(("torque_off", "torque"), [(False, [1] * 5), (True, [0] * 5)])
def test_at_the_end_it_rests_and_holds_or_goes_limp(emulator, torque_off, torque):
    with DrivenArm(ROBOT, joint_servos(ROBOT), port(emulator), replace(SETTINGS, torque_off=torque_off)) as arm:
        person = PersonAtEmulator(arm, emulator)
        person.arms_and_waits()
        person.moves()
    assert person.memory("Torque Enable") == torque
    assert person.memory("Bus Watchdog") == [0] * 5


REST = {"joint2": float(ROBOT.base_pose[1]) + 0.2, "joint3": float(ROBOT.base_pose[2]) - 0.1}


def test_at_the_end_it_goes_to_rest_slowly_and_then_limp(emulator, monkeypatch):
    played = []
    command = ServoArm.command
    monkeypatch.setattr(ServoArm, "command", lambda arm, counts: (played.append(counts), command(arm, counts)))
    with DrivenArm(ROBOT, joint_servos(ROBOT), port(emulator), replace(SETTINGS, rest=REST)) as arm:
        person = PersonAtEmulator(arm, emulator)
        person.arms_and_waits()
        played.clear()
    rest = ROBOT.base_pose.copy()
    rest[[1, 2]] = list(REST.values())
    assert person.goals() == list(ROBOT.units.to_counts(rest))
    assert person.memory("Torque Enable") == [0] * 5
    assert person.memory("Bus Watchdog") == [0] * 5
    speeds = np.abs(np.diff(ROBOT.units.to_radians(np.array(played)), axis=0)) / 0.01
    assert (speeds[:, 1:3].max(axis=0) > 0.05).all()
    assert (speeds <= 0.51 * ROBOT.operating_velocity + 0.16).all()  # a count in a period


def stops(person):
    person.arm.on_stop(StopRequest(source="page"))
    person.waits_for("HOLD")


@pytest.mark.parametrize(
    ("rest", "before_the_end", "why"),
    [
        (REST, stops, "it is not armed"),
        (REST, PersonAtEmulator.moves, "it was moving, and stops"),
        ({"joint1": 2.5}, lambda person: None, r"it would take 6\.0 s, and a launcher would kill this driver before"),
        (
            {"joint4": float(np.deg2rad(113.0))},
            lambda person: None,
            r".*\(joint_limit\) at point 1, joint joint4: requested 113 deg, allowed -96.4 to 111.8 deg",
        ),
    ],
    ids=["stopped", "moving", "far away", "impossible"],
)
def test_where_anything_is_wrong_it_does_not_go_to_rest_but_holds(emulator, caplog, rest, before_the_end, why):
    with DrivenArm(ROBOT, joint_servos(ROBOT), port(emulator), replace(SETTINGS, torque_off=True, rest=rest)) as arm:
        person = PersonAtEmulator(arm, emulator)
        person.arms_and_waits()
        before_the_end(person)
    assert person.memory("Torque Enable") == [1] * 5
    assert person.memory("Bus Watchdog") == [0] * 5
    assert re.search(f"the arm holds its position and does not go to rest: {why}", caplog.text)


def test_the_emergency_stop_wins_over_the_way_to_rest(emulator, tmp_path, caplog):
    button = tmp_path / "estop"
    settings = replace(SETTINGS, rest={"joint1": 0.8}, stop_inputs=StopInputs(file=button))
    with DrivenArm(ROBOT, joint_servos(ROBOT), port(emulator), settings) as arm:
        person = PersonAtEmulator(arm, emulator)
        person.arms_and_waits()
        measured = arm._loop.arm.measured

        def measured_until_it_moves():
            reading = measured()
            if abs(ROBOT.units.to_radians(reading.counts)[0] - ROBOT.base_pose[0]) > 0.1:
                button.touch()
            return reading

        arm._loop.arm.measured = measured_until_it_moves
    assert person.memory("Torque Enable") == [1] * 5
    reached = ROBOT.units.to_radians(np.array(person.goals()))[0] - ROBOT.base_pose[0]
    assert 0.1 <= reached < 0.5
    assert "does not go to rest: the emergency stop is pressed" in caplog.text


@pytest.mark.parametrize(
    ("goes_wrong", "torque", "not_heard"),
    [
        (lambda servo: servo.memory.__setitem__("ID", 99), [1, 0, 0, 0, 0], ["Torque Enable", "Bus Watchdog"]),
        (lambda servo: servo.fail(HardwareError.OVERLOAD), [0] * 5, []),
    ],
    ids=["silent", "in error"],
)
def test_a_servo_in_trouble_at_the_end_keeps_nothing_from_the_others(emulator, caplog, goes_wrong, torque, not_heard):
    closed = port(emulator, 0.05)
    with DrivenArm(ROBOT, joint_servos(ROBOT), closed, replace(SETTINGS, torque_off=True)) as arm:
        person = PersonAtEmulator(arm, emulator)
        person.arms_and_waits()
        with emulator.lock:
            goes_wrong(emulator.bus.servos[0])
    assert person.memory("Torque Enable") == torque
    assert person.memory("Bus Watchdog")[1:] == [0] * 4
    told = [record.message for record in caplog.records if "did not take its final settings" in record.message]
    begin = "a servo did not take its final settings: joint1: servo 11 did not answer"
    assert [one.partition(" (write ")[::2][0] for one in told] == [begin] * len(not_heard)
    assert [name for name, one in zip(not_heard, told, strict=True) if name in one] == not_heard
    with ServoPort(emulator.port):  # free for others
        pass


def test_servos_that_never_answer_are_named_with_the_remedy(emulator):
    with emulator.lock:
        emulator.bus.servos[1].powered = False
    with DrivenArm(ROBOT, joint_servos(ROBOT), port(emulator, 0.05), SETTINGS) as arm:
        person = PersonAtEmulator(arm, emulator)
        person.hears_until(lambda: "servo 12 (joint2)" in arm.trouble and "servo 11" not in arm.trouble)
        assert "check the motors' power" in arm.trouble


@pytest.mark.filterwarnings("ignore::pytest.PytestUnhandledThreadExceptionWarning")
def test_a_loop_that_fails_is_told(person, monkeypatch):
    person.waits_for("DISARMED")
    monkeypatch.setattr(ServoArm, "measured", lambda arm: 1 / 0)
    with pytest.raises(RuntimeError, match="rest by their watchdog"):
        person.hears_until(lambda: person.arm.trouble)


def test_a_missing_port_is_told_with_the_remedy():
    arm = DrivenArm(ROBOT, joint_servos(ROBOT), servo_port(ROBOT, "/dev/ttyUSB77"), SETTINGS)
    with pytest.raises(InputError, match=r"no serial port /dev/ttyUSB77, found are: .*`paramove arm scan`"), arm:
        pass
