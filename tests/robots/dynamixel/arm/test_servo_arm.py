"""The servos of an arm: what keeps them from holding, that nothing moves when they begin to, and what is noticed."""

import re
import time
from dataclasses import replace

import numpy as np
import pytest

from dynamixel_emulator.emulator import DynamixelEmulator
from dynamixel_emulator.servo import EmulatedServo
from dynamixel_emulator.wire_faults import WireFaults
from paramove.robots.dynamixel.arm.servo_arm import ServoArm, Timeouts
from paramove.robots.dynamixel.arm.servo_checks import JointServo
from paramove.robots.dynamixel.bus.servo_chain import ServoChain, ServoRejectedError
from paramove.robots.dynamixel.bus.servo_models import XL330_M288, XL430_W250
from paramove.robots.dynamixel.bus.servo_port import PortLostError, ServoPort
from paramove.robots.dynamixel.calibration.arm_calibration import JointCalibration

BAUD_RATE = 1_000_000
PATIENT_S, PERIOD_S, WATCHDOG_UNITS = 0.3, 1.0, 127
"""Other programs may keep the emulator waiting, and the test."""
JOINTS = (JointServo("pan", 1, XL430_W250), JointServo("lift", 2, XL430_W250), JointServo("wrist", 3, XL330_M288))
PLACES = (1000.0, 2000.0, 3000.0)
WITHIN_A_TURN = JointCalibration(
    id=3, model="xl330_m288", firmware=46, sign=1, operating_mode=3, homing_offset=0, zero_counts=3000,
    min_counts=2000, max_counts=4000,
)  # fmt: skip


@pytest.fixture
def emulator():
    servos = [
        EmulatedServo(joint.model.name, joint.number, BAUD_RATE, place)
        for joint, place in zip(JOINTS, PLACES, strict=True)
    ]
    with DynamixelEmulator(servos) as emulator:
        yield emulator


@pytest.fixture
def port(emulator):
    with ServoPort(emulator.port, BAUD_RATE, latency_s=PATIENT_S) as port:
        yield port


@pytest.fixture
def arm(port):
    return ServoArm(JOINTS, ServoChain(port), PERIOD_S, Timeouts(watchdog_s=2.54))


def memory(emulator, name: str) -> list[int]:
    with emulator.lock:
        return [servo.memory[name] for servo in emulator.bus.servos]


def change(emulator, place: int, name: str, value: int) -> None:
    with emulator.lock:
        emulator.bus.servos[place].memory[name] = value


def test_a_sound_arm_holds_where_it_stands_and_watches_the_bus(arm, emulator):
    assert arm.check() == ()
    assert arm.take_hold() == ()
    assert memory(emulator, "Torque Enable") == [1, 1, 1]
    assert memory(emulator, "Goal Position") == [1000, 2000, 3000]
    assert memory(emulator, "Bus Watchdog") == [WATCHDOG_UNITS] * 3
    assert arm.let_go(torque_off=False) == ()
    assert (memory(emulator, "Torque Enable"), memory(emulator, "Bus Watchdog")) == ([1, 1, 1], [0, 0, 0])
    assert arm.let_go(torque_off=True) == ()
    assert memory(emulator, "Torque Enable") == [0, 0, 0]


def test_torque_that_was_on_before_does_not_make_it_jump(arm, emulator):
    with emulator.lock:
        servo = emulator.bus.servos[1]
        servo.memory["Torque Enable"], servo.memory["Goal Position"] = 1, 2000
        servo.memory["Bus Watchdog"] = 0xFF  # of a program that died
    assert arm.take_hold() == ()
    assert memory(emulator, "Goal Position") == [1000, 2000, 3000]


def test_goals_reach_the_servos_and_positions_come_back(arm, emulator):
    arm.take_hold()
    arm.command(np.array([1010, 1990, 3000], dtype=np.int16))
    reading = arm.measured()  # whose answers come after the goals, to which none answers
    assert memory(emulator, "Goal Position") == [1010, 1990, 3000]
    assert abs(reading.counts - [1000, 2000, 3000]).max() <= 10
    assert (reading.ages_s < PATIENT_S).all()


