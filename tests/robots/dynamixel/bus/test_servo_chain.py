"""Questions to servos over the wire: every answer is the right servo's, and what never came is not made up."""

import time
from threading import Event, Timer

import pytest

from dynamixel_emulator.emulator import DynamixelEmulator
from dynamixel_emulator.servo import EmulatedServo
from dynamixel_emulator.wire_faults import WireFaults
from paramove.robots.dynamixel.bus.servo_chain import (
    ATTEMPTS_S,
    PingedServo,
    ServoChain,
    ServoRejectedError,
    ServoTimeoutError,
)
from paramove.robots.dynamixel.bus.servo_models import XL330_M288, XL430_W250
from paramove.robots.dynamixel.bus.servo_port import ServoPort

BAUD_RATE = 1_000_000
REGISTERS = XL430_W250.registers
POSITION = [REGISTERS["Present Velocity"], REGISTERS["Present Position"]]
PATIENT_S = 0.3
"""Other programs may keep the emulator waiting."""
PLACES = {1: 1000.0, 2: 2000.0, 3: 3000.0}


@pytest.fixture
def emulator():
    models = {1: XL430_W250, 2: XL330_M288, 3: XL330_M288}
    servos = [EmulatedServo(models[number].name, number, BAUD_RATE, place) for number, place in PLACES.items()]
    with DynamixelEmulator(servos) as emulator:
        yield emulator


@pytest.fixture
def chain(emulator):
    with ServoPort(emulator.port, BAUD_RATE, latency_s=PATIENT_S) as port:
        yield ServoChain(port)


def impatient(chain: ServoChain) -> ServoChain:
    """For faults that are waited for again and again."""
    chain.port.latency_s = 0.03
    return chain


def positions(chain: ServoChain, *numbers: int) -> dict[int, int]:
    return {number: one.values["Present Position"] for number, one in chain.sync_read(numbers, POSITION).items()}


def test_who_is_there(chain):
    assert chain.ping(2) == PingedServo(2, 1200, 46)
    assert chain.ping_all() == [PingedServo(1, 1060, 46), PingedServo(2, 1200, 46), PingedServo(3, 1200, 46)]
    assert impatient(chain).ping(7) is None


def test_all_ids_have_their_turn_to_answer_to_a_ping_of_all(chain, monkeypatch):
    monkeypatch.setattr("paramove.robots.dynamixel.bus.servo_chain.TURN_S", 0.001)
    chain.ping_all()
    assert chain.port.timeout_s > PATIENT_S + 253 * 0.001


def test_numbers_are_written_and_read(chain):
    chain.write(1, REGISTERS["Homing Offset"], -300)
    assert chain.read(1, REGISTERS["Homing Offset"]) == -300
    assert positions(chain, 1, 2, 3) == {1: 700, 2: 2000, 3: 3000}
    with pytest.raises(OverflowError):
        chain.write(1, REGISTERS["Torque Enable"], 256)


def test_one_packet_writes_to_several(chain):
    chain.sync_write(REGISTERS["Goal Position"], {1: 1100, 3: 2900})
    found = chain.sync_read([1, 2, 3], [REGISTERS["Goal Position"]])
    assert [found[number].values["Goal Position"] for number in (1, 2, 3)] == [1100, 2000, 2900]


def test_a_refusal_names_servo_register_and_reason(chain):
    chain.write(1, REGISTERS["Torque Enable"], 1)
    with pytest.raises(ServoRejectedError, match=r"servo 1 .*EEPROM is locked while torque is on.*write ID = 5"):
        chain.write(1, REGISTERS["ID"], 5)


def test_a_servo_with_a_hardware_error_refuses_torque_and_what_clears_it_is_told(chain, emulator):
    with emulator.lock:
        emulator.bus.servos[0].memory["Hardware Error Status"] = 0x20
    with pytest.raises(ServoRejectedError, match=r"servo 1 .*after a hardware error .*`reboot` clears it"):
        chain.write(1, REGISTERS["Torque Enable"], 1)


def test_a_silent_servo_is_told_with_the_remedy(chain):
    with pytest.raises(ServoTimeoutError, match=r"servo 7 did not answer \(read ID, 3 attempts\).*scan"):
        impatient(chain).read(7, REGISTERS["ID"])


def test_a_missing_servo_leaves_the_others_and_no_number_in_its_place(chain):
    assert positions(impatient(chain), 1, 7, 3) == {1: 1000, 3: 3000}
    assert chain.counts.missing == 3  # servo 3 waited for servo 7 at first


def test_a_servo_with_an_alert_answers(chain, emulator):
    with emulator.lock:
        emulator.bus.servos[1].memory["Hardware Error Status"] = 0x20
    assert positions(chain, 1, 2) == {1: 1000, 2: 2000}


def test_after_a_reboot_torque_is_off(chain, emulator):
    chain.write(2, REGISTERS["Torque Enable"], 1)
    chain.reboot(2)
    with emulator.lock:
        assert emulator.bus.servos[1].memory["Torque Enable"] == 0


