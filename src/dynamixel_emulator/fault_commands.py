"""What may go wrong with emulated servos, on purpose, each by one line of text: `block elbow`, `voltage 9.4`.

The same lines come over the control socket (`dynamixel_emulator.control`).
"""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Mapping
from dataclasses import asdict, fields

from dynamixel_emulator.body import HardwareError
from dynamixel_emulator.emulator import DynamixelEmulator
from dynamixel_emulator.errors import EmulatorError, nearest
from dynamixel_emulator.mechanics import DrivenJoint
from dynamixel_emulator.models import BAUD_RATES, model_named
from dynamixel_emulator.motor import RAD_PER_PULSE
from dynamixel_emulator.servo import EmulatedServo
from dynamixel_emulator.wire_faults import WireFaults

UNGEARED = DrivenJoint("", 1.0 / RAD_PER_PULSE)
FARTHEST_DEG = 720.0
ELSEWHERE = 700.0
"""Pulses by which a second servo of an id stands away from the first."""


class FaultCommands:
    """Does what a line says.

    Args:
        emulator: To whom.
        names: Ids of servos by the names of their joints, which may be used instead.
        joints: Pulses of servos, by ids; those of others turn with their joints, which are at 0 with 2048 pulses.
    """

    def __init__(
        self,
        emulator: DynamixelEmulator,
        names: Mapping[str, int] | None = None,
        joints: Mapping[int, DrivenJoint] | None = None,
    ) -> None:
        self.emulator = emulator
        self.names, self._joints = dict(names or {}), dict(joints or {})

    def do(self, line: str) -> str:
        """The answer: empty, or text in one line.

        Raises:
            EmulatorError: The line is none of the verbs, or cannot be done; the text says what would have been right.
        """
        words = line.split()
        if not words or words[0] not in VERBS:
            raise EmulatorError(f"{line!r} is no command of the emulator; {nearest(words[0] if words else '', VERBS)}")
        usage, verb = VERBS[words[0]]
        if len(words) < sum(not word.startswith("[") for word in usage.split()):
            raise EmulatorError(f"{line!r}: {usage}")
        if verb in (_unplug, _plug_in):  # these wait for the thread that holds the lock from time to time
            return verb(self, words[1:])
        with self.emulator.lock:
            return verb(self, words[1:])

    def servos(self, who: str) -> list[EmulatedServo]:
        """All of an id, or of the name of a joint. Raises EmulatorError if there is none."""
        number = self.names.get(who)
        if number is None and who.isdecimal():
            number = int(who)
        found = [servo for servo in self.emulator.bus.servos if servo.id == number]
        if not found:
            known = sorted({*self.names, *(str(servo.id) for servo in self.emulator.bus.servos)})
            raise EmulatorError(f"no servo {who!r}; {nearest(who, known)}")
        return found

    def pulses(self, servo: EmulatedServo, angle: float) -> float:
        """Of the encoder of a servo whose joint is at this angle, rad."""
        joint = self._joints.get(servo.id, UNGEARED)
        return joint.zero_counts + joint.counts_per_rad * angle


def _each(change: Callable[[EmulatedServo, list[str]], None]) -> Callable[[FaultCommands, list[str]], str]:
    """A verb that does this to the servos that its first word names."""

    def verb(verbs: FaultCommands, words: list[str]) -> str:
        for servo in verbs.servos(words[0]):
            change(servo, words[1:])
        return ""

    return verb


def _block(servo: EmulatedServo, words: list[str]) -> None:
    servo.blocked = True


def _free(servo: EmulatedServo, words: list[str]) -> None:
    servo.blocked, servo.hand = False, None


def _lead(verbs: FaultCommands, words: list[str]) -> str:
    degrees = _number(words[1])
    if abs(degrees) > FARTHEST_DEG:
        raise EmulatorError(
            f"a joint is led to an angle of -{FARTHEST_DEG:g} to {FARTHEST_DEG:g} deg, found {words[1]}"
        )
    for servo in verbs.servos(words[0]):
        servo.lead(verbs.pulses(servo, math.radians(degrees)))
    return ""


def _failing(error: HardwareError) -> Callable[[EmulatedServo, list[str]], None]:
    return lambda servo, words: servo.fail(error)


def _overheat(servo: EmulatedServo, words: list[str]) -> None:
    servo.temperature = servo.memory["Temperature Limit"] + 1.0


def _reboot(servo: EmulatedServo, words: list[str]) -> None:
    servo.reboot()


def _baud(servo: EmulatedServo, words: list[str]) -> None:
    rate = _number(words[0])
    if rate not in BAUD_RATES:
        raise EmulatorError(f"no servo has a baud rate of {words[0]}: {', '.join(map(str, BAUD_RATES))}")
    servo.memory["Baud Rate"] = BAUD_RATES.index(int(rate))


def _remove(servo: EmulatedServo, words: list[str]) -> None:
    servo.powered = False


def _restore(servo: EmulatedServo, words: list[str]) -> None:
    servo.powered = True
    servo.reboot()


