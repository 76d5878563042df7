"""Servos found on a bus, whatever rate they are set to. They are only asked: nothing is written and nothing moves.

dynamixel-sdk's own ping to all passes over a second servo of the same ID and over damaged answers. Those are looked
for here, so packets are sent and read one by one.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field

from dynamixel_easy_sdk.control_table import ControlTable
from dynamixel_easy_sdk.dynamixel_error import DxlRuntimeError

from paramove.robots.dynamixel.packets import BROADCAST, Instruction, Packet, PacketReader, encoded
from paramove.robots.dynamixel.servo_port import BITS_PER_BYTE, ServoPort

USUAL_BAUD_RATES = (57_600, 1_000_000, 115_200, 2_000_000, 3_000_000, 4_000_000)
"""bit/s; the first is set at the factory."""
IDS = 252
ALL_IDS = range(IDS + 1)
PING_ANSWER_BYTES = 14
PING_S = 0.016 + 0.003 * IDS
"""Beyond the time of the answers of all; as dynamixel-sdk 4.1.0 waits (`broadcastPing`)."""
READS = 3
QUIET_S = 0.03
"""After an answer, until no second one comes; more than an adapter's latency timer of 16 ms."""
WANTED = (
    "Baud Rate", "Temperature Limit", "Max Voltage Limit", "Min Voltage Limit", "Hardware Error Status",
    "Present Input Voltage", "Present Temperature",
)  # fmt: skip


@dataclass(frozen=True)
class FoundServo:
    """What a servo, or several with the same ID, told.

    Attributes:
        number: ID.
        model: Name as in dynamixel-sdk, or "model N" of one that has no table there.
        baud_rate: At which it answered, bit/s.
        at_once: The most answers to one question; more than one servo with this ID if it is above 1.
        failed: How many of the reads were not answered whole.
        values: Registers by name; without those that its model does not have or that could not be read.
    """

    number: int
    model: str
    firmware: int
    baud_rate: int
    at_once: int = 1
    failed: int = 0
    values: Mapping[str, int] = field(default_factory=dict)


@dataclass
class Heard:
    """What came in after one question.

    Attributes:
        answers: From servos.
        damaged: Whether there were packets whose checksum is wrong.
        foreign: Whether bytes came in, but no packet at all.
        stray: Whether there were bytes that belong to no packet, as when two servos talk at once.
    """

    answers: list[Packet] = field(default_factory=list)
    damaged: bool = False
    foreign: bool = False
    stray: bool = False


@dataclass(frozen=True)
class ScannedRate:
    """What was heard at one rate.

    Attributes:
        baud_rate: bit/s.
        possible: Whether the adapter can be set to it.
        damaged, foreign: As in `Heard`, when all were asked.
        servos: By rising ID.
    """

    baud_rate: int
    possible: bool = True
    damaged: bool = False
    foreign: bool = False
    servos: tuple[FoundServo, ...] = ()


def scan(
    port: ServoPort, baud_rates: Sequence[int], patience_s: float = 0.1, ids: Sequence[int] = ALL_IDS
) -> Iterator[ScannedRate]:
    """Asks at each rate who is there, then those for their state.

    Args:
        port: Open.
        baud_rates: bit/s.
        patience_s: For the beginning of an answer, beyond the time of its bytes.
        ids: That are asked one by one where servos answer and something disturbs them.

    Raises PortLostError if the port goes away.
    """
    for baud_rate in baud_rates:
        try:
            port.setBaudRate(baud_rate)
        except (ValueError, OSError):  # pyserial has both for a rate that the adapter or its driver does not have
            yield ScannedRate(baud_rate, possible=False)
            continue
        byte_s = BITS_PER_BYTE / baud_rate
        heard = _asked(port, Packet(BROADCAST, Instruction.PING), IDS * PING_ANSWER_BYTES * byte_s + PING_S)
        first = {one.id: one for one in reversed(heard.answers) if len(one.parameters) == 4}
        servos = []
        for number in sorted(first):
            at_once = sum(one.id == number for one in heard.answers)
            servos.append(_examined(port, first[number], at_once, patience_s))
        if heard.stray and first:
            servos += _one_by_one(port, [number for number in ids if number not in first], patience_s)
            servos.sort(key=lambda one: one.number)
        yield ScannedRate(baud_rate, True, heard.damaged, heard.foreign, tuple(servos))