@pytest.mark.parametrize(
    ("name", "value", "code", "detail"),
    [
        ("ID", 9, "servo_missing", r"servo 2 \(lift\) does not answer.*`paramove arm scan`"),
        ("Model Number", 1200, "servo_model", r"servo 2 \(lift\) is of model 1200, expected 1060 \(xl430_w250\)"),
        ("Firmware Version", 38, "servo_firmware", r"firmware 38, at least 42"),
        (
            "Operating Mode",
            1,
            "servo_settings",
            r"Operating Mode 1, expected 3: once .* ended, `paramove arm verify --write`",
        ),
        ("Homing Offset", 55, "servo_settings", r"Homing Offset 55, expected 0"),
        (
            "Hardware Error Status",
            0x24,
            "hardware_error",
            r"overheated and overloaded \(register 70 is 0x24\).*reboot 2",
        ),
    ],
)
def test_what_keeps_an_arm_from_being_armed(arm, emulator, port, name, value, code, detail):
    change(emulator, 1, name, value)
    port.latency_s = 0.05 if name == "ID" else PATIENT_S
    (fault,) = arm.check()
    assert (fault.code, fault.joint) == (code, "lift")
    assert re.search(detail, fault.detail)


def test_all_that_is_wrong_is_told_together(arm, emulator):
    with emulator.lock:
        emulator.bus.servos[0].voltage = 5.2
        emulator.bus.servos[1].memory["Drive Mode"] = 1
        emulator.bus.servos[2].temperature = 71.0
    assert [(fault.code, fault.joint) for fault in arm.check()] == [
        ("hardware_error", "pan"),
        ("servo_voltage", "pan"),
        ("servo_settings", "lift"),
        ("hardware_error", "wrist"),
        ("servo_hot", "wrist"),
    ]


@pytest.mark.parametrize(("end", "found"), [("Min", 3100), ("Max", 3900)])
def test_a_calibrated_arm_whose_position_limits_are_others_is_not_armed(emulator, port, end, found):
    calibrated = replace(JOINTS[2], calibration=WITHIN_A_TURN)
    arm = ServoArm((*JOINTS[:2], calibrated), ServoChain(port), PERIOD_S)
    expected = {"Min": WITHIN_A_TURN.min_counts, "Max": WITHIN_A_TURN.max_counts}
    with emulator.lock:
        for each, value in expected.items():
            emulator.bus.servos[2].preset(f"{each} Position Limit", value)
    assert arm.check() == ()
    change(emulator, 2, f"{end} Position Limit", found)
    (fault,) = arm.check()
    assert (fault.code, fault.joint) == ("servo_settings", "wrist")
    assert f"servo 3 (wrist) has {end} Position Limit {found}, expected {expected[end]}" in fault.detail
    assert all(option in fault.detail for option in ("`paramove arm verify --write`", "`--adopt`"))
    assert memory(emulator, "Torque Enable") == [0, 0, 0]


def test_an_adapter_that_keeps_answers_for_16_ms_is_told_with_time_and_remedy(emulator, port):
    emulator.faults = WireFaults(delay_s=0.016)
    (fault,) = ServoArm(JOINTS, ServoChain(port), period_s=0.010).check()
    assert fault.code == "bus_slow"
    facts = re.match(
        r"reading the servos takes ([0-9.]+) ms, allowed 10\.0 ms: raise the baud rate, .*latency timer to 1 ms "
        r"\(`paramove doctor`",
        fault.detail,
    )
    assert facts is not None
    assert float(facts[1]) >= 16.0
    assert memory(emulator, "Torque Enable") == [0, 0, 0]


