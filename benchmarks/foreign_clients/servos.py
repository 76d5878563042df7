"""Three emulated servos at 1 Mbit/s behind a pseudo-terminal, until a signal ends it; prints what they rejected."""

import signal
import sys
from pathlib import Path

from dynamixel_emulator import DynamixelEmulator, EmulatedServo

MODELS = ("xl430_w250", "xl330_m288", "xl330_m288")
chain = [EmulatedServo(model, 1 + i, 1_000_000) for i, model in enumerate(MODELS)]
signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGTERM})
with DynamixelEmulator(chain, Path(sys.argv[1]), servo_rules_only=True) as emulator:
    sys.stdout.write(f"{emulator.port}\n")
    sys.stdout.flush()
    signal.sigwait({signal.SIGTERM})
    sys.stdout.write(", ".join(f"{count} {kind}" for kind, count in sorted(emulator.bus.judge.counts.items())) + "\n")
