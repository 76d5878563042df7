"""The table of each emulated model equals ROBOTIS's table for the firmware that the servo reports.

Sources: `[file]` the `.model` files of ROBOTIS in dynamixel-sdk 4.1.0 (`dynamixel_easy_sdk/control_table`); the files
of its ROS 2 driver (dynamixel_hardware_interface, `param/dxl_model`) have the same values; `[page]` the tables
"Control Table of EEPROM Area" and "of RAM Area" of the model's page in the ROBOTIS e-Manual.
"""

from __future__ import annotations

import re
from dataclasses import replace
from importlib.resources import files

import pytest

from dynamixel_emulator.models import MODELS, ServoModel
from dynamixel_emulator.packets import Instruction
from dynamixel_emulator.servo import EmulatedServo

TABLES = files("dynamixel_easy_sdk") / "control_table"
NUMBERS = {"xm430_w350": 1020, "xm430_w210": 1030, "xl430_w250": 1060, "xl330_m077": 1190, "xl330_m288": 1200}  # [file]

# [page] Address, name, initial value and range of writable registers, for XM430-W350. Ranges that other registers
# define are omitted. Secondary ID: 253 to 255 disable it. Bus Watchdog: 0 disables it. Drive Mode: the three bits
# of its description. Protocol Type can be 1 on the page: emulated servos have only Protocol 2.0.
WRITABLE = """
7 ID 1 0 252; 8 Baud Rate 1 0 7; 9 Return Delay Time 250 0 254; 10 Drive Mode 0 0 13; 11 Operating Mode 3 0 16
12 Secondary(Shadow) ID 255 0 255; 13 Protocol Type 2 2 2; 20 Homing Offset 0 -1044479 1044479
24 Moving Threshold 10 0 1023; 31 Temperature Limit 80 0 100; 32 Max Voltage Limit 160 95 160
34 Min Voltage Limit 95 95 160; 36 PWM Limit 885 0 885; 38 Current Limit 1193 0 1193; 44 Velocity Limit 200 0 1023
48 Max Position Limit 4095 0 4095; 52 Min Position Limit 0 0 4095; 60 Startup Configuration 0 0 3; 63 Shutdown 52 0 255
64 Torque Enable 0 0 1; 65 LED 0 0 1; 68 Status Return Level 2 0 2; 76 Velocity I Gain 1920 0 16383
78 Velocity P Gain 100 0 16383; 80 Position D Gain 0 0 16383; 82 Position I Gain 0 0 16383
84 Position P Gain 800 0 16383; 88 Feedforward 2nd Gain 0 0 16383; 90 Feedforward 1st Gain 0 0 16383
98 Bus Watchdog 0 0 127; 108 Profile Acceleration 0 0 32767; 112 Profile Velocity 0 0 32767
"""
XL330 = """
8 Baud Rate 1 0 6; 31 Temperature Limit 70 0 100; 32 Max Voltage Limit 70 31 70; 34 Min Voltage Limit 35 31 70
38 Current Limit 1750 0 1750; 62 PWM Slope 140 1 255; 63 Shutdown 53 0 255; 84 Position P Gain 400 0 16383
"""
OTHERS = {
    "xm430_w210": "44 Velocity Limit 330 0 1023",
    "xl430_w250": """
        31 Temperature Limit 72 0 100; 32 Max Voltage Limit 140 60 140; 34 Min Voltage Limit 60 60 140
        44 Velocity Limit 265 0 1023; 76 Velocity I Gain 1000 0 16383; 80 Position D Gain 4000 0 16383
        84 Position P Gain 640 0 16383""",
    "xl330_m288": XL330
    + "44 Velocity Limit 445 0 2047; 76 Velocity I Gain 1600 0 16383; 78 Velocity P Gain 180 0 16383",
    "xl330_m077": XL330
    + """44 Velocity Limit 1620 0 2047; 76 Velocity I Gain 400 0 16383; 78 Velocity P Gain 40 0 16383
        82 Position I Gain 400 0 16383""",
}
GOALS = {"Goal PWM": 100, "Goal Current": 102, "Goal Velocity": 104, "Goal Position": 116}
MISSING = {"xl430_w250": {"Current Limit", "Goal Current"}}
NOT_IN_THE_FILES = {"Startup Configuration": (60, 1), "Backup Ready": (147, 1)}  # [page]
LAST_INDIRECT = {"xl330_m077": 227, "xl330_m288": 227}  # [page]; 661 for the others

