"""A program arms only a robot that its launch emulates, and only at the start: afterwards a person does."""

from __future__ import annotations

import pytest

from benchmarks.safety_steps import MS
from paramove.safety.gate_io import ArmingRequest, Fault, Inputs, State
from tests.safety.small_arm import SmallArm

STOP = Fault("person_stop", "", "stopped from the page by a person")


def asks(arm: SmallArm, no_program: str | None = "", **said: object) -> tuple[State, tuple[str, ...]]:
    """A program's request; None: the driver has verified nothing."""
    said |= {} if no_program is None else {"no_program": no_program}
    return arm.step(word=ArmingRequest(arm.now + 10 * MS, "operator", True), **said)[1:]


def test_where_the_robot_is_emulated_it_arms_once() -> None:
    arm = SmallArm()
    assert asks(arm) == (State.ARMED, ())
    arm.step(word=ArmingRequest(arm.now + 10 * MS, "a person", False))  # whoever disarms
    assert arm.core.state is State.DISARMED
    assert asks(arm) == (State.DISARMED, ("arming_program",))
    assert arm.arm()[1:] == (State.ARMED, ())


@pytest.mark.parametrize("no_program", ["served by pid 5", None])
def test_any_other_robot_is_for_a_person_to_arm(no_program: str | None) -> None:
    arm = SmallArm()
    assert asks(arm, no_program) == (State.DISARMED, ("arming_program",))
    assert arm.core.faults[0].joint == ""
    detail = arm.core.faults[0].detail
    assert detail.startswith("operator is a program")
    assert (no_program or Inputs.no_program) in detail
    assert "paramove arm enable" in detail
    assert arm.arm(no_program=no_program or "")[1:] == (State.ARMED, ())


def test_a_refusal_alone_keeps_no_program_from_asking_again() -> None:
    arm = SmallArm()
    voltage = Fault("voltage", "", "9.1 V")
    assert asks(arm, arming_faults=(voltage,)) == (State.DISARMED, ("voltage",))
    assert asks(arm) == (State.ARMED, ())


def stopped(arm: SmallArm) -> None:
    arm.step(stop=STOP)
    arm.step(word=ArmingRequest(arm.now + 10 * MS, "a person", False))


def stopped_while_the_robot_was_silent(arm: SmallArm) -> None:
    arm.step(ms=600, measured=None, stop=STOP)


def stopped_and_asked_in_one_step(arm: SmallArm) -> None:
    asks(arm, stop=STOP)
    for _ in range(60):
        arm.step()
    arm.step(word=ArmingRequest(arm.now + 10 * MS, "a person", False))


def pressed_and_released(arm: SmallArm) -> None:
    arm.step(emergency=True)
    arm.step(emergency=False)


def silent(arm: SmallArm) -> None:
    arm.step()
    arm.step(ms=600, measured=None)
    assert arm.core.state is State.DISCONNECTED


def time_went_back(arm: SmallArm) -> None:
    arm.step()
    arm.step(ms=-10)
    arm.step(word=ArmingRequest(arm.now + 10 * MS, "a person", False))


@pytest.mark.parametrize(
    "touch",
    [
        stopped,
        stopped_while_the_robot_was_silent,
        stopped_and_asked_in_one_step,
        pressed_and_released,
        silent,
        time_went_back,
    ],
)
def test_after_any_stop_or_fault_only_a_person_arms(touch) -> None:
    arm = SmallArm()
    touch(arm)
    arm.step()
    assert arm.core.state is State.DISARMED
    for _ in range(3):
        state, faults = asks(arm)
        assert state is State.DISARMED
        assert "arming_program" in faults
    assert "armed, stopped or at fault before" in arm.core.faults[-1].detail
    assert arm.arm()[1:] == (State.ARMED, ())
