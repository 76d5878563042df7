"""Control tables of the servo models: address, initial value and allowed range of each register.

Addresses and sizes are from the tables in dynamixel-sdk, and from the e-Manual where these lack a register.
Initial values, ranges and speeds are from the ROBOTIS e-Manual, pages "XM430-W350", "XM430-W210", "XL430-W250",
"XL330-M288-T" and "XL330-M077-T"; speeds, torques and currents are from their tables "Specifications" at the
recommended voltage. The address of an XL330's indirect data depends on its firmware, as in the SDK's `xl330_*.model`
and `xl330_*_fw52.model`.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from dynamixel_emulator.errors import EmulatorError

RAM_START = 64
"""First address of the RAM area. Registers below (EEPROM) are non-volatile, and locked while torque is on."""
FIRST_INDIRECT = 168
"""First indirect address; ordinary registers are below."""
PULSES_PER_TURN = 4096
ANY = (None, None)

Range = tuple[int | None, int | None]


def within(value: int, allowed: Range) -> bool:
    """Whether a value is in a range."""
    low, high = allowed
    return (low is None or value >= low) and (high is None or value <= high)


@dataclass(frozen=True)
class Register:
    """One register of a control table.

    Attributes:
        name: Name in the manual.
        address, size: Bytes.
        initial: Value after a factory reset, or in RAM after a reboot.
        allowed: Minimum and maximum value that may be written; None if the register is read-only.
    """

    name: str
    address: int
    size: int
    initial: int = 0
    allowed: Range | None = None

    @property
    def signed(self) -> bool:
        """Whether its value is a signed integer."""
        return self.name in SIGNED

    @property
    def writable(self) -> bool:
        """Whether it can be written."""
        return self.allowed is not None


@dataclass(frozen=True)
class IndirectBlock:
    """A table of indirect addresses, two bytes each, and the indirect data that they map, one byte each."""

    addresses: int
    data: int
    count: int


@dataclass(frozen=True)
class ServoModel:
    """Properties of a servo model.

    Attributes:
        name: Name of the model's file in the SDK.
        number: Model Number (0).
        registers: Registers by name.
        modes: Valid values of Operating Mode (11).
        top_speed: No-load speed at the recommended voltage, rev/min.
        voltage: Recommended voltage, V.
        stall_torque: Stall torque at the recommended voltage, N m.
        stall_amperes: Stall current at the recommended voltage, A.
        current_unit: Unit of the current registers, A; None for a model that reports load in 0.1 % of the stall torque.
        firmware: Firmware version that an emulated servo reports. At most 52 for an XL330: above, ROBOTIS's tables
            contradict each other. Bus watchdog and clear need 42 or above; fast reads, backup, Startup Configuration
            and torque on by goal need 45, and 46 in an XL330.
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
        """Its blocks of indirect addresses and data."""
        if self.number not in XL330_NUMBERS:
            return X_BLOCKS
        return XL330_BLOCKS if self.firmware >= XL330_NEW_TABLE else XL330_OLD_BLOCKS

    @property
    def size(self) -> int:
        """Size of the table, bytes."""
        last = max(block.data + block.count for block in self.indirect)
        return max(last, *(one.address + one.size for one in self.registers.values()))


GAIN = (0, 16383)
SIGNED = frozenset(
    {
        "Homing Offset", "Goal PWM", "Goal Current", "Goal Velocity", "Goal Position", "Present PWM", "Present Current",
        "Present Load", "Present Velocity", "Present Position", "Velocity Trajectory", "Position Trajectory",
    }
)  # fmt: skip
REGISTERS: dict[str, tuple[int, int] | tuple[int, int, int, Range]] = {
    "Model Number": (0, 2),
    "Model Information": (2, 4),
    "Firmware Version": (6, 1),
    "ID": (7, 1, 1, (0, 252)),
    "Baud Rate": (8, 1, 1, (0, 7)),
    "Return Delay Time": (9, 1, 250, (0, 254)),
    "Drive Mode": (10, 1, 0, (0, 13)),
    "Operating Mode": (11, 1, 3, (0, 16)),
    "Secondary(Shadow) ID": (12, 1, 255, (0, 255)),
    "Protocol Type": (13, 1, 2, (2, 2)),
    "Homing Offset": (20, 4, 0, (-1044479, 1044479)),
    "Moving Threshold": (24, 4, 10, (0, 1023)),
    "Temperature Limit": (31, 1, 80, (0, 100)),
    "Max Voltage Limit": (32, 2, 160, (95, 160)),
    "Min Voltage Limit": (34, 2, 95, (95, 160)),
    "PWM Limit": (36, 2, 885, (0, 885)),
    "Current Limit": (38, 2, 1193, (0, 1193)),
    "Velocity Limit": (44, 4, 200, (0, 1023)),
    "Max Position Limit": (48, 4, 4095, (0, 4095)),
    "Min Position Limit": (52, 4, 0, (0, 4095)),
    "Startup Configuration": (60, 1, 0, (0, 3)),
    "PWM Slope": (62, 1, 140, (1, 255)),
    "Shutdown": (63, 1, 52, (0, 255)),
    "Torque Enable": (64, 1, 0, (0, 1)),
    "LED": (65, 1, 0, (0, 1)),
    "Status Return Level": (68, 1, 2, (0, 2)),
    "Registered Instruction": (69, 1),
    "Hardware Error Status": (70, 1),
    "Velocity I Gain": (76, 2, 1920, GAIN),
    "Velocity P Gain": (78, 2, 100, GAIN),
    "Position D Gain": (80, 2, 0, GAIN),
    "Position I Gain": (82, 2, 0, GAIN),
    "Position P Gain": (84, 2, 800, GAIN),
    "Feedforward 2nd Gain": (88, 2, 0, GAIN),
    "Feedforward 1st Gain": (90, 2, 0, GAIN),
    "Bus Watchdog": (98, 1, 0, (0, 127)),
    "Goal PWM": (100, 2, 885, ANY),
    "Goal Current": (102, 2, 0, ANY),
    "Goal Velocity": (104, 4, 0, ANY),
    "Profile Acceleration": (108, 4, 0, (0, 32767)),
    "Profile Velocity": (112, 4, 0, (0, 32767)),
    "Goal Position": (116, 4, 0, ANY),
    "Realtime Tick": (120, 2),
    "Moving": (122, 1),
    "Moving Status": (123, 1),
    "Present PWM": (124, 2),
    "Present Current": (126, 2),
    "Present Load": (126, 2),
    "Present Velocity": (128, 4),
    "Present Position": (132, 4),
    "Velocity Trajectory": (136, 4),
    "Position Trajectory": (140, 4),
    "Present Input Voltage": (144, 2),
    "Present Temperature": (146, 1),
    "Backup Ready": (147, 1),
}
"""Address and size; for writable registers also initial value and range of XM430-W350. Other registers limit goals."""
ONLY_XL330, ONLY_XL430 = {"PWM Slope"}, {"Present Load"}
NOT_XL430 = {"Current Limit", "Goal Current", "Present Current"}

