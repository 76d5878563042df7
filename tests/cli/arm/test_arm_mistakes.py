"""What a person does wrong with `paramove arm`, and what goes wrong meanwhile: told, and nothing is spoilt."""

from __future__ import annotations

import pytest

from dynamixel_emulator.servo import EmulatedServo
from paramove.robots.dynamixel.bus.servo_chain import ServoChain
from tests.robots.dynamixel.koch_arm import KOCH, PLAN, hands, rest


def test_setup_refuses_the_servo_that_it_has_just_set_up(desk):
    pan, lift = [EmulatedServo(one.model, 1, 2_000_000) for one in PLAN.servos[:2]]
    desk.plug_in(pan)
    steps = [(rest, "\n"), (rest, "\n"), (lambda: desk.connect(lift), "\n")]
    done = desk.arm("setup", "--robot", KOCH, "--joint", "shoulder_pan", "--joint", "shoulder_lift", steps=steps)
    assert done.exit_code == 0, done.output
    assert "the servo with ID 1 is that of shoulder_pan, which was just set up" in done.stdout
    assert [pan.id, lift.id] == [1, 2]


def test_ctrl_c_tells_how_to_go_on_and_what_was_not_saved(desk):
    desk.plug_in_koch()
    path = desk.calibrated()
    before = path.read_text()

    def interrupted():
        raise KeyboardInterrupt

    done = desk.arm("setup", "--robot", KOCH, "--joint", "gripper", steps=[(interrupted, "")])
    assert done.exit_code == 130
    assert "continue with --joint gripper" in done.stderr
    done = desk.arm("calibrate", "--robot", KOCH, steps=[*hands(desk.emulator)[:-1], (interrupted, "")])
    assert done.exit_code == 130
    assert "nothing was saved" in done.stderr
    assert path.read_text() == before


def test_calibrate_that_ends_at_the_last_question_has_written_nothing_to_the_servos(desk):
    servos = desk.plug_in_koch()
    before = servos[0].memory["Max Position Limit"]
    done = desk.arm("calibrate", "--robot", KOCH, steps=[*hands(desk.emulator)[:-1], (rest, "q\n")])
    assert done.exit_code == 1
    assert servos[0].memory["Max Position Limit"] == before


def test_calibrate_looks_first_whether_the_file_can_be_kept(desk):
    desk.plug_in_koch()
    desk.data.write_text("a file in the place of the folder")
    done = desk.arm("calibrate", "--robot", KOCH, steps=hands(desk.emulator))
    assert done.exit_code == 77
    assert "Hold the arm" not in done.stdout
    assert f"{desk.data / 'calibration'}: Not a directory" in done.stderr


@pytest.mark.parametrize("rate", [7, 99_999_999_999])
def test_a_baud_rate_that_no_servo_has_is_refused(desk, rate):
    desk.plug_in_koch()
    for command in ("scan", "bench"):
        done = desk.arm(command, "--baud", rate)
        assert done.exit_code == 78
        assert f"9600 to 4500000 bit/s, found {rate}" in done.stderr


def test_bench_tells_a_servo_that_falls_silent(desk, monkeypatch):
    servos = desk.plug_in_koch()
    ping_all = ServoChain.ping_all

    def then_one_leaves(chain):
        found = ping_all(chain)
        desk.connect(*servos[:-1])
        return found

    monkeypatch.setattr(ServoChain, "ping_all", then_one_leaves)
    done = desk.arm("bench", "--rounds", 10)
    assert done.exit_code == 3
    assert "answers are missing or damaged" in done.stderr


def test_setup_tells_a_plug_that_was_pulled_while_it_waited(desk):
    desk.plug_in_koch()
    done = desk.arm("setup", "--robot", KOCH, "--joint", "gripper", steps=[(desk.emulator.unplug, "\n")])
    assert done.exit_code == 69
    assert "went away" in done.stderr
