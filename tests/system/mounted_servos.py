"""Servos that move an arm in its scene, in a process of their own, until the standard input ends.

Arguments are the arm's description and the port's name; the first line of the input has what is kept in each servo.
"""

import contextlib
import json
import os
import sys
from pathlib import Path

from paramove.robots.description import RobotDescription
from sim.emulated_arm import EmulatedArm


def main() -> None:
    folder, link = (Path(word) for word in sys.argv[1:])
    kept = json.loads(sys.stdin.readline())
    with contextlib.suppress(PermissionError):
        os.nice(-5)  # servos do not wait for a computer's other work
    with EmulatedArm(RobotDescription.load(folder), link=link, held=True) as arm:
        with arm.emulator.lock:
            for servo, settings in zip(arm.emulator.bus.servos, kept, strict=True):
                for name, value in settings.items():
                    servo.memory[name] = value
        sys.stdout.write("plugged in\n")
        sys.stdout.flush()
        sys.stdin.read()


if __name__ == "__main__":
    main()
