"""The emulator's control tables equal the driver's, which are from the SDK."""

import pytest

from dynamixel_emulator.arms import ARMS
from dynamixel_emulator.models import BAUD_RATES, MODELS
from paramove.robots.dynamixel.bus import servo_models as driver
from tests.robots.servo_arms import ARMS as DESCRIBED

ONLY_IN_THE_EMULATOR = {"Backup Ready"}


def test_both_know_the_same_models_and_baud_rates() -> None:
    assert MODELS.keys() == driver.MODELS.keys()
    assert BAUD_RATES == driver.BAUD_RATES


@pytest.mark.parametrize("name", MODELS)
def test_registers_and_facts_of_a_model_are_the_same(name: str) -> None:
    ours, theirs = MODELS[name], driver.MODELS[name]
    registers = {one.name: (one.address, one.size, one.signed) for one in ours.registers.values()}
    known = {one.name: (one.address, one.size, one.signed) for one in theirs.registers.values()}
    assert {name: row for name, row in registers.items() if name not in ONLY_IN_THE_EMULATOR} == known
    facts = ("number", "modes", "top_speed", "voltage", "stall_torque", "stall_amperes", "current_unit")
    assert {fact: getattr(ours, fact) for fact in facts} == {fact: getattr(theirs, fact) for fact in facts}
    limits = tuple(0.1 * ours.registers[f"{end} Voltage Limit"].initial for end in ("Min", "Max"))
    assert limits == pytest.approx(theirs.voltage_limits)
    allowed = ours.registers["Baud Rate"].allowed
    assert allowed == (0, len(theirs.baud_rates) - 1)
    assert ours.registers["ID"].allowed == (0, driver.MAX_ID)


@pytest.mark.parametrize("robot", DESCRIBED, ids=lambda robot: robot.name)
def test_an_arm_by_name_is_the_one_that_its_robot_description_has(robot) -> None:
    (chain,) = (one for name, one in ARMS.items() if robot.name.startswith(name))
    assert chain.servos == tuple(zip(robot.motors, robot.servo_ids, robot.joint_names, strict=True))
    assert chain.baud_rate == robot.bus.baud_rate
    joints = [(one.name, one.zero_counts) for one in chain.joints()]
    assert joints == list(zip(robot.joint_names, robot.units.zero_counts, strict=True))
    assert [abs(one.counts_per_rad) for one in chain.joints()] == pytest.approx(abs(robot.units.counts_per_rad))