ALL_MODES = frozenset({0, 1, 3, 4, 5, 16})
X_BLOCKS = (IndirectBlock(168, 224, 28), IndirectBlock(578, 634, 28))
XL330_NUMBERS = (1190, 1200)
XL330_NEW_TABLE = 52
"""First firmware with the indirect data of an XL330 at 208 instead of 224."""
XL330_BLOCKS, XL330_OLD_BLOCKS = (IndirectBlock(168, 208, 20),), (IndirectBlock(168, 224, 28),)


def _registers(number: int, without: set[str], **overrides: tuple[int, Range]) -> dict[str, Register]:
    """The table of a model; names in `overrides` have underscores instead of spaces."""
    changed = {name.replace("_", " "): value for name, value in overrides.items()}
    registers = {}
    for name, row in REGISTERS.items():
        if name not in without:
            values = changed.get(name, (row[2], row[3]) if len(row) == 4 else (0, None))
            registers[name] = Register(name, row[0], row[1], *values)
    registers["Model Number"] = Register("Model Number", 0, 2, number)
    return registers


XM430_W350 = ServoModel(
    "xm430_w350", 1020, ALL_MODES, 46.0, 12.0, 4.1, 2.3, 0.00269, _registers(1020, ONLY_XL330 | ONLY_XL430)
)  # fmt: skip
XM430_W210 = ServoModel(
    "xm430_w210", 1030, ALL_MODES, 77.0, 12.0, 3.0, 2.3, 0.00269,
    _registers(1030, ONLY_XL330 | ONLY_XL430, Velocity_Limit=(330, (0, 1023))),
)  # fmt: skip
XL430_W250 = ServoModel(
    "xl430_w250", 1060, ALL_MODES - {0, 5}, 57.0, 11.1, 1.4, 1.3, None,
    _registers(
        1060, ONLY_XL330 | NOT_XL430, Temperature_Limit=(72, (0, 100)),
        Max_Voltage_Limit=(140, (60, 140)), Min_Voltage_Limit=(60, (60, 140)),
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
        1200, ONLY_XL430, **XL330, Velocity_Limit=(445, (0, 2047)),
        Velocity_I_Gain=(1600, GAIN), Velocity_P_Gain=(180, GAIN),
    ),
)  # fmt: skip
XL330_M077 = ServoModel(
    "xl330_m077", 1190, ALL_MODES, 383.0, 5.0, 0.215, 1.47, 0.001,
    _registers(
        1190, ONLY_XL430, **XL330, Velocity_Limit=(1620, (0, 2047)),
        Velocity_I_Gain=(400, GAIN), Velocity_P_Gain=(40, GAIN),
        Position_I_Gain=(400, GAIN),
    ),
)  # fmt: skip
MODELS = {model.name: model for model in (XM430_W350, XM430_W210, XL430_W250, XL330_M288, XL330_M077)}

BAUD_RATES = (9600, 57600, 115200, 1_000_000, 2_000_000, 3_000_000, 4_000_000, 4_500_000)
"""bit/s, indexed by the value of Baud Rate (8)."""


def model_named(name: str) -> ServoModel:
    """The model of this name. Raises EmulatorError for an unknown one."""
    if name not in MODELS:
        raise EmulatorError(f"servo model {name!r} is not known; known models: {', '.join(sorted(MODELS))}")
    return MODELS[name]
