"""Who is on a bus and how it is: servos of any ID, at any baud rate. They are only asked: nothing is written.

Two servos of one ID talk at the same time, so what comes is damaged or no packet at all. Such IDs are found by asking
one after the other.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cache

from dynamixel_easy_sdk.control_table import ControlTable
from dynamixel_easy_sdk.dynamixel_error import DxlRuntimeError

from paramove.documents import InputError
from paramove.robots.dynamixel.bus.servo_chain import PingedServo, ServoChain
from paramove.robots.dynamixel.bus.servo_models import MODELS, Register, ServoModel
from paramove.robots.dynamixel.bus.servo_port import PortLostError

USUAL_BAUD_RATES = (57_600, 1_000_000, 115_200, 2_000_000, 3_000_000, 4_000_000)
"""bit/s; the first is set at the factory."""
ALL_IDS = range(253)
NOBODYS_ID = 253
"""An ID that no servo can have (ROBOTIS e-Manual, "Protocol 2.0", Packet ID)."""
READS = 3
"""Of each servo: answers of two with one ID differ, so that sooner or later they are damaged."""
SHORT_LATENCY_S = 0.02
"""For IDs that most likely nobody has; an adapter's latency timer is 16 ms at most."""
LOOKED_AT = (
    "Torque Enable", "Hardware Error Status", "Present Input Voltage", "Present Temperature", "Temperature Limit",
    "Min Voltage Limit", "Max Voltage Limit",
)  # fmt: skip


@dataclass(frozen=True)
class FoundServo:
    """What a servo, or several with the same ID, told.

    Attributes:
        number: ID.
        model: Name of its kind as in dynamixel-sdk, "" if that does not know it.
        model_number, firmware: As it says; 0 if nothing that it said was understood.
        baud_rate: At which it answers, bit/s.
        at_once: How many answers to one ping were understood.
        failed: How many of the `READS` were not answered, or with damage.
        garbled: Whether nothing but damage came, to all reads or to all pings.
        values: Those of `LOOKED_AT` that its model has and that could be read.
    """

    number: int
    model: str
    model_number: int
    firmware: int
    baud_rate: int
    at_once: int = 1
    failed: int = 0
    garbled: bool = False
    values: Mapping[str, int] = field(default_factory=dict)

    @property
    def name(self) -> str:
        """Of its model, for people."""
        return self.model or (f"model {self.model_number}" if self.model_number else "unknown model")

    @property
    def table(self) -> ServoModel | None:
        """All of its registers, if they are known here."""
        return MODELS.get(self.model)

    @property
    def voltage(self) -> float | None:
        """Its supply, V."""
        tenths = self.values.get("Present Input Voltage")
        return None if tenths is None else tenths / 10

    @property
    def temperature(self) -> int | None:
        """Degrees Celsius."""
        return self.values.get("Present Temperature")

    @property
    def hardware_error(self) -> int | None:
        """Hardware Error Status (70); see `hardware_error`."""
        return self.values.get("Hardware Error Status")

    @property
    def torque(self) -> bool | None:
        """Whether its torque is on."""
        state = self.values.get("Torque Enable")
        return None if state is None else bool(state)

    @property
    def is_shared(self) -> bool:
        """Whether two servos, or more, most likely have this ID."""
        return self.garbled or self.at_once > 1

    @property
    def fault(self) -> str:
        """What is wrong with its answers, as a sentence without the subject; "" if nothing is."""
        if self.at_once > 1:
            return f"answers {self.at_once} times to one question: {self.at_once} servos have this ID"
        if self.garbled:
            return "answers with damaged bytes: probably two servos have this ID; else a cable is bad"
        if self.failed:
            told = f"failed in {self.failed} of {READS} reads: another servo with this ID, or a bad cable"
            return told + (", or Status Return Level (68) is 0" if self.failed == READS else "")
        return ""

    @property
    def remedy(self) -> str:
        """For the fault."""
        if self.is_shared:
            return "connect one of them alone and give it another ID with `paramove arm setup`"
        return "connect it alone and look again, then with another cable"


@dataclass(frozen=True)
class BusScan:
    """What a scan has found.

    Attributes:
        servos: In the order of the baud rates, by ID.
        asked: Baud rates at which was asked; without those that the adapter does not have.
        damaged: Of these, those with damaged answers to the question to all.
        foreign: Of these, those at which something came in, but nothing of a servo.
    """

    servos: list[FoundServo] = field(default_factory=list)
    asked: list[int] = field(default_factory=list)
    damaged: list[int] = field(default_factory=list)
    foreign: list[int] = field(default_factory=list)

    @property
    def faults(self) -> list[str]:
        """What is wrong with the bus as a whole, in sentences."""
        told = []
        if self.damaged:
            shown = listed(self.damaged)
            told.append(f"answers at {shown} bit/s are damaged: several servos have the same ID, or a bad cable")
        if self.foreign:
            shown = listed(self.foreign)
            told.append(f"what comes in at {shown} bit/s is no answer of a servo: another device, or a bad cable")
        return told

    def findings(self, baud_rate: int = 0) -> list[str]:
        """Sentences about all that is not as it should be. `baud_rate`: that is configured, 0 if none is."""
        told = self.faults
        for rate, count in Counter(one.baud_rate for one in self.servos).items():
            if baud_rate not in (0, rate):
                told.append(f"found {count} servo{'s' * (count != 1)} at {rate}, configured {baud_rate}")
        faulty = (one for one in self.servos if one.fault)
        return told + [f"ID {one.number} at {one.baud_rate} {one.fault}; {one.remedy}" for one in faulty]


