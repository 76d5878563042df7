"""Emulates Dynamixel servos behind a serial port.

    dynamixel-emulator koch --port ./koch-port                 an arm by name, until Ctrl-C
    dynamixel-emulator xl430_w250:1 xl330_m288:2               any servos, as MODEL:ID
    dynamixel-emulator fault unplug --port ./koch-port         inject a fault into a running emulator
    dynamixel-emulator status --port ./koch-port               servos, and counts of its protocol checker

Exit codes: 0; 2 invalid arguments; 66 a file, port or emulator does not exist; 78 it cannot be used;
70 it stopped while it ran, as in a world that
became unstable.
"""

from __future__ import annotations

import argparse
import contextlib
import json
import signal
import sys
from collections.abc import Sequence
from pathlib import Path

from dynamixel_emulator.arms import ARMS, BAUD_RATE, chain_of
from dynamixel_emulator.control import ControlSocket, request
from dynamixel_emulator.emulator import DynamixelEmulator
from dynamixel_emulator.errors import EmulatorError, EmulatorStoppedError
from dynamixel_emulator.fault_commands import COMMANDS, FaultCommands
from dynamixel_emulator.models import MODELS

PORT = Path("dynamixel-port")
MISSING, STOPPED, UNUSABLE = 66, 70, 78
CHECK_INTERVAL_S = 0.5


def main(arguments: Sequence[str] | None = None) -> int:
    """Entry point; returns the exit code."""
    words = list(sys.argv[1:] if arguments is None else arguments)
    commands = {"fault": _fault, "status": _status}
    try:
        return commands[words[0]](words[1:]) if words and words[0] in commands else _emulate(words)
    except EmulatorError as error:
        sys.stderr.write(f"{error}\n")
        return MISSING if error.missing else UNUSABLE
    except EmulatorStoppedError as error:
        sys.stderr.write(f"{error}\n")
        return STOPPED


def _parser(usage: str, description: str) -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        f"dynamixel-emulator {usage}".strip(),
        description=description,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--port", type=Path, default=PORT, metavar="LINK", help="the port (default: %(default)s)")
    return parser


def _emulate(words: list[str]) -> int:
    parser = _parser("", __doc__ or "")
    parser.add_argument("servos", nargs="+", help=f"{', '.join(ARMS)}, or MODEL:ID of {', '.join(sorted(MODELS))}")
    parser.add_argument("--baud-rate", type=int, default=BAUD_RATE, help="bit/s (default: %(default)s)")
    parser.add_argument("--world", type=Path, metavar="MJCF", help="a MuJoCo model with joints of the same names")
    parser.add_argument(
        "--servo-rules-only", action="store_true", help="report only packets that servos reject, not jumps of the goal"
    )
    parser.add_argument(
        "--paced", action="store_true", help="time stands still until `fault run NANOSECONDS`, counted from the start"
    )
    options = parser.parse_args(words)
    chain = chain_of(options.servos, options.baud_rate)
    joints = chain.joints()
    mechanics = None
    if options.world is not None:
        from dynamixel_emulator.world import MujocoMechanics  # MuJoCo is needed only for a world

        mechanics = MujocoMechanics(options.world, joints)
    servos = chain.emulated()
    stop_signals = {signal.SIGINT, signal.SIGTERM}
    with contextlib.ExitStack() as opened:
        mask = signal.pthread_sigmask(signal.SIG_BLOCK, stop_signals)
        opened.callback(signal.pthread_sigmask, signal.SIG_SETMASK, mask)
        emulator = opened.enter_context(
            DynamixelEmulator(servos, options.port, mechanics, options.servo_rules_only, paced=options.paced)
        )
        faults = FaultCommands(emulator, chain.numbers, dict(zip(chain.numbers.values(), joints, strict=True)))
        opened.enter_context(ControlSocket(control_of(options.port), faults.do))
        sys.stdout.write(
            f"{len(chain.servos)} servos at {chain.baud_rate} bit/s behind {options.port} ({emulator.port}); "
            "Ctrl-C stops them\n"
        )
        sys.stdout.flush()
        while signal.sigtimedwait(stop_signals, CHECK_INTERVAL_S) is None:
            emulator.check()
    return 0


def _fault(words: list[str]) -> int:
    known = "\n".join(f"  {usage}" for usage, _ in COMMANDS.values())
    parser = _parser("fault", f"Injects a fault into a running emulator:\n\n{known}")
    parser.add_argument("command", nargs="+", help="one of the lines above")
    options = parser.parse_args(words)
    reply = request(control_of(options.port), " ".join(options.command))
    if reply:
        sys.stdout.write(f"{reply}\n")
    return 0


def _status(words: list[str]) -> int:
    parser = _parser("status", "Prints the servos of a running emulator, and the counts of its protocol checker.")
    parser.add_argument("--json", action="store_true", help="print JSON")
    options = parser.parse_args(words)
    text = request(control_of(options.port), "state")
    if options.json:
        sys.stdout.write(f"{text}\n")
        return 0
    state = json.loads(text)
    sys.stdout.write(f"{options.port} is a link to {state['port']}\n")
    sys.stdout.write(f"{'ID':>3}  {'model':12} {'position':>8} {'goal':>8}  torque  error  voltage  temperature\n")
    for one in state["servos"]:
        torque = "on" if one["torque_enable"] else "off"
        sys.stdout.write(
            f"{one['id']:3}  {one['model']:12} {one['present_position']:8} {one['goal_position']:8}  {torque:6}  "
            f"{one['hardware_error_status']:5}  {one['voltage']:5.1f} V  {one['temperature']:8.1f} °C\n"
        )
    findings = ", ".join(f"{count} {kind}" for kind, count in sorted(state["judge"]["findings"].items()))
    sys.stdout.write(f"{state['judge']['packets']} packets received, {findings or 'no findings'}\n")
    return 0


def control_of(port: Path) -> Path:
    """Path of the control socket of an emulator, next to its port."""
    return port.with_name(f"{port.name}.control")


if __name__ == "__main__":
    sys.exit(main())