def _one_by_one(port: ServoPort, ids: Sequence[int], patience_s: float) -> Iterator[FoundServo]:
    """Servos that were not understood among the others; two of one ID are never understood."""
    window_s = PING_ANSWER_BYTES * BITS_PER_BYTE / port.baud_rate + patience_s
    for number in ids:
        for _ in range(READS):
            heard = _asked(port, Packet(number, Instruction.PING), window_s)
            answers = [one for one in heard.answers if one.id == number and len(one.parameters) == 4]
            if answers:
                yield _examined(port, answers[0], len(answers), patience_s)
            if answers or not heard.stray:
                break
        else:
            yield FoundServo(number, "unknown models", 0, port.baud_rate, at_once=2)


def _examined(port: ServoPort, ping: Packet, at_once: int, patience_s: float) -> FoundServo:
    """Reads a servo's registers several times: two with one ID differ, so that their answers mix sooner or later."""
    model_number, firmware = int.from_bytes(ping.parameters[1:3], "little"), ping.parameters[3]
    places = _places(model_number)
    size = max((address + size for address, size in places.values()), default=0)
    values, failed = dict[str, int](), 0
    question = Packet(ping.id, Instruction.READ, (0).to_bytes(2, "little") + size.to_bytes(2, "little"))
    for _ in range(READS if places else 0):
        heard = _asked(port, question, (size + 11) * BITS_PER_BYTE / port.baud_rate + patience_s, QUIET_S)
        whole = [one.parameters[1:] for one in heard.answers if one.id == ping.id and len(one.parameters) == size + 1]
        at_once = max(at_once, len(whole))
        failed += not whole or heard.damaged
        for name, (address, width) in places.items() if whole else ():
            values[name] = int.from_bytes(whole[0][address : address + width], "little")
    return FoundServo(ping.id, _model(model_number), firmware, port.baud_rate, at_once, failed, values)


def _asked(port: ServoPort, question: Packet, window_s: float, quiet_s: float | None = None) -> Heard:
    """All that comes in within a time, s, or until nothing has come for another since the first answer."""
    heard, reader, n_bytes, n_packets, n_read = Heard(), PacketReader(), 0, 0, 0
    port.clearPort()
    port.writePort(encoded(question))
    port.setPacketTimeoutMillis(1e3 * window_s)
    while not port.isPacketTimeout():
        data = port.readPort(4096)
        n_bytes += len(data)
        for packet in reader.feed(data):
            n_packets += 1
            if not isinstance(packet, Packet):
                heard.damaged = True
                continue
            n_read += len(encoded(packet))
            if packet.instruction == Instruction.STATUS:  # else it is the question, from an adapter with an echo
                heard.answers.append(packet)
        if data and heard.answers and quiet_s is not None:
            port.setPacketTimeoutMillis(1e3 * quiet_s)
    heard.foreign = n_bytes > 0 and n_packets == 0
    heard.stray = n_bytes > n_read
    return heard


def _model(number: int) -> str:
    try:
        return str(ControlTable.getModelName(number)).removesuffix(".model")
    except DxlRuntimeError:
        return f"model {number}"


def _places(model_number: int) -> dict[str, tuple[int, int]]:
    """Address and size of the wanted registers; nothing for a model that the SDK does not know."""
    try:
        table = ControlTable.getControlTable(model_number)
    except DxlRuntimeError:
        return {}
    return {name: (table[name].address, table[name].size) for name in WANTED if name in table}
