"""Random stalls of HOAP-3's feeder in simulated time: whenever the robot runs out of rows it comes to rest smoothly.

    python benchmarks/stream_stalls.py [--patterns 1000000] [--seed 0]

Each pattern begins somewhere on a fast swing of the right arm. The feeder then stalls for up to half a second between
batches; batches are late, lost, repeated, overtaken, or of another length. What the robot plays is judged by itself:
velocity, acceleration and jerk of the counts, and rest at the end. The exit code is 1 and the seed is named if a stop
was not smooth.
"""

from __future__ import annotations

import argparse
import copy
import sys
import time
from collections import Counter
from functools import cache, lru_cache
from pathlib import Path

import numpy as np

from paramove.documents import Floats
from paramove.robots import RobotDescription
from paramove.robots.streaming import StreamBatch, StreamReader
from paramove.safety import longest_path_s, stop_ramp

EPOCH = 3
TICK = 67
COVER = 300
DURATION = 1200
SWING_DEG = {
    "right_shoulder_pitch": -100.0,
    "right_shoulder_roll": -40.0,
    "right_shoulder_torsion": 50.0,
    "right_elbow": -60.0,
    "right_wrist": -100.0,
    "right_fingers": -80.0,
}


class NotSmoothError(AssertionError):
    """A movement that the robot's motors should not be given."""


class Swing:
    """The robot, its path of 1.2 s, the batches that a feeder cuts from it, and the robot after each of its ticks."""

    def __init__(self) -> None:
        self.robot = RobotDescription.load(Path(__file__).parent.parent / "robot_description" / "hoap3")
        self.limits = self.robot.motion_limits
        u = np.linspace(0.0, 1.0, DURATION + 1)[1:, None]
        swing_rad = np.zeros(self.robot.n_joints)
        for joint, degrees in SWING_DEG.items():
            swing_rad[self.robot.index(joint)] = np.deg2rad(degrees)
        self.path = self.robot.base_pose + (10 * u**3 - 15 * u**4 + 6 * u**5) * swing_rad
        self.batch = lru_cache(maxsize=4096)(self._batch)
        self.begun: list[StreamReader] = []
        reader = StreamReader(self.robot, self.robot.units.to_counts(self.robot.base_pose))
        for first in range(0, DURATION - TICK, TICK):
            if not reader.offer(self.batch(first, COVER)):
                raise NotSmoothError(f"the undisturbed stream is rejected: {reader.rejection}")
            self.begun.append(copy.copy(reader))
            for _ in range(TICK):
                reader.play()

    def _batch(self, first: int, cover: int) -> StreamBatch:
        rows = self.path[first : first + cover]
        ahead = self.path[first + cover :][: int(np.ceil(longest_path_s(self.limits) / self.limits.dt_s))]
        ramp = stop_ramp(rows[-1], ahead, self.limits) if len(ahead) else rows[:0]
        return StreamBatch.of(self.robot, EPOCH, first, np.concatenate([rows, ramp]), len(ramp))


@cache
def swing() -> Swing:
    """Made once: 18 robots in motion."""
    return Swing()


def run(random: np.random.Generator) -> tuple[Floats, Counter[str]]:
    """One pattern: what the robot played until it rests, [N, J] counts, its past included, and what happened."""
    stage, counts = swing(), Counter[str]()
    reader = copy.copy(stage.begun[random.integers(len(stage.begun))])
    reader.rejected_batches = 0
    frames = list(reader._played)
    waiting: list[StreamBatch] = []
    for _ in range(random.integers(1, 4)):
        known = reader.next_index
        frames += [reader.play() for _ in range(int(random.integers(0, random.choice([70, 200, 500]))))]
        first = min(known + int(random.choice([0, 60, 100, 170, 240])), DURATION - 1)
        waiting.append(stage.batch(first, int(random.choice([100, COVER]))))
        kind = random.choice(["sent", "sent", "sent", "lost", "repeated", "overtaken"])
        counts[kind] += 1
        if kind == "lost":
            waiting.pop()
        elif kind == "repeated":
            waiting.append(waiting[-1])
        elif kind == "overtaken":
            continue  # the next one comes first
        for batch in reversed(waiting):
            reader.offer(batch)
        waiting.clear()
    frames += [reader.play() for _ in range(reader.depth)]
    counts["refused"] += reader.rejected_batches
    counts["under-run" if reader.next_index < DURATION else "played to its end"] += 1
    if not reader.at_rest:
        raise NotSmoothError("the robot is not at rest")
    return np.array(frames, dtype=np.float64), counts


def judge(frames: Floats) -> None:
    """Velocity, acceleration and jerk of counts that were rounded, held at both ends.

    Raises:
        NotSmoothError: A frame that no motor should be given.
    """
    robot = swing().robot
    per_rad = np.abs(robot.units.counts_per_rad)
    whole = np.concatenate([frames, np.repeat(frames[-1:], 48, axis=0)])
    stopping = ("acceleration", 2, robot.stop_acceleration)
    for what, order, limit, span in (
        # A batch that joins a ramp just begun may add a count to a step of the operating velocity (seed 112996): the
        # robot's side promises what the motors can do.
        ("velocity", 1, robot.velocity, 1),
        (*stopping, 4),
        (*stopping, 16),
        ("jerk", 3, 2 * robot.jerk, 12),
    ):
        difference = whole
        for _ in range(order):
            difference = difference[span:] - difference[:-span]
        # Rounding adds half a count to each of the 2 ** order terms.
        allowed = 1.002 * per_rad * limit * (span * 1e-3) ** order + 2 ** (order - 1)
        if not (np.abs(difference) <= allowed).all():
            row, joint = (int(i) for i in np.argwhere(~(np.abs(difference) <= allowed))[0])
            size = f"{abs(difference[row, joint]):.0f} counts, allowed {allowed[joint]:.1f}"
            raise NotSmoothError(f"{what} of {robot.joint_names[joint]} over {span} frames at frame {row}: {size}")


def main() -> int:
    parser = argparse.ArgumentParser(description="Random stalls of HOAP-3's feeder, judged separately.")
    parser.add_argument("--patterns", type=int, default=1_000_000)
    parser.add_argument("--seed", type=int, default=0)
    arguments = parser.parse_args()
    counts: Counter[str] = Counter()
    begun = time.monotonic()
    for number in range(arguments.patterns):
        seed = arguments.seed + number
        try:
            frames, happened = run(np.random.default_rng(seed))
            judge(frames)
        except NotSmoothError as error:
            sys.stdout.write(f"seed {seed}: {error}\n")
            return 1
        counts += happened
        if number % max(1, arguments.patterns // 100) == 0:
            sys.stderr.write(f"{number + 1} patterns, {time.monotonic() - begun:.0f} s\n")
    for what, count in sorted(counts.items()):
        sys.stdout.write(f"{count:9d}  {what}\n")
    sys.stdout.write(f"{arguments.patterns} patterns, every one a smooth movement to rest\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