@pytest.mark.parametrize(
    ("faults", "told"),
    [
        (WireFaults(damaged=0.3, seed=1), "damaged"),
        (WireFaults(cut=0.3, seed=2), "missing"),
        (WireFaults(lost=0.3, seed=3), "missing"),
        (WireFaults(noisy=0.5, seed=4), ""),
        (WireFaults(bare=0.3, seed=5), "stray"),
        (WireFaults(foreign=0.3, seed=6), "stray"),
        (WireFaults(echo=True), "echoed"),
    ],
)
def test_what_goes_wrong_on_the_wire_never_gives_a_wrong_number(chain, emulator, faults, told):
    emulator.faults = faults
    right = {number: int(place) for number, place in PLACES.items()}
    answered = 0
    impatient(chain)
    for _ in range(10):
        found = positions(chain, 1, 2, 3)
        assert found.items() <= right.items()
        answered += len(found)
    assert answered > 5
    assert not told or getattr(chain.counts, told) > 0


def test_an_answer_that_comes_too_late_is_not_taken_for_the_next(chain, emulator):
    impatient(chain)
    emulator.faults = WireFaults(late=0.4, late_s=0.05, seed=7)
    servo = emulator.bus.servos[0]
    for place in range(1000, 1020):
        with emulator.lock:
            servo.turned(float(place))
        found = positions(chain, 1)
        assert found in ({}, {1: place})


@pytest.mark.parametrize(
    ("faults", "rounds", "minimum"),
    [(WireFaults(late=0.03, late_s=0.06, seed=9), 40, 100), (WireFaults(late=0.2, late_s=0.04, seed=3), 15, 0)],
    ids=["now and then", "most of them"],
)
def test_an_answer_that_comes_several_questions_too_late_is_not_taken_for_another_ones(
    chain, emulator, faults, rounds, minimum
):
    """Of different registers, in turn: what a joint's position says is no torque."""
    chain.port.latency_s = 0.01
    emulator.faults = faults
    torque = [REGISTERS["Torque Enable"], REGISTERS["Hardware Error Status"]]
    with emulator.lock:
        for servo in emulator.bus.servos:
            servo.turned(2048.0)  # whose first byte is 0
            servo.hold()
    heard = 0
    for _ in range(rounds):
        for found, right in (
            (positions(chain, 1, 2, 3), 2048),
            ({number: one.values["Torque Enable"] for number, one in chain.sync_read([1, 2, 3], torque).items()}, 1),
        ):
            heard += len(found)
            assert set(found.values()) <= {right}
    assert heard >= minimum


def silenced(chain: ServoChain) -> None:
    """Ask until it is no use to ask at once again; the servos must be kept from answering."""
    chain.port.latency_s = 0.005
    while chain.has_room():
        assert positions(chain, 1, 2, 3) == {}


def test_silent_servos_are_asked_less_often_and_are_heard_as_soon_as_they_talk_again(chain, emulator, monkeypatch):
    monkeypatch.setattr("paramove.robots.dynamixel.bus.servo_chain.REST_S", 100.0)
    with emulator.lock:
        silenced(chain)
        asked = chain.counts.expected
        assert not chain.has_room()
    ends_s = time.monotonic() + 60.0
    while not chain.has_room():
        assert time.monotonic() < ends_s, "answers that came late were not heard"
    assert chain.counts.expected == asked
    chain.port.latency_s = PATIENT_S
    assert positions(chain, 1, 2, 3) == {number: int(place) for number, place in PLACES.items()}


def test_goals_that_are_written_do_not_put_off_the_next_question(chain, emulator):
    with emulator.lock:
        silenced(chain)
        ends_s = time.monotonic() + 60.0
        while not chain.has_room():
            assert time.monotonic() < ends_s, "nobody is asked any more"
            chain.sync_write(REGISTERS["Goal Position"], {1: 1000})
            Event().wait(0.01)


def test_one_silent_servo_does_not_keep_the_others_from_being_asked(chain):
    chain.port.latency_s = 0.005
    for _ in range(20):
        assert positions(chain, 1, 7, 3).items() <= {1: 1000, 3: 3000}.items()
    chain.port.latency_s = PATIENT_S
    assert positions(chain, 1, 2, 3).keys() == PLACES.keys()
    chain.sync_read([1, 7], POSITION)
    assert chain.has_room()


ASKS = {
    "read": lambda chain: chain.read(1, REGISTERS["Present Position"]) == 1000,
    "ping": lambda chain: chain.ping(1) is not None,
    "write": lambda chain: chain.write(1, REGISTERS["Goal Position"], 1000) is None,
}


@pytest.mark.parametrize("ask", ASKS.values(), ids=ASKS)
def test_a_pause_of_the_machine_is_no_silent_servo(chain, emulator, ask, monkeypatch):
    monkeypatch.setattr("paramove.robots.dynamixel.bus.servo_chain.ATTEMPTS_S", (*ATTEMPTS_S[:-1], 60.0))
    chain.port.latency_s = 0.005
    emulator.lock.acquire()
    Timer(0.06, emulator.lock.release).start()
    assert ask(chain)


@pytest.mark.parametrize(("ask", "answer_bytes"), [("ping", 14), ("write", 11)])
def test_answers_to_all_attempts_may_come_together(chain, emulator, ask, answer_bytes, monkeypatch):
    monkeypatch.setattr("paramove.robots.dynamixel.bus.servo_chain.ATTEMPTS_S", (*ATTEMPTS_S[:-1], 60.0))
    chain.port.latency_s = 0.005
    read, kept = chain.port.readPort, bytearray()

    def read_together(maximum):
        kept.extend(read(maximum))
        return bytes(kept) if len(kept) == len(ATTEMPTS_S) * answer_bytes else b""

    monkeypatch.setattr(chain.port, "readPort", read_together)
    assert ASKS[ask](chain)
    assert chain.counts.missing == 2
