"""Three emulated servos at 1 Mbit/s behind a pseudo-terminal, until a signal ends it; prints what they rejected."""

import signal
import sys
from pathlib import Path

from paramove.robots.dynamixel.bus.servo_models import XL330_M288, XL430_W250
from paramove.robots.dynamixel.emulated.emulator import DynamixelEmulator
from paramove.robots.dynamixel.emulated.servo import EmulatedServo

chain = [EmulatedServo(model, 1 + i, 1_000_000) for i, model in enumerate((XL430_W250, XL330_M288, XL330_M288))]
signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGTERM})
with DynamixelEmulator(chain, Path(sys.argv[1]), servo_rules_only=True) as emulator:
    sys.stdout.write(f"{emulator.port}\n")
    sys.stdout.flush()
    signal.sigwait({signal.SIGTERM})
    sys.stdout.write(", ".join(f"{count} {kind}" for kind, count in sorted(emulator.bus.judge.counts.items())) + "\n")
