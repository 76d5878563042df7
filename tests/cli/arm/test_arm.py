"""`paramove arm` with emulated servos: what it finds, asks, writes and refuses, and its exit codes."""

from __future__ import annotations

import json

import pytest
from typer.testing import CliRunner

from dynamixel_emulator.servo import EmulatedServo
from paramove.cli.main import build
from paramove.msgs.safety_state_pb2 import SafetyFault, SafetyState
from paramove.robots.dynamixel.bus.servo_port import ServoPort
from paramove.robots.dynamixel.calibration.arm_calibration import ArmCalibration
from paramove.robots.dynamixel.calibration.path import calibration_path
from paramove.safety.gate_io import PERSON_STOP
from tests.robots.dynamixel.koch_arm import KOCH, PLAN, hands, rest
from tests.robots.dynamixel.small_arm import LINK, SERIAL

RATE = PLAN.baud_rate


def test_scan_lists_the_servos(desk):
    servos = desk.plug_in_koch()
    servos[1].memory["Hardware Error Status"] = 0x20
    done = desk.arm("scan", "--baud", RATE, "--json")
    assert done.exit_code == 0, done.output
    (adapter,) = json.loads(done.stdout)
    assert (adapter["serial"], adapter["findings"]) == (SERIAL, [])
    assert adapter["link"] == str(desk.by_id / LINK)
    assert [row["id"] for row in adapter["servos"]] == [1, 2, 3, 4, 5, 6]
    assert adapter["servos"][1] == {
        "id": 2,
        "model": "xl430_w250",
        "model_number": 1060,
        "firmware": 46,
        "baud_rate": RATE,
        "voltage": 11.1,
        "temperature": 30,
        "hardware_error": "overloaded",
        "torque": False,
    }
    done = desk.arm("scan", "--baud", RATE)
    assert f"adapter {SERIAL} (/dev/" in done.stdout
    assert f"port {desk.by_id / LINK}\n" in done.stdout
    assert "overloaded" in done.stdout


def test_scan_tells_another_baud_rate_than_calibrated(desk):
    servos = desk.plug_in_koch()
    desk.calibrated()
    for servo in servos:
        servo.memory["Baud Rate"] = 4
    done = desk.arm("scan", "--baud", RATE, "--baud", 2_000_000)
    assert done.exit_code == 3
    assert f"found 6 servos at 2000000, configured {RATE}" in done.stdout


def test_without_an_adapter_or_a_servo_it_is_told(desk):
    done = desk.arm("scan")
    assert done.exit_code == 69
    assert "no serial adapter in" in done.stderr
    assert "dialout" in done.stderr
    desk.plug_in()
    done = desk.arm("scan", "--baud", RATE)
    assert done.exit_code == 69
    assert "no servo answers: check the power" in done.stderr
    done = desk.arm("bench")
    assert done.exit_code == 69
    assert f"no servo answers at {RATE}" in done.stderr
    done = desk.arm("reboot", 1, "--serial", "OTHER")
    assert done.exit_code == 69
    assert f"no serial adapter 'OTHER' in {desk.by_id}, found {SERIAL}" in done.stderr


def test_a_port_in_use_is_told(desk):
    desk.plug_in_koch()
    with ServoPort(str(desk.by_id / LINK), RATE):
        done = desk.arm("scan", "--baud", RATE)
    assert done.exit_code in (75, 78)  # root may open what is locked for others
    assert "in use" in done.stderr


