"""Control tables of the servo models: address, initial value and allowed range of each number.

Addresses and sizes are those of the tables that come with dynamixel-sdk, but for `NOT_OF_THE_SDK`. Initial values,
ranges and speeds are from the ROBOTIS e-Manual, pages "XM430-W350", "XM430-W210", "XL430-W250", "XL330-M288-T" and
"XL330-M077-T"; speeds, torques and currents are those of their tables "Specifications" at the recommended voltage.
Where an XL330 has its indirect data goes by its firmware, as in the SDK's `xl330_*.model` and `xl330_*_fw52.model`.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from dynamixel_easy_sdk.control_table import ControlTable

from paramove.documents import InputError

RAM_BEGINS = 64
"""Addresses below are stored without power, and locked while torque is on."""
FIRST_INDIRECT = 168
"""From here on addresses and data of the indirect access; data below are registers."""
PULSES_PER_TURN = 4096
ANY = (None, None)

Range = tuple[int | None, int | None]


@dataclass(frozen=True)
class Register:
    """One number of a control table.

    Attributes:
        name: As in the manual.
        address, size: Bytes.
        initial: After a factory reset, or in RAM after a reboot.
        allowed: Minimum and maximum value that may be written; None where it is not writable at all.
    """

    name: str
    address: int
    size: int
    initial: int = 0
    allowed: Range | None = None

    @property
    def signed(self) -> bool:
        """Whether its bytes may stand for a negative number."""
        return self.name in SIGNED

    @property
    def writable(self) -> bool:
        """Whether it can be written."""
        return self.allowed is not None


@dataclass(frozen=True)
class IndirectBlock:
    """Addresses of two bytes each at which is written what the data behind them, one byte each, stand for."""

    addresses: int
    data: int
    count: int


@dataclass(frozen=True)
class ServoModel:
    """What all servos of a model have in common.

    Attributes:
        name: As in the SDK's file of the model. number: Model Number (0).
        registers: By name.
        modes: Values that Operating Mode (11) may take.
        top_speed: Without load at the recommended voltage, rev/min.
        voltage: Recommended, V.
        stall_torque: Held still with full power at the recommended voltage, N m; so many `stall_amperes` then flow.
        current_unit: Amperes of one unit of current; None for a model that reports load in 0.1 % of the stall torque.
        firmware: Version that an emulated servo reports. Of an XL330 at most 52: above, ROBOTIS's tables contradict
            each other. Bus watchdog and clear need 42 or above; fast reads, backup, Startup Configuration and torque
            on by goal need 45, and 46 in an XL330.
    """

    name: str
    number: int
    modes: frozenset[int]
    top_speed: float
    voltage: float
    stall_torque: float
    stall_amperes: float
    current_unit: float | None
    registers: Mapping[str, Register] = field(repr=False)
    firmware: int = 46

    @property
    def indirect(self) -> tuple[IndirectBlock, ...]:
        """Where a part of the table may be gathered."""
        if self.number not in XL330_NUMBERS:
            return X_BLOCKS
        return XL330_BLOCKS if self.firmware >= XL330_MOVED else XL330_BLOCKS_BEFORE

    @property
    def size(self) -> int:
        """Bytes of the table."""
        last = max(block.data + block.count for block in self.indirect)
        return max(last, *(one.address + one.size for one in self.registers.values()))


GAIN = (0, 16383)
SIGNED = frozenset(
    {
        "Homing Offset", "Goal PWM", "Goal Current", "Goal Velocity", "Goal Position", "Present PWM", "Present Current",
        "Present Load", "Present Velocity", "Present Position", "Velocity Trajectory", "Position Trajectory",
    }
)  # fmt: skip
WRITABLE: dict[str, tuple[int, Range]] = {
    "ID": (1, (0, 252)),
    "Baud Rate": (1, (0, 7)),
    "Return Delay Time": (250, (0, 254)),
    "Drive Mode": (0, (0, 13)),
    "Operating Mode": (3, (0, 16)),
    "Secondary(Shadow) ID": (255, (0, 255)),
    "Protocol Type": (2, (2, 2)),
    "Homing Offset": (0, (-1044479, 1044479)),
    "Moving Threshold": (10, (0, 1023)),
    "Temperature Limit": (80, (0, 100)),
    "Max Voltage Limit": (160, (95, 160)),
    "Min Voltage Limit": (95, (95, 160)),
    "PWM Limit": (885, (0, 885)),
    "Current Limit": (1193, (0, 1193)),
    "Velocity Limit": (200, (0, 1023)),
    "Max Position Limit": (4095, (0, 4095)),
    "Min Position Limit": (0, (0, 4095)),
    "Startup Configuration": (0, (0, 3)),
    "PWM Slope": (140, (1, 255)),
    "Shutdown": (52, (0, 255)),
    "Torque Enable": (0, (0, 1)),
    "LED": (0, (0, 1)),
    "Status Return Level": (2, (0, 2)),
    "Velocity I Gain": (1920, GAIN),
    "Velocity P Gain": (100, GAIN),
    "Position D Gain": (0, GAIN),
    "Position I Gain": (0, GAIN),
    "Position P Gain": (800, GAIN),
    "Feedforward 2nd Gain": (0, GAIN),
    "Feedforward 1st Gain": (0, GAIN),
    "Bus Watchdog": (0, (0, 127)),
    "Goal PWM": (885, ANY),
    "Goal Current": (0, ANY),
    "Goal Velocity": (0, ANY),
    "Profile Acceleration": (0, (0, 32767)),
    "Profile Velocity": (0, (0, 32767)),
    "Goal Position": (0, ANY),
}
"""Initial value and range of what can be written, for XM430-W350; goals are limited by other registers."""

NOT_OF_THE_SDK = {"Startup Configuration": (60, 1), "Backup Ready": (147, 1)}
"""Address and size of what the SDK's tables leave out, as in the e-Manual."""

