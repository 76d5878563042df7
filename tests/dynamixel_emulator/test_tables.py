"""The emulator's control tables equal the driver's, which are from the SDK."""

import pytest

from dynamixel_emulator.models import BAUD_RATES, MODELS
from paramove.robots.dynamixel.bus import servo_models as driver

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