def _torque(servo: EmulatedServo, words: list[str]) -> None:
    if words[0] not in ("on", "off"):
        raise EmulatorError(f"torque is on or off, found {words[0]!r}")
    if words[0] == "on":
        servo.hold()
    else:
        servo.memory["Torque Enable"] = 0


def _eeprom(servo: EmulatedServo, words: list[str]) -> None:
    value = _number(words[-1])
    if value != int(value):
        raise EmulatorError(f"a register holds whole numbers, found {words[-1]}")
    servo.preset(" ".join(words[:-1]), int(value))


def _voltage(verbs: FaultCommands, words: list[str]) -> str:
    volts = _number(words[0])
    if not 0.0 <= volts <= 60.0:
        raise EmulatorError(f"a supply has 0 to 60 V, found {words[0]}")
    for servo in verbs.servos(words[1]) if len(words) > 1 else verbs.emulator.bus.servos:
        servo.voltage = volts
    return ""


def _duplicate(verbs: FaultCommands, words: list[str]) -> str:
    like = verbs.servos(words[0])[0]
    model = model_named(words[1]) if len(words) > 1 else like.model
    verbs.emulator.bus.add(EmulatedServo(model, like.id, like.baud_rate, like.position + ELSEWHERE))
    return ""


def _delay(verbs: FaultCommands, words: list[str]) -> str:
    return _faults(verbs, [f"delay_s={1e-3 * _number(words[0])}"])


def _faults(verbs: FaultCommands, words: list[str]) -> str:
    """Those that are not named stay as they are; without any, none is left."""
    known = {one.name: one.type for one in fields(WireFaults)}
    values = asdict(verbs.emulator.faults) if words else {}
    for word in words:
        name, _, value = word.partition("=")
        if name not in known:
            raise EmulatorError(f"no fault of the wire is called {name!r}; {nearest(name, known)}")
        number = _number(value)
        values[name] = bool(number) if name == "echo" else int(number) if name == "seed" else number
    verbs.emulator.faults = WireFaults(**values)
    return ""


def _unplug(verbs: FaultCommands, words: list[str]) -> str:
    verbs.emulator.unplug()
    return ""


def _plug_in(verbs: FaultCommands, words: list[str]) -> str:
    verbs.emulator.plug_in()
    return verbs.emulator.port


def _state(verbs: FaultCommands, words: list[str]) -> str:
    """JSON: the port, each servo, and what the judge has counted."""
    shown = ("Present Position", "Goal Position", "Torque Enable", "Hardware Error Status", "Bus Watchdog")
    servos = []
    for servo in verbs.emulator.bus.servos:
        servo.present()
        numbers = {name.lower().replace(" ", "_"): servo.memory[name] for name in shown}
        about = {"id": servo.id, "model": servo.model.name, "powered": servo.powered, "blocked": servo.blocked}
        about["led"] = servo.hand is not None
        servos.append({**about, **numbers, "temperature": round(servo.temperature, 1), "voltage": servo.voltage})
    judge = verbs.emulator.bus.judge
    found = {"packets": judge.packets, "findings": dict(judge.counts)}
    return json.dumps({"port": verbs.emulator.port, "servos": servos, "judge": found})


def _findings(verbs: FaultCommands, words: list[str]) -> str:
    """JSON: what the judge found, and forgets."""
    judge = verbs.emulator.bus.judge
    told = json.dumps([asdict(finding) for finding in judge.findings])
    judge.findings.clear()
    return told


def _number(word: str) -> float:
    try:
        value = float(word)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise EmulatorError(f"expected a number, found {word!r}")
    return value


VERBS: dict[str, tuple[str, Callable[[FaultCommands, list[str]], str]]] = {
    "block": ("block JOINT", _each(_block)),
    "lead": ("lead JOINT DEGREES", _lead),
    "free": ("free JOINT", _each(_free)),
    "overload": ("overload ID", _each(_failing(HardwareError.OVERLOAD))),
    "overheat": ("overheat ID", _each(_overheat)),
    "encoder": ("encoder ID", _each(_failing(HardwareError.ENCODER))),
    "shock": ("shock ID", _each(_failing(HardwareError.SHOCK))),
    "voltage": ("voltage VOLTS [ID]", _voltage),
    "reboot": ("reboot ID", _each(_reboot)),
    "dup": ("dup ID [MODEL]", _duplicate),
    "baud": ("baud ID RATE", _each(_baud)),
    "remove": ("remove ID", _each(_remove)),
    "restore": ("restore ID", _each(_restore)),
    "torque": ("torque ID STATE", _each(_torque)),
    "eeprom": ("eeprom ID ITEM VALUE", _each(_eeprom)),
    "delay": ("delay MS", _delay),
    "faults": ("faults [NAME=VALUE]", _faults),
    "unplug": ("unplug", _unplug),
    "plug_in": ("plug_in", _plug_in),
    "state": ("state", _state),
    "findings": ("findings", _findings),
}
"""How each is written, and what it does. JOINT and ID are the name of a joint or an id."""