ALL_MODES = frozenset({0, 1, 3, 4, 5, 16})
X_BLOCKS = (IndirectBlock(168, 224, 28), IndirectBlock(578, 634, 28))
XL330_NUMBERS = (1190, 1200)
XL330_MOVED = 52
"""Firmware from which on the indirect data of an XL330 are at 208 and no longer at 224."""
XL330_BLOCKS, XL330_BLOCKS_BEFORE = (IndirectBlock(168, 208, 20),), (IndirectBlock(168, 224, 28),)


def _registers(number: int, **others: tuple[int, Range]) -> dict[str, Register]:
    """Of the SDK's table, with names of `others` written with underscores for spaces."""
    special = {name.replace("_", " "): value for name, value in others.items()}
    items = {name: (item.address, item.size) for name, item in ControlTable.getControlTable(number).items()}
    registers = {"Model Number": Register("Model Number", 0, 2, number)}
    for name, (address, size) in (items | NOT_OF_THE_SDK).items():
        if name not in registers and not name.startswith("Indirect"):
            initial, allowed = special.get(name, WRITABLE.get(name, (0, None)))
            registers[name] = Register(name, address, size, initial, allowed)
    return registers


XM430_W350 = ServoModel(
    "xm430_w350", 1020, ALL_MODES, 46.0, 12.0, 4.1, 2.3, 0.00269, _registers(1020)
)  # fmt: skip
XM430_W210 = ServoModel(
    "xm430_w210", 1030, ALL_MODES, 77.0, 12.0, 3.0, 2.3, 0.00269,
    _registers(1030, Velocity_Limit=(330, (0, 1023))),
)  # fmt: skip
XL430_W250 = ServoModel(
    "xl430_w250", 1060, ALL_MODES - {0, 5}, 57.0, 11.1, 1.4, 1.3, None,
    _registers(
        1060, Temperature_Limit=(72, (0, 100)), Max_Voltage_Limit=(140, (60, 140)), Min_Voltage_Limit=(60, (60, 140)),
        Velocity_Limit=(265, (0, 1023)), Velocity_I_Gain=(1000, GAIN), Position_D_Gain=(4000, GAIN),
        Position_P_Gain=(640, GAIN),
    ),
)  # fmt: skip
XL330: dict[str, tuple[int, Range]] = {
    "Baud Rate": (1, (0, 6)), "Temperature Limit": (70, (0, 100)),
    "Max Voltage Limit": (70, (31, 70)), "Min Voltage Limit": (35, (31, 70)), "Current Limit": (1750, (0, 1750)),
    "Shutdown": (53, (0, 255)), "Position P Gain": (400, GAIN),
}  # fmt: skip
XL330_M288 = ServoModel(
    "xl330_m288", 1200, ALL_MODES, 103.0, 5.0, 0.52, 1.47, 0.001,
    _registers(
        1200, **XL330, Velocity_Limit=(445, (0, 2047)), Velocity_I_Gain=(1600, GAIN), Velocity_P_Gain=(180, GAIN),
    ),
)  # fmt: skip
XL330_M077 = ServoModel(
    "xl330_m077", 1190, ALL_MODES, 383.0, 5.0, 0.215, 1.47, 0.001,
    _registers(
        1190, **XL330, Velocity_Limit=(1620, (0, 2047)), Velocity_I_Gain=(400, GAIN), Velocity_P_Gain=(40, GAIN),
        Position_I_Gain=(400, GAIN),
    ),
)  # fmt: skip
MODELS = {model.name: model for model in (XM430_W350, XM430_W210, XL430_W250, XL330_M288, XL330_M077)}

BAUD_RATES = (9600, 57600, 115200, 1_000_000, 2_000_000, 3_000_000, 4_000_000, 4_500_000)
"""By the value of Baud Rate (8)."""


def model_named(name: str) -> ServoModel:
    """Raises InputError for a model without a table here."""
    if name not in MODELS:
        raise InputError(f"servo model {name!r} is not known; known models: {', '.join(sorted(MODELS))}")
    return MODELS[name]


CURRENT_UNIT_MA = {"xm430_w350": 2.69, "xm430_w210": 2.69, "xl330_m288": 1.0, "xl330_m077": 1.0}
"""mA of one unit of Goal Current (102) (e-Manual, "Goal Current"); XL430 has none."""
