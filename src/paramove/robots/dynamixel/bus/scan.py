"""The servos of a bus and their state, of any ID and at any baud rate. A scan only reads.

Two servos of one ID reply at the same time: the reply is damaged or no packet at all. Such IDs are detected by asking
one after the other.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cache

from dynamixel_easy_sdk.control_table import ControlTable
from dynamixel_easy_sdk.dynamixel_error import DxlRuntimeError
from dynamixel_sdk import COMM_SUCCESS
from dynamixel_sdk.protocol1_packet_handler import Protocol1PacketHandler

from paramove.documents import InputError
from paramove.robots.dynamixel.bus.servo_chain import PingedServo, ServoChain
from paramove.robots.dynamixel.bus.servo_models import MODELS, Register, ServoModel
from paramove.robots.dynamixel.bus.servo_port import PortLostError

USUAL_BAUD_RATES = (57_600, 1_000_000, 115_200, 2_000_000, 3_000_000, 4_000_000, 4_500_000, 9_600)
"""bit/s, all that a servo can have; the first is set at the factory, the last takes longest and is the rarest."""
ALL_IDS = range(253)
NOBODYS_ID = 253
"""An ID that no servo can have (ROBOTIS e-Manual, "Protocol 2.0", Packet ID)."""
OLDER_IDS = range(1, 7)
"""Asked in Protocol 1.0 if nothing replies in Protocol 2.0: 1 is set at the factory, and arms are numbered from it."""
READS = 3
"""Of each servo: replies of two with one ID differ, so that sooner or later they are damaged."""
SHORT_LATENCY_S = 0.02
"""For IDs that most likely no servo has; an adapter's latency timer is 16 ms at most."""
LOOKED_AT = (
    "Torque Enable", "Hardware Error Status", "Present Input Voltage", "Present Temperature", "Temperature Limit",
    "Min Voltage Limit", "Max Voltage Limit",
)  # fmt: skip


@dataclass(frozen=True)
class DetectedServo:
    """What a servo, or several with the same ID, reported.

    Attributes:
        number: ID.
        model: Name of its kind as in dynamixel-sdk, "" if that does not know it.
        model_number, firmware: As it reports them; 0 if no reply was understood.
        baud_rate: At which it replies, bit/s.
        at_once: How many replies to one ping were understood.
        failed: How many of the `READS` had no reply, or a damaged one.
        garbled: Whether all replies were damaged, to all reads or to all pings.
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
    def has_duplicate_id(self) -> bool:
        """Whether two servos, or more, most likely have this ID."""
        return self.garbled or self.at_once > 1

    @property
    def fault(self) -> str:
        """What is wrong with its replies, a clause without the subject; "" if nothing is."""
        if self.at_once > 1:
            return f"answers {self.at_once} times to one question: {self.at_once} servos have this ID"
        if self.garbled:
            return "answers with damaged bytes: probably two servos have this ID; else a cable is bad"
        if self.failed:
            detail = f"failed in {self.failed} of {READS} reads: another servo with this ID, or a bad cable"
            return detail + (", or Status Return Level (68) is 0" if self.failed == READS else "")
        return ""

    @property
    def remedy(self) -> str:
        """For the fault."""
        if self.has_duplicate_id:
            return "connect one of them alone and give it another ID with `paramove arm setup`"
        return "connect it alone and scan again, then with another cable"


@dataclass(frozen=True)
class OlderServo:
    """A servo that replies in Protocol 1.0 only: ID, model number as it reports it, baud rate, bit/s."""

    number: int
    model_number: int
    baud_rate: int


@dataclass(frozen=True)
class BusScan:
    """The result of a scan.

    Attributes:
        servos: In the order of the baud rates, by ID.
        asked: Baud rates that were scanned; without those that the adapter does not have.
        damaged: Of these, those with damaged replies to the ping of all.
        foreign: Of these, those with bytes that are no reply of a servo.
        older: Servos of Protocol 1.0, which are asked if there is none of Protocol 2.0.
    """

    servos: list[DetectedServo] = field(default_factory=list)
    asked: list[int] = field(default_factory=list)
    damaged: list[int] = field(default_factory=list)
    foreign: list[int] = field(default_factory=list)
    older: list[OlderServo] = field(default_factory=list)

    @property
    def faults(self) -> list[str]:
        """Messages about the bus as a whole."""
        messages = []
        if self.damaged:
            rates = listed(self.damaged)
            messages.append(f"answers at {rates} bit/s are damaged: several servos have the same ID, or a bad cable")
        if self.foreign:
            rates = listed(self.foreign)
            messages.append(f"bytes at {rates} bit/s are no answer of a servo: another device, or a bad cable")
        for servo in self.older:
            messages.append(
                f"ID {servo.number} (model number {servo.model_number}) at {servo.baud_rate} bit/s replies in Protocol "
                "1.0, as Dynamixel AX and RX, older MX, and Feetech servos do; servos of Protocol 2.0 are driven. "
                "Firmware for Protocol 2.0 exists for MX-28, MX-64 and MX-106"
            )
        return messages

    def findings(self, baud_rate: int = 0) -> list[str]:
        """Messages about all that is wrong. `baud_rate`: the configured one, 0 if none is."""
        messages = self.faults
        for rate, count in Counter(one.baud_rate for one in self.servos).items():
            if baud_rate not in (0, rate):
                messages.append(f"found {count} servo{'s' * (count != 1)} at {rate}, configured {baud_rate}")
        faulty = (one for one in self.servos if one.fault)
        return messages + [f"ID {one.number} at {one.baud_rate} {one.fault}; {one.remedy}" for one in faulty]


def listed(rates: Sequence[int]) -> str:
    """Separated by commas."""
    return ", ".join(map(str, rates))


def model_name(number: int) -> str:
    """Of the SDK's list, "" for a model that is not in it."""
    try:
        return str(ControlTable.getModelName(number)).removesuffix(".model")
    except DxlRuntimeError:
        return ""


