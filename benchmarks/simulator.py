"""Speed of the simulated world: what a camera period of 66.7 ms costs.

    python benchmarks/simulator.py [--ticks 150]

Prints milliseconds per period for the physics (67 steps with firmware, stream and instructor), the camera's image
and the view for people, and how many times faster than real time that is. Goal: below 20 ms with the camera.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))  # the workspace is no installed package

from paramove.msgs.rule_pb2 import Speech
from sim.scenes import at_the_tool_box
from sim.simulator import Config

PERIOD_MS = 1000 / 15


def measure(ticks: int, camera: bool, video: bool) -> tuple[float, float]:
    """Milliseconds per tick of physics and of rendering while the instructor shows the rules."""
    simulation = at_the_tool_box(Config(camera=camera, video=video))
    simulation.person.handle(Speech.REQUEST_SHOW_RULES)
    simulation.run_to_tick(1)
    simulation.shown()
    simulation.physics_s = simulation.rendering_s = 0.0
    for tick in range(2, ticks + 2):
        simulation.shown()
        simulation.run_to_tick(tick)
    simulation.close()
    return 1e3 * simulation.physics_s / ticks, 1e3 * simulation.rendering_s / ticks


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--ticks", type=int, default=150)
    ticks = parser.parse_args().ticks
    sys.stdout.write(f"{'':22}{'physics ms':>12}{'images ms':>12}{'total ms':>12}{'x real time':>13}\n")
    for title, camera, video in (("no images", False, False), ("camera", True, False), ("camera and view", True, True)):
        physics_ms, rendering_ms = measure(ticks, camera, video)
        total_ms = physics_ms + rendering_ms
        sys.stdout.write(
            f"{title:22}{physics_ms:12.1f}{rendering_ms:12.1f}{total_ms:12.1f}{PERIOD_MS / total_ms:13.1f}\n"
        )


if __name__ == "__main__":
    main()
