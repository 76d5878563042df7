"""Injects faults into emulated servos, each by a command of one line of text: `block elbow`, `voltage 9.4`.

The control socket (`dynamixel_emulator.control`) accepts the same lines.
"""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Mapping
from dataclasses import asdict, fields

from dynamixel_emulator.body import HardwareError
from dynamixel_emulator.emulator import DynamixelEmulator
from dynamixel_emulator.errors import EmulatorError, suggestion
from dynamixel_emulator.mechanics import DrivenJoint
from dynamixel_emulator.models import BAUD_RATES, model_named
from dynamixel_emulator.motor import RAD_PER_PULSE
from dynamixel_emulator.servo import EmulatedServo
from dynamixel_emulator.wire_faults import WireFaults

UNGEARED = DrivenJoint("", 1.0 / RAD_PER_PULSE)
MAX_LEAD_DEG = 720.0
DUPLICATE_OFFSET = 700.0
"""Distance of a second servo with the same id from the first, pulses."""


class FaultCommands:
    """Executes fault commands.

    Args:
        emulator: The emulator to inject faults into.
        names: Servo ids by joint name; commands accept both.
        joints: Gear ratio and zero of each servo, by id; others have no gear, and 2048 pulses at joint position 0.
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
        """Executes one command; returns its output: empty, or one line of text.

        Raises:
            EmulatorError: The command is unknown or cannot be executed; the message names what is valid.
        """
        words = line.split()
        if not words or words[0] not in COMMANDS:
            hint = suggestion(words[0] if words else "", COMMANDS)
            raise EmulatorError(f"{line!r} is not a command of the emulator; {hint}")
        usage, command = COMMANDS[words[0]]
        if len(words) < sum(not word.startswith("[") for word in usage.split()):
            raise EmulatorError(f"{line!r}: {usage}")
        if command in (_unplug, _plug_in):  # these wait for the thread that periodically holds the lock
            return command(self, words[1:])
        with self.emulator.lock:
            return command(self, words[1:])

    def servos(self, name: str) -> list[EmulatedServo]:
        """All servos with this id or joint name. Raises EmulatorError if there is none."""
        number = self.names.get(name)
        if number is None and name.isdecimal():
            number = int(name)
        matching = [servo for servo in self.emulator.bus.servos if servo.id == number]
        if not matching:
            known = sorted({*self.names, *(str(servo.id) for servo in self.emulator.bus.servos)})
            raise EmulatorError(f"no servo {name!r}; {suggestion(name, known)}")
        return matching

    def pulses(self, servo: EmulatedServo, angle: float) -> float:
        """Encoder position, pulses, of a servo whose joint is at this angle, rad."""
        joint = self._joints.get(servo.id, UNGEARED)
        return joint.zero_counts + joint.counts_per_rad * angle


def _each(change: Callable[[EmulatedServo, list[str]], None]) -> Callable[[FaultCommands, list[str]], str]:
    """A command that applies this change to the servos that its first argument names."""

    def command(commands: FaultCommands, words: list[str]) -> str:
        for servo in commands.servos(words[0]):
            change(servo, words[1:])
        return ""

    return command


def _block(servo: EmulatedServo, words: list[str]) -> None:
    servo.blocked = True


def _free(servo: EmulatedServo, words: list[str]) -> None:
    servo.blocked, servo.hand = False, None


def _lead(commands: FaultCommands, words: list[str]) -> str:
    degrees = _number(words[1])
    if abs(degrees) > MAX_LEAD_DEG:
        raise EmulatorError(
            f"a joint can be led to an angle of -{MAX_LEAD_DEG:g} to {MAX_LEAD_DEG:g} deg, found {words[1]}"
        )
    for servo in commands.servos(words[0]):
        servo.lead(commands.pulses(servo, math.radians(degrees)))
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
        raise EmulatorError(f"{words[0]} is not a baud rate of servos: {', '.join(map(str, BAUD_RATES))}")
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


def _voltage(commands: FaultCommands, words: list[str]) -> str:
    volts = _number(words[0])
    if not 0.0 <= volts <= 60.0:
        raise EmulatorError(f"a supply voltage is 0 to 60 V, found {words[0]}")
    for servo in commands.servos(words[1]) if len(words) > 1 else commands.emulator.bus.servos:
        servo.voltage = volts
    return ""


def _duplicate(commands: FaultCommands, words: list[str]) -> str:
    original = commands.servos(words[0])[0]
    model = model_named(words[1]) if len(words) > 1 else original.model
    commands.emulator.bus.add(
        EmulatedServo(model, original.id, original.baud_rate, original.position + DUPLICATE_OFFSET)
    )
    return ""


def _delay(commands: FaultCommands, words: list[str]) -> str:
    return _faults(commands, [f"delay_s={1e-3 * _number(words[0])}"])


def _faults(commands: FaultCommands, words: list[str]) -> str:
    """Sets the named faults and leaves the others; without arguments clears all."""
    known = {one.name: one.type for one in fields(WireFaults)}
    values = asdict(commands.emulator.faults) if words else {}
    for word in words:
        name, _, value = word.partition("=")
        if name not in known:
            raise EmulatorError(f"unknown communication fault {name!r}; {suggestion(name, known)}")
        number = _number(value)
        values[name] = bool(number) if name == "echo" else int(number) if name == "seed" else number
    commands.emulator.faults = WireFaults(**values)
    return ""


def _unplug(commands: FaultCommands, words: list[str]) -> str:
    commands.emulator.unplug()
    return ""


def _plug_in(commands: FaultCommands, words: list[str]) -> str:
    commands.emulator.plug_in()
    return commands.emulator.port


def _run(commands: FaultCommands, words: list[str]) -> str:
    commands.emulator.run_to(int(_number(words[0])))
    return ""


def _state(commands: FaultCommands, words: list[str]) -> str:
    """JSON with the port, the servos and the checker's counts."""
    registers = ("Present Position", "Goal Position", "Torque Enable", "Hardware Error Status", "Bus Watchdog")
    servos = []
    for servo in commands.emulator.bus.servos:
        servo.present()
        values = {name.lower().replace(" ", "_"): servo.memory[name] for name in registers}
        status = {"id": servo.id, "model": servo.model.name, "powered": servo.powered, "blocked": servo.blocked}
        status["led"] = servo.hand is not None
        servos.append({**status, **values, "temperature": round(servo.temperature, 1), "voltage": servo.voltage})
    checker = commands.emulator.bus.checker
    counts = {"packets": checker.packets, "findings": dict(checker.counts)}
    return json.dumps({"port": commands.emulator.port, "servos": servos, "judge": counts})


def _findings(commands: FaultCommands, words: list[str]) -> str:
    """JSON with the checker's findings, which are then cleared."""
    checker = commands.emulator.bus.checker
    text = json.dumps([asdict(finding) for finding in checker.findings])
    checker.findings.clear()
    return text


def _number(word: str) -> float:
    try:
        value = float(word)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise EmulatorError(f"expected a number, found {word!r}")
    return value


COMMANDS: dict[str, tuple[str, Callable[[FaultCommands, list[str]], str]]] = {
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
    "run": ("run NANOSECONDS", _run),
    "state": ("state", _state),
    "findings": ("findings", _findings),
}
"""Syntax and implementation of each command. JOINT and ID are a joint name or a servo id."""