def scan_bus(chain: ServoChain, baud_rates: Sequence[int] = USUAL_BAUD_RATES, ids: Sequence[int] = ALL_IDS) -> BusScan:
    """Ping all servos at each of these baud rates, and where a reply is not understood these IDs one by one.

    If none replies, `OLDER_IDS` are asked in Protocol 1.0, up to the first rate at which one replies, to say what is
    there. The port is left at the baud rate that it had. Raises PortLostError, and InputError for a rate that no servo
    has.
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
            _scan_rate(chain, ids, scan)
        for rate in () if scan.servos else scan.asked:
            chain.port.setBaudRate(rate)
            scan.older.extend(_older_servos(chain))
            if scan.older:
                break
    finally:
        chain.port.setBaudRate(before)
    return scan


def _scan_rate(chain: ServoChain, ids: Sequence[int], scan: BusScan) -> None:
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


def _older_servos(chain: ServoChain) -> list[OlderServo]:
    """Those that reply in Protocol 1.0; none where a reply comes to any ID, as from an adapter with an echo."""
    found = []
    latency_s = chain.port.latency_s
    chain.port.latency_s = min(latency_s, SHORT_LATENCY_S)
    try:
        for number in (NOBODYS_ID, *OLDER_IDS):
            model_number, result, _ = Protocol1PacketHandler().ping(chain.port, number)
            if result == COMM_SUCCESS and number == NOBODYS_ID:
                return []
            if result == COMM_SUCCESS:
                found.append(OlderServo(number, model_number, chain.port.baud_rate))
    finally:
        chain.port.latency_s = latency_s
    if found:  # the echo of the first ping may have been late: asked again, and waited for as long as for any reply
        _, result, _ = Protocol1PacketHandler().ping(chain.port, NOBODYS_ID)
        return [] if result == COMM_SUCCESS else found
    return found


def _one_by_one(chain: ServoChain, ids: Sequence[int]) -> Iterator[DetectedServo]:
    """Servos of these IDs; ends where bytes that are not understood come from a device that was not asked."""
    for number in ids:
        servo = _servo_with_id(chain, number)
        if servo is not None and servo.garbled and _servo_with_id(chain, NOBODYS_ID) is not None:
            return
        if servo is not None:
            yield servo


def _servo_with_id(chain: ServoChain, number: int) -> DetectedServo | None:
    """None if nothing comes."""
    for _ in range(READS):
        before = _not_understood(chain)
        pinged = _quick_ping(chain, number)
        if pinged is not None:
            return looked_at(chain, pinged)
        if _not_understood(chain) == before:
            return None
    return DetectedServo(number, "", 0, 0, chain.port.baud_rate, garbled=True)


def _not_understood(chain: ServoChain) -> int:
    return chain.counts.noise + chain.counts.stray


def _quick_ping(chain: ServoChain, number: int) -> PingedServo | None:
    """With short timeouts: most likely no servo has this ID."""
    latency_s, chain.port.latency_s = chain.port.latency_s, min(chain.port.latency_s, SHORT_LATENCY_S)
    try:
        return chain.ping(number, retry=False)
    finally:
        chain.port.latency_s = latency_s


def looked_at(chain: ServoChain, pinged: PingedServo) -> DetectedServo:
    """A servo that replied to a ping, with its registers. Raises PortLostError."""
    registers, before = _registers(pinged.model_number), _not_understood(chain)
    values, failed = dict[str, int](), 0
    for _ in range(READS if registers else 0):
        damaged = chain.counts.damaged
        answer = chain.read_once([pinged.number], registers).get(pinged.number)
        failed += answer is None or chain.counts.damaged > damaged
        values = values if answer is None else answer.values
    return DetectedServo(
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