def test_servos_that_stopped_by_themselves_are_told_take_no_goal_and_hold_again_when_armed(emulator, port):
    arm = ServoArm(JOINTS, ServoChain(port), PERIOD_S, Timeouts(watchdog_s=1.0))
    assert arm.take_hold() == ()
    while memory(emulator, "Bus Watchdog") != [0xFF] * 3:  # nobody asks them anything
        pass
    fault = arm.look_after_watchdogs()
    assert (fault.code, fault.joint) == ("watchdog_tripped", "pan")
    assert "servo 1 (pan) has stopped by itself" in fault.detail
    assert "without data for 1000 ms" in fault.detail
    assert fault.detail.endswith("arm again, which clears its watchdog")
    goal = XL430_W250.registers["Goal Position"]
    with pytest.raises(ServoRejectedError, match=r"servo 1 .*out of range: write Goal Position = 10"):
        ServoChain(port).write(1, goal, 1010)
    assert arm.take_hold() == ()
    assert memory(emulator, "Goal Position") == [1000, 2000, 3000]
    assert 0xFF not in memory(emulator, "Bus Watchdog")


def test_a_servo_that_cannot_hold_leaves_the_others_as_they_were(arm, emulator):
    with emulator.lock:
        emulator.bus.servos[0].memory["Torque Enable"] = 1
        emulator.bus.servos[2].memory["Max Position Limit"] = 2900
    (fault,) = arm.take_hold()
    assert (fault.code, fault.joint) == ("servo_refused", "wrist")
    assert "beyond its limits" in fault.detail
    assert memory(emulator, "Torque Enable") == [1, 0, 0]
    assert not arm.holds


def test_a_joint_that_falls_silent_is_named_and_keeps_its_last_position(arm, emulator, port):
    arm.measured()
    change(emulator, 2, "ID", 9)
    port.latency_s = 0.03
    until_s = time.monotonic() + 60.0
    fault = None
    while fault is None or fault.joint != "wrist":  # a pause of the machine may make others silent for a while
        assert time.monotonic() < until_s, fault
        reading = arm.measured()
        fault = arm.fault_of_answers(reading)
    assert reading.counts[2] == 3000
    assert fault.code == "joint_silent"


def test_joints_that_fall_silent_together_are_told_together(arm, emulator, port):
    arm.measured()
    port.latency_s = 0.03

    def told(words):
        """The fault that begins so: a pause of the machine may make others silent for a while."""
        until_s = time.monotonic() + 60.0
        while (fault := arm.fault_of_answers(arm.measured())) is None or not fault.detail.startswith(words):
            assert time.monotonic() < until_s, fault
        return fault

    for place, who in ((0, "servo 1 (pan) for"), (1, "servo 1 (pan), servo 2 (lift) for")):
        change(emulator, place, "ID", 9 + place)
        told(f"no data from {who}")
    change(emulator, 2, "ID", 19)
    fault = told("no data from any servo for")
    assert (fault.code, fault.joint) == ("joint_silent", "")
    assert fault.detail.endswith("check cables and the motors' power")


def test_the_loop_does_not_wait_for_an_arm_that_is_silent(arm, emulator, port, monkeypatch):
    monkeypatch.setattr("paramove.robots.dynamixel.bus.servo_chain.REST_S", 100.0)
    arm.measured()
    sound = arm.measured()
    port.latency_s = 0.005
    with emulator.lock:
        for _ in range(20):  # without an end if each of them waited
            reading = arm.measured()
            assert arm.look_after() is None
        assert (reading.at_ns, reading.counts.tolist()) == (sound.at_ns, list(PLACES))
        assert arm.fault_of_answers(reading).code == "joint_silent"


def test_no_angle_is_invented_for_a_joint_that_was_never_heard(arm, emulator, port):
    change(emulator, 2, "ID", 9)
    port.latency_s = 0.03
    assert arm.measured() is None


def test_a_servo_that_reboots_while_it_holds_has_lost_its_torque(arm, emulator):
    arm.take_hold()
    assert arm.look_after() is None
    change(emulator, 0, "Torque Enable", 0)
    fault = arm.look_after()
    assert (fault.code, fault.joint) == ("torque_lost", "pan")


def test_an_overload_is_told_in_words_while_it_moves(arm, emulator):
    arm.take_hold()
    change(emulator, 1, "Hardware Error Status", 0x20)
    fault = arm.look_after()
    assert (fault.code, fault.joint) == ("hardware_error", "lift")
    assert "overloaded" in fault.detail


