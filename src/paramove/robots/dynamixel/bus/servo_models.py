"""What the driver knows of servo models: addresses and sizes of their registers, and facts of their data sheets.

Registers are those of the tables that come with dynamixel-sdk, and one of the e-Manual. Facts are from the ROBOTIS
e-Manual, pages "XM430-W350", "XM430-W210", "XL430-W250", "XL330-M288-T" and "XL330-M077-T"; speeds, torques and
currents are those of their tables "Specifications" at the recommended voltage.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Final

from dynamixel_easy_sdk.control_table import ControlTable

from paramove.documents import InputError

PULSES_PER_TURN = 4096
MAX_ID = 252
BAUD_RATES = (9600, 57600, 115200, 1_000_000, 2_000_000, 3_000_000, 4_000_000, 4_500_000)
"""By the value of Baud Rate (8)."""
CURRENT_MODE: Final = 0
POSITION_MODE: Final = 3
EXTENDED_MODE: Final = 4
CURRENT_BASED_MODE: Final = 5
"""Values of Operating Mode (11). All but the first have a goal position; that of `POSITION_MODE` is limited to one turn
and the servo's own limits, `CURRENT_BASED_MODE` also limits the current."""
SIGNED = frozenset(
    {
        "Homing Offset", "Goal PWM", "Goal Current", "Goal Velocity", "Goal Position", "Present PWM", "Present Current",
        "Present Load", "Present Velocity", "Present Position", "Velocity Trajectory", "Position Trajectory",
    }
)  # fmt: skip


@dataclass(frozen=True)
class Register:
    """One number of a control table.

    Attributes:
        name: As in the manual.
        address, size: Bytes.
    """

    name: str
    address: int
    size: int

    @property
    def signed(self) -> bool:
        """Whether its bytes may stand for a negative number."""
        return self.name in SIGNED


@dataclass(frozen=True)
class ServoModel:
    """What all servos of a model have in common.

    Attributes:
        name: As in the SDK's file of the model. number: Model Number (0).
        modes: Values that Operating Mode (11) may take.
        top_speed: Without load at the recommended voltage, rev/min.
        voltage: Recommended, V.
        voltage_limits: Minimum and maximum that the factory allows, V.
        stall_torque: Held still with full power at the recommended voltage, N m; so many `stall_amperes` then flow.
        current_unit: Amperes of one unit of current (e-Manual, "Goal Current"); None for a model that has no current
            mode and reports load in 0.1 % of the stall torque.
        baud_rates: That it supports, bit/s.
        registers: By name.
    """

    name: str
    number: int
    modes: frozenset[int]
    top_speed: float
    voltage: float
    voltage_limits: tuple[float, float]
    stall_torque: float
    stall_amperes: float
    current_unit: float | None
    baud_rates: tuple[int, ...] = BAUD_RATES
    registers: Mapping[str, Register] = field(init=False, repr=False)

    def __post_init__(self) -> None:
        table = {"Startup Configuration": (60, 1)}  # the SDK's tables leave the latter out
        table |= {name: (item.address, item.size) for name, item in ControlTable.getControlTable(self.number).items()}
        registers = {name: Register(name, *bytes_) for name, bytes_ in table.items() if not name.startswith("Indirect")}
        object.__setattr__(self, "registers", registers)


ALL_MODES = frozenset({0, 1, 3, 4, 5, 16})
XM_LIMITS, XL430_LIMITS, XL330_LIMITS = (9.5, 16.0), (6.0, 14.0), (3.5, 7.0)
XM430_W350 = ServoModel("xm430_w350", 1020, ALL_MODES, 46.0, 12.0, XM_LIMITS, 4.1, 2.3, 0.00269)
XM430_W210 = ServoModel("xm430_w210", 1030, ALL_MODES, 77.0, 12.0, XM_LIMITS, 3.0, 2.3, 0.00269)
XL430_W250 = ServoModel("xl430_w250", 1060, ALL_MODES - {0, 5}, 57.0, 11.1, XL430_LIMITS, 1.4, 1.3, None)
XL330_M288 = ServoModel("xl330_m288", 1200, ALL_MODES, 103.0, 5.0, XL330_LIMITS, 0.52, 1.47, 0.001, BAUD_RATES[:7])
XL330_M077 = ServoModel("xl330_m077", 1190, ALL_MODES, 383.0, 5.0, XL330_LIMITS, 0.215, 1.47, 0.001, BAUD_RATES[:7])
MODELS = {model.name: model for model in (XM430_W350, XM430_W210, XL430_W250, XL330_M288, XL330_M077)}


def model_named(name: str) -> ServoModel:
    """Raises InputError for a model without a table here."""
    if name not in MODELS:
        raise InputError(f"servo model {name!r} is not known; known models: {', '.join(sorted(MODELS))}")
    return MODELS[name]


def difference(later: int, earlier: int) -> int:
    """Counts from one position to another by the shorter way, -2048 to 2047."""
    return (later - earlier + PULSES_PER_TURN // 2) % PULSES_PER_TURN - PULSES_PER_TURN // 2