def test_setup_gives_one_servo_after_the_other_its_id(desk):
    planned = PLAN.servos[1:3]
    new = [EmulatedServo(one.model, 1, 2_000_000) for one in planned]
    desk.plug_in(*new)
    both = [EmulatedServo("xl330_m288", 8, RATE), new[1]]
    steps = [(lambda: desk.connect(new[0]), "\n"), (lambda: desk.connect(*both), "\n")]
    steps += [(lambda: desk.connect(new[1]), "\n")]
    joints = [word for one in planned for word in ("--joint", one.joint)]
    done = desk.arm("setup", "--robot", KOCH, *joints, steps=steps)
    assert done.exit_code == 0, done.output
    assert [(one.id, one.baud_rate, one.memory["Return Delay Time"]) for one in new] == [(n, RATE, 0) for n in (2, 3)]
    assert "exactly one servo on the bus, found ID 8 (xl330_m288), ID 1 (xl330_m288)" in done.stdout
    assert "shoulder_lift: ID 1 at 2000000 is now ID 2 at 1000000" in done.stdout


def test_setup_that_ends_before_tells_how_to_go_on(desk):
    desk.plug_in()
    done = desk.arm("setup", "--robot", KOCH, "--joint", "elbow_flex", "--joint", "gripper", steps=[(rest, "q\n")])
    assert done.exit_code == 1
    assert "continue with --joint elbow_flex --joint gripper" in done.stderr
    done = desk.arm("setup", "--robot", KOCH, "--joint", "tail")
    assert done.exit_code == 78
    assert "koch_v1_1 has no joint 'tail', found shoulder_pan" in done.stderr


def test_calibrate_writes_file_and_servos(desk):
    desk.plug_in_koch()
    done = desk.arm("calibrate", "--robot", KOCH, steps=hands(desk.emulator))
    assert done.exit_code == 0, done.output
    path = calibration_path(SERIAL, desk.data)
    assert f"{path}: 6 joints" in done.stdout
    found = ArmCalibration.load(path, SERIAL)
    assert found.robot == "koch_v1_1"
    for one in PLAN.servos:
        joint = found.joints[one.joint]
        assert (joint.sign, joint.zero_counts, joint.operating_mode) == (1, 2048, 5 if one.grips else 3)
    done = desk.arm("verify", "--robot", KOCH)
    assert done.exit_code == 0, done.output
    assert "no differences" in done.stdout


@pytest.mark.parametrize("stop_at", [0, 1, 5, 17])
def test_calibrate_that_ends_before_keeps_the_old_file(desk, stop_at):
    desk.plug_in_koch()
    path = desk.calibrated()
    before = path.read_text()
    done = desk.arm("calibrate", "--robot", KOCH, steps=[*hands(desk.emulator)[:stop_at], (rest, "q\n")])
    assert done.exit_code == 1
    assert "nothing was saved" in done.stderr
    assert path.read_text() == before


def test_verify_tells_writes_and_adopts(desk):
    servos = desk.plug_in_koch()
    path = desk.calibrated()
    servos[0].memory["Max Position Limit"] = 4000
    servos[5].memory["Firmware Version"] = 47
    done = desk.arm("verify", "--json")
    assert done.exit_code == 3
    found = {(row["joint"], row["what"]): (row["expected"], row["found"]) for row in json.loads(done.stdout)}
    limit = ArmCalibration.load(path, SERIAL).joints["shoulder_pan"].max_counts
    assert found == {("shoulder_pan", "Max Position Limit"): (limit, 4000), ("gripper", "firmware"): (46, 47)}
    done = desk.arm("verify", "--write")
    assert done.exit_code == 3  # firmware cannot be written
    assert f"shoulder_pan: Max Position Limit 4000 is now {limit}" in done.stderr
    assert "1 difference" in done.stdout
    assert "--adopt takes the servos' into the file" in done.stderr
    assert desk.arm("verify", "--adopt").exit_code == 0
    assert ArmCalibration.load(path, SERIAL).joints["gripper"].firmware == 47
    assert desk.arm("verify", "--write", "--adopt").exit_code == 2


def test_verify_signs_a_file_that_was_edited(desk):
    desk.plug_in_koch()
    path = desk.calibrated()
    path.write_text(path.read_text().replace("sign: 1", "sign: -1", 1))
    done = desk.arm("verify")
    assert done.exit_code == 78
    assert "verify --sign" in done.stderr
    assert desk.arm("verify", "--sign").exit_code == 0
    assert desk.arm("verify").exit_code == 0