def listed(rates: Sequence[int]) -> str:
    """For a sentence."""
    return ", ".join(map(str, rates))


def model_name(number: int) -> str:
    """Of the SDK's list, "" for a model that is not in it."""
    try:
        return str(ControlTable.getModelName(number)).removesuffix(".model")
    except DxlRuntimeError:
        return ""


def scan_bus(chain: ServoChain, baud_rates: Sequence[int] = USUAL_BAUD_RATES, ids: Sequence[int] = ALL_IDS) -> BusScan:
    """Ask all servos at each of these baud rates, and where something is not understood these IDs one by one.

    The port is left at the baud rate that it had. Raises PortLostError, and InputError for a rate that no servo has.
    """
    before, scan = chain.port.baud_rate, BusScan()
    try:
        for rate in baud_rates:
            try:
                chain.port.setBaudRate(rate)
            except (InputError, PortLostError):
                raise
            except (ValueError, OSError):  # pyserial has both for a rate that an adapter does not have
                continue
            scan.asked.append(rate)
            _ask_all(chain, ids, scan)
    finally:
        chain.port.setBaudRate(before)
    return scan


def _ask_all(chain: ServoChain, ids: Sequence[int], scan: BusScan) -> None:
    """At the port's baud rate."""
    before = replace(chain.counts)
    pinged = chain.ping_all()
    is_noisy, is_damaged = chain.counts.noise > before.noise, chain.counts.damaged > before.damaged
    at_once = Counter(one.number for one in pinged)
    answering = {one.number: one for one in pinged}.values()
    servos = [replace(looked_at(chain, one), at_once=at_once[one.number]) for one in answering]
    if is_noisy:
        servos += _one_by_one(chain, [number for number in ids if number not in at_once])
    scan.servos.extend(sorted(servos, key=lambda one: one.number))
    if is_damaged:
        scan.damaged.append(chain.port.baud_rate)
    elif is_noisy and not servos:
        scan.foreign.append(chain.port.baud_rate)


def _one_by_one(chain: ServoChain, ids: Sequence[int]) -> Iterator[FoundServo]:
    """Servos of these IDs, until what is not understood comes from somebody who was not asked."""
    for number in ids:
        servo = _asked(chain, number)
        if servo is not None and servo.garbled and _asked(chain, NOBODYS_ID) is not None:
            return
        if servo is not None:
            yield servo


def _asked(chain: ServoChain, number: int) -> FoundServo | None:
    """None if there is silence."""
    for _ in range(READS):
        before = _not_understood(chain)
        pinged = _pinged_in_vain(chain, number)
        if pinged is not None:
            return looked_at(chain, pinged)
        if _not_understood(chain) == before:
            return None
    return FoundServo(number, "", 0, 0, chain.port.baud_rate, garbled=True)


def _not_understood(chain: ServoChain) -> int:
    return chain.counts.noise + chain.counts.stray


def _pinged_in_vain(chain: ServoChain, number: int) -> PingedServo | None:
    """Most likely, and so with short timeouts."""
    latency_s, chain.port.latency_s = chain.port.latency_s, min(chain.port.latency_s, SHORT_LATENCY_S)
    try:
        return chain.ping(number, patient=False)
    finally:
        chain.port.latency_s = latency_s


def looked_at(chain: ServoChain, pinged: PingedServo) -> FoundServo:
    """A servo that answered to a ping, with what its registers say. Raises PortLostError."""
    registers, before = _registers(pinged.model_number), _not_understood(chain)
    values, failed = dict[str, int](), 0
    for _ in range(READS if registers else 0):
        damaged = chain.counts.damaged
        answer = chain.read_once([pinged.number], registers).get(pinged.number)
        failed += answer is None or chain.counts.damaged > damaged
        values = values if answer is None else answer.values
    return FoundServo(
        pinged.number, model_name(pinged.model_number), pinged.model_number, pinged.firmware, chain.port.baud_rate,
        failed=failed, garbled=failed == READS and not values and _not_understood(chain) > before, values=values,
    )  # fmt: skip


@cache
def _registers(model_number: int) -> tuple[Register, ...]:
    """Of a model in the SDK's list, which is longer than ours; none for another."""
    try:
        table = ControlTable.getControlTable(model_number)
    except DxlRuntimeError:
        return ()
    return tuple(Register(name, table[name].address, table[name].size) for name in LOOKED_AT if name in table)