def test_low_voltage_is_warned_of_and_too_low_a_one_is_a_fault(arm, emulator):
    assert arm.look_after_supply() is None
    assert arm.warnings() == ()
    with emulator.lock:
        emulator.bus.servos[0].voltage = 6.4
    assert arm.look_after_supply() is None
    assert arm.warnings() == ("pan has 6.4 V, its limit is 6.0 V: charge or check the supply",)
    with emulator.lock:
        emulator.bus.servos[0].voltage = 5.5
    assert arm.look_after_supply().code == "servo_voltage"


@pytest.mark.parametrize(("share", "latency_s", "noisy"), [(0.01, 0.1, False), (0.3, 0.01, True)])
def test_one_damaged_answer_in_a_hundred_is_no_matter_and_many_are_a_fault(emulator, port, share, latency_s, noisy):
    arm = ServoArm(JOINTS, ServoChain(port), PERIOD_S, Timeouts(silent_s=60.0))
    arm.measured()
    port.latency_s = latency_s
    emulator.faults = WireFaults(damaged=share, seed=5)
    faults = [arm.fault_of_answers(arm.measured()) for _ in range(90)]
    told = {fault.detail for fault in faults if fault is not None and fault.code != "joint_silent"}
    assert all("exchanges on the bus were damaged, allowed 20%: check" in detail for detail in told)
    assert bool(told) is noisy


def test_the_last_word_goes_to_every_servo_even_if_one_does_not_answer(arm, emulator, port):
    arm.take_hold()
    change(emulator, 0, "ID", 9)
    port.latency_s = 0.03
    failed = arm.let_go(torque_off=True)
    assert len(failed) == 2
    assert all("servo 1 did not answer" in one for one in failed)
    assert memory(emulator, "Torque Enable") == [1, 0, 0]


def arm_across_the_seam(emulator, port, at):
    """Its last joint, whose range has the servo's zero in it, and the servo of it."""
    across = JointCalibration(
        id=3, model="xl330_m288", firmware=46, sign=1, operating_mode=4, homing_offset=0, zero_counts=4096,
        min_counts=3000, max_counts=5200,
    )  # fmt: skip
    with emulator.lock:
        servo = emulator.bus.servos[2]
        servo.preset("Operating Mode", 4)
        servo.turned(at)
    return ServoArm((*JOINTS[:2], replace(JOINTS[2], calibration=across)), ServoChain(port), PERIOD_S), servo


def test_a_joint_across_the_seam_counts_on_and_its_goals_find_the_turn_that_it_is_in(emulator, port):
    arm, servo = arm_across_the_seam(emulator, port, 100.0)  # 4196 in the counts of the joint
    assert arm.measured().counts[2] == 4196
    with emulator.lock:
        servo.turned(4196.0)  # counted on beyond its turn,
        assert servo.memory["Present Position"] == 4196
        servo.reboot()  # and after a loss of power in one turn again
        assert servo.memory["Present Position"] == 100
    while not servo.listens:
        pass
    assert arm.measured().counts[2] == 4196
    assert arm.check() == ()
    assert arm.take_hold() == ()
    arm.command(np.array([1000, 2000, 4090], dtype=np.int16))
    arm.measured()
    assert memory(emulator, "Goal Position")[2] == 4090 - 4096


def test_a_servo_that_loses_a_turn_and_its_torque_while_it_holds_is_where_it_was(emulator, port):
    arm, servo = arm_across_the_seam(emulator, port, 4196.0)
    assert arm.measured().counts[2] == 4196
    assert arm.take_hold() == ()
    with emulator.lock:
        servo.reboot()
    while not servo.listens:
        pass
    reading = arm.measured()  # a turn less, and it should hold
    assert reading.counts[2] == 4196
    assert arm.fault_of_answers(reading).code == "joint_jumped"
    assert arm.look_after().code == "torque_lost"
    assert arm.check() == ()
    assert arm.measured().counts[2] == 4196
    assert arm.take_hold() == ()
    assert memory(emulator, "Goal Position")[2] == 100
    assert arm.measured().counts[2] == 4196


def test_a_pulled_plug_is_told(arm, emulator):
    emulator.unplug()
    with pytest.raises(PortLostError, match="cable"):
        arm.measured()