each_model = pytest.mark.parametrize("model", [
    *MODELS.values(), *(replace(MODELS[name], firmware=52) for name in ("xl330_m288", "xl330_m077")),
], ids=lambda model: f"{model.name}-{model.firmware}")  # fmt: skip


def facts(text: str) -> dict[str, tuple[int, int, tuple[int, int]]]:
    """Address, initial value and range by register name."""
    registers = {}
    for line in re.split(r"[;\n]", text):
        if line.strip():
            address, *name, initial, low, high = line.split()
            registers[" ".join(name)] = (int(address), int(initial), (int(low), int(high)))
    return registers


def published(model: ServoModel) -> dict[str, tuple[int, int]]:
    """[file] Addresses and sizes by name, from the file that ROBOTIS's driver selects for this firmware."""
    versions = [52] if (TABLES / f"{model.name}_fw52.model").is_file() and model.firmware >= 52 else []
    assert model.firmware <= 52, "for newer firmware the driver selects the file without a version"
    file = TABLES / f"{model.name}{''.join(f'_fw{one}' for one in versions)}.model"
    _, _, table = file.read_text(encoding="utf-8").partition("[control table]\nAddress\tSize\tData Name\n")
    rows = [line.split("\t") for line in table.splitlines() if line.strip()]
    return {name.strip(): (int(address), int(size)) for address, size, name in rows}


@each_model
def test_addresses_and_sizes_are_those_of_the_file_of_this_firmware(model: ServoModel) -> None:
    assert model.number == NUMBERS[model.name]
    table = {name: row for name, row in published(model).items() if not name.startswith("Indirect")}
    assert {one.name: (one.address, one.size) for one in model.registers.values()} == table | NOT_IN_THE_FILES


@each_model
def test_initial_values_and_ranges_are_those_of_the_page(model: ServoModel) -> None:
    known = facts(WRITABLE) | facts(OTHERS.get(model.name, ""))
    missing = MISSING.get(model.name, set())
    writable = {one.name: one for one in model.registers.values() if one.writable}
    assert {name: (one.address, one.initial, one.allowed) for name, one in writable.items() if name not in GOALS} == {
        name: fact for name, fact in known.items() if name not in missing
    }
    assert {name: one.address for name, one in writable.items() if name in GOALS} == {
        name: address for name, address in GOALS.items() if name not in missing
    }


@each_model
def test_the_driver_of_robotis_reads_positions_through_the_indirect_data(model: ServoModel) -> None:
    """With the table of another firmware it reads 51.9 rad: the bytes of indirect addresses."""
    table, servo = published(model), EmulatedServo(model, position=1234.0)
    assert servo.memory["Firmware Version"] == model.firmware
    addresses, data = table["Indirect Address Read"][0], table["Indirect Data Read"][0]
    for i in range(4):
        parameters = (addresses + 2 * i).to_bytes(2, "little") + (132 + i).to_bytes(2, "little")
        assert servo.do(Instruction.WRITE, parameters).error == 0
    reply = servo.do(Instruction.READ, data.to_bytes(2, "little") + b"\4\0")
    assert int.from_bytes(reply.data, "little") == 1234


@each_model
def test_the_table_ends_with_the_last_indirect_data(model: ServoModel) -> None:
    first = published(model)["Indirect Data 1"][0]
    last = LAST_INDIRECT.get(model.name, 661) if first != 224 or model.number not in (1190, 1200) else 251
    assert model.indirect[0].addresses == 168
    assert model.indirect[0].data == first
    assert model.indirect[0].addresses + 2 * model.indirect[0].count == first
    assert model.size == last + 1
