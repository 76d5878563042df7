"""Who is on a bus: all usual baud rates are asked, nothing is written."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from dynamixel_easy_sdk.control_table import ControlTable
from dynamixel_easy_sdk.dynamixel_error import DxlRuntimeError

from paramove.robots.dynamixel.servo_chain import PingedServo, ServoChain
from paramove.robots.dynamixel.servo_models import MODELS, ServoModel

USUAL_BAUD_RATES = (57600, 1_000_000, 115200, 2_000_000, 3_000_000, 4_000_000)
LOOKED_AT = ("Torque Enable", "Hardware Error Status", "Present Input Voltage", "Present Temperature")
ALL_IDS = range(253)
ASKED_TIMES = 3
SHORT_LATENCY_S = 0.02
"""An adapter's latency timer is 16 ms at most."""
BY_NUMBER = {model.number: model for model in MODELS.values()}


@dataclass(frozen=True)
class FoundServo:
    """A servo that answered.

    Attributes:
        number: Its ID.
        model: Name of its kind, "" if it is not known.
        voltage, temperature: V and degrees Celsius.
        hardware_error: Hardware Error Status (70); see `hardware_error`.
        torque: Whether its torque is on.

    What is read from its table is None if the table is not known or the servo did not answer.
    """

    number: int
    model: str
    model_number: int
    firmware: int
    baud_rate: int
    voltage: float | None = None
    temperature: int | None = None
    hardware_error: int | None = None
    torque: bool | None = None

    @property
    def is_mute(self) -> bool:
        """Whether its table is known, but could not be read."""
        return self.torque is None and model_of(self) is not None


@dataclass(frozen=True)
class BusScan:
    """What a scan has found.

    Attributes:
        servos: By baud rate and ID.
        shared_ids: Baud rates and IDs to which damaged answers come: two servos may talk at the same time.
        impossible: Baud rates that the adapter does not have.
    """

    servos: tuple[FoundServo, ...]
    shared_ids: tuple[tuple[int, int], ...] = ()
    impossible: tuple[int, ...] = ()

    def findings(self, baud_rate: int = 0) -> list[str]:
        """Sentences about what is not as it should be. `baud_rate`: that is configured, 0 if none is."""
        told = []
        for rate in sorted({one.baud_rate for one in self.servos} - {baud_rate}) if baud_rate else ():
            count = sum(one.baud_rate == rate for one in self.servos)
            told.append(f"found {count} servo{'s' * (count != 1)} at {rate}, configured {baud_rate}")
        for rate, number in self.shared_ids:
            told.append(
                f"ID {number} at {rate} answers with damaged bytes: probably two servos have this ID; connect one at a "
                "time and give it another with `paramove arm setup`; else check the cables"
            )
        return told


def model_name(number: int) -> str:
    """Of the SDK's list, "" for a model that is not in it."""
    try:
        return str(ControlTable.getModelName(number)).removesuffix(".model")
    except DxlRuntimeError:
        return ""


def model_of(servo: PingedServo | FoundServo) -> ServoModel | None:
    """Its table, if there is one here."""
    return BY_NUMBER.get(servo.model_number)


def scan_bus(chain: ServoChain, baud_rates: Sequence[int] = USUAL_BAUD_RATES, ids: Sequence[int] = ALL_IDS) -> BusScan:
    """Ask all servos at each of these baud rates, and where answers are damaged these IDs one by one.

    The port is left at the baud rate that it had. Raises PortLostError.
    """
    before = chain.port.baud_rate
    found: list[FoundServo] = []
    shared: list[tuple[int, int]] = []
    impossible: list[int] = []
    try:
        for rate in baud_rates:
            try:
                chain.port.setBaudRate(rate)
            except (ValueError, OSError):  # pyserial has both for a rate that an adapter does not have
                impossible.append(rate)
                continue
            for number, servo in _heard(chain, ids):
                if servo is None:
                    shared.append((rate, number))
                else:
                    found.append(servo)
    finally:
        chain.port.setBaudRate(before)
    return BusScan(tuple(found), tuple(shared), tuple(impossible))


def _heard(chain: ServoChain, ids: Sequence[int]) -> Iterator[tuple[int, FoundServo | None]]:
    """IDs at the port's baud rate with their servos, None where damaged answers come."""
    noise = chain.counts.noise
    pinged = {one.number: one for one in chain.ping_all()}
    asked = ids if chain.counts.noise > noise else sorted(pinged)
    for number in asked:
        noise, stray = chain.counts.noise, chain.counts.stray
        answer = pinged.get(number) or _asked_in_vain(chain, number)
        servo = looked_at(chain, answer) if answer else None
        if (servo is None or servo.is_mute) and (chain.counts.noise > noise or chain.counts.stray > stray):
            yield number, None
        elif servo is not None:
            yield number, servo


def _asked_in_vain(chain: ServoChain, number: int) -> PingedServo | None:
    """A ping of an ID that most likely nobody has, without much patience."""
    latency_s, chain.port.latency_s = chain.port.latency_s, min(chain.port.latency_s, SHORT_LATENCY_S)
    try:
        return chain.ping(number)
    finally:
        chain.port.latency_s = latency_s


def looked_at(chain: ServoChain, pinged: PingedServo) -> FoundServo:
    """A servo that answered to a ping, with what its table says."""
    model = model_of(pinged)
    rate = chain.port.baud_rate
    plain = FoundServo(pinged.number, model_name(pinged.model_number), pinged.model_number, pinged.firmware, rate)
    if model is None:
        return plain
    registers = [model.registers[name] for name in LOOKED_AT]
    for _ in range(ASKED_TIMES):
        answer = chain.sync_read([pinged.number], registers).get(pinged.number)
        if answer is not None:
            values = answer.values
            return FoundServo(
                plain.number, model.name, plain.model_number, plain.firmware, rate,
                0.1 * values["Present Input Voltage"], values["Present Temperature"], values["Hardware Error Status"],
                bool(values["Torque Enable"]),
            )  # fmt: skip
    return plain