def test_verify_looks_for_servos_at_another_baud_rate(desk):
    servos = desk.plug_in_koch()
    desk.calibrated()
    for servo in servos:
        servo.memory["Baud Rate"] = 4
    done = desk.arm("verify")
    assert done.exit_code == 69
    assert f"found 6 servos at 2000000, configured {RATE}; `paramove arm setup` sets" in done.stderr


def test_verify_without_a_calibration_says_so(desk):
    desk.plug_in()
    done = desk.arm("verify")
    assert done.exit_code == 66
    assert "no calibration of an arm" in done.stderr


def test_reboot_tells_the_error_first(desk):
    servos = desk.plug_in_koch()
    servos[2].memory["Hardware Error Status"] = 0x04
    servos[3].memory["Torque Enable"] = 1
    done = desk.arm("reboot", 3)
    assert done.exit_code == 0, done.output
    assert done.stdout.splitlines() == [
        "servo 3: overheated; let it cool, and give it less to carry or more pauses",
        "servo 3 was rebooted: no hardware error, torque off",
    ]
    assert servos[3].memory["Torque Enable"] == 1


def test_bench_measures(desk):
    desk.plug_in_koch()
    done = desk.arm("bench", "--rounds", 10, "--json")
    found = json.loads(done.stdout)
    assert (found["servos"], found["rounds"], found["latency_timer_ms"]) == (6, 10, None)
    done = desk.arm("bench", "--rounds", 10, "--rate", 100_000)
    assert done.exit_code == 3
    assert "the bus cannot hold 100000 Hz" in done.stderr
    assert "p99" in done.stdout


def test_estop_without_a_run_names_the_real_one(desk, monkeypatch):
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(desk.data.parent))
    for words in (["arm", "estop"], ["arm", "estop", "--domain", "other"]):
        done = CliRunner().invoke(build("arm"), words)
        assert done.exit_code == 69
        assert "nothing is running" in done.stderr
        assert "switch of the motors' power: that one is the real emergency stop" in done.stderr


@pytest.mark.parametrize(("answer", "code"), [(None, 69), (SafetyState.STATE_HOLD, 0)])
def test_estop_believes_the_gate_alone(desk, monkeypatch, answer, code):
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(desk.data.parent))
    monkeypatch.delenv("PARAMOVE_DOMAIN", raising=False)
    (desk.data.parent / "paramove" / "default").mkdir(parents=True)
    fault = SafetyFault(code=PERSON_STOP, detail="stopped from the terminal by a person")
    state = None if answer is None else SafetyState(state=answer, faults=[fault])
    monkeypatch.setattr("paramove.operator.stop_arms", lambda folder, source, timeout_s: {"": state})
    done = CliRunner().invoke(build("arm"), ["arm", "estop"])
    assert done.exit_code == code
    assert ("hold, stopped from the terminal" in done.stdout) == (code == 0)
    assert ("no safety gate has answered within 1 s" in done.stderr) == (code == 69)


def test_estop_names_the_arm_that_has_not_answered(desk, monkeypatch):
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(desk.data.parent))
    monkeypatch.delenv("PARAMOVE_DOMAIN", raising=False)
    (desk.data.parent / "paramove" / "default").mkdir(parents=True)
    fault = SafetyFault(code=PERSON_STOP, detail="stopped from the terminal by a person")
    answers = {"left": SafetyState(state=SafetyState.STATE_HOLD, faults=[fault]), "right": None}
    monkeypatch.setattr("paramove.operator.stop_arms", lambda folder, source, timeout_s: answers)
    done = CliRunner().invoke(build("arm"), ["arm", "estop"])
    assert done.exit_code == 69
    assert "the safety gate of left has received it: hold" in done.stdout
    assert "the safety gate of right has not answered" in done.stderr
