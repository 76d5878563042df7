"""Random steps of the safety gate, judged by a second, separately written checker.

    python benchmarks/safety_steps.py [--steps 1000000] [--seed 0]

Each episode is an arm of three joints with a robot that plays what it is given, and a driver, operator and emergency
stop that mostly do what they should and otherwise send invalid data: NaN, huge and misshapen rows, old, replayed and
foreign proposals, movements too fast by a little, reports that cannot be true, time that jumps. Prints how often what
was given; the exit code is 1 and the seed is named if anything was given that the checker does not allow.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections import Counter
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from paramove.documents import Floats
from paramove.safety import (
    ArmingRequest,
    Fault,
    Inputs,
    Measured,
    MotionLimits,
    Proposal,
    SafetyCore,
    SafetySettings,
    State,
    Targets,
    longest_path_s,
    straight_move,
)

STEPS_PER_EPISODE = 200
EPOCH = 5
MS = 1_000_000
NAMES = ("shoulder", "elbow", "wrist")
MECHANICAL = 2.0


def limits_at(dt_s: float) -> MotionLimits:
    """Of a synthetic arm: three joints of different speed."""
    scale = np.array([1.0, 1.5, 3.0])
    return MotionLimits(
        NAMES,
        np.full(3, -1.5),
        np.full(3, 1.5),
        4.0 * scale,
        3.0 * scale,
        25.0 * scale,
        50.0 * scale,
        1500.0 * scale,
        dt_s,
    )


class NotAllowedError(AssertionError):
    """The gate gave what the checker does not allow."""


class Checker:
    """Judges all rows given in one episode. Knows the limits' numbers and nothing of how the gate judges."""

    def __init__(self, limits: MotionLimits, start: Floats) -> None:
        self.limits = limits
        self.reach = 3 * max(1, round(0.012 / limits.dt_s))
        self.rows = start[None].repeat(self.reach, axis=0)  # row i of the stream is rows[reach + i]
        self.stops = np.zeros(len(self.rows), dtype=bool)

    def given(self, targets: Targets) -> None:
        """Take `targets` in and judge all differences that they are part of."""
        if not np.isfinite(targets.rows).all() or targets.first_index < 0:
            raise NotAllowedError("not finite, or a negative index")
        index = self.reach + targets.first_index
        if index > len(self.rows):
            raise NotAllowedError(f"a gap before index {targets.first_index}")
        kind = np.zeros(len(targets.rows), dtype=bool)
        kind[len(kind) - targets.ramp_rows :] = True
        self.rows = np.concatenate([self.rows[:index], targets.rows])
        self.stops = np.concatenate([self.stops[:index], kind])
        tail = np.repeat(self.rows[-1:], self.reach, axis=0)
        rows = np.concatenate([self.rows[index - self.reach :], tail])
        stops = np.concatenate([self.stops[index - self.reach :], np.ones(self.reach, dtype=bool)])
        self._judge(rows, stops, bool(targets.ramp_rows))

    def _judge(self, rows: Floats, stops: NDArray[np.bool_], ramped: bool) -> None:
        limits, dt = self.limits, self.limits.dt_s
        low, high = np.minimum(rows[:-1], limits.lower), np.maximum(rows[:-1], limits.upper)
        self._within("position", np.maximum(low - rows[1:], rows[1:] - high), np.full(3, 1e-9))
        out = (rows[:-1] < limits.lower - 1e-9) | (rows[:-1] > limits.upper + 1e-9)
        velocity = np.diff(rows, axis=0) / dt
        self._within("velocity", np.abs(velocity) * np.where(out, 5.0, 1.0), limits.velocity * 1.002)
        for what, weights, span_s, usual, stopping in (
            ("acceleration", (1, -2, 1), 0.004, limits.acceleration, limits.stop_acceleration),
            ("jerk", (1, -3, 3, -1), 0.012, limits.jerk, 2 * limits.jerk),
        ):
            span = max(1, round(span_s / dt))
            order = len(weights) - 1
            n = len(rows) - order * span
            total = sum(weight * rows[k * span : k * span + n] for k, weight in enumerate(weights))
            # A difference that touches a stop may be as large as a stop's.
            touched = np.asarray(np.array([stops[k * span : k * span + n] for k in range(order + 1)]).any(axis=0))
            touched = touched if ramped else np.zeros(n, dtype=bool)
            allowed = np.where(touched[:, None], stopping, usual) * 1.002 + 8e-6 / (span * dt) ** order
            self._within(what, np.abs(np.asarray(total)) / (span * dt) ** order, allowed)

    def _within(self, what: str, values: Floats, allowed: Floats) -> None:
        if not (values <= allowed).all():
            row, joint = (int(i) for i in np.argwhere(~(values <= allowed))[0])
            limit = np.broadcast_to(allowed, values.shape)[row, joint]
            raise NotAllowedError(f"{what} {values[row, joint]:.6g} of {NAMES[joint]}, allowed {limit:.6g}")


class Episode:
    """One gate, one robot and their inputs."""

    def __init__(self, seed: int) -> None:
        self.random = np.random.default_rng(seed)
        dt_s = float(self.random.choice([0.01, 0.01, 0.01, 0.002]))
        self.limits = limits_at(dt_s)
        self.now = 10_000 * MS
        pose = self.random.uniform(-1.4, 1.4, 3)
        if self.random.random() < 0.2:
            pose[0] = 1.6  # outside its soft range
        self.checker = Checker(self.limits, pose)
        settings = SafetySettings(
            following=np.full(3, 0.1),
            emergency_timeout_ms=[None, 500.0][self.random.integers(2)],
            proposals_per_s=[None, 100.0][self.random.integers(2)],
        )
        mechanical = (np.full(3, -MECHANICAL), np.full(3, MECHANICAL))
        self.core = SafetyCore(self.limits, mechanical, EPOCH, self.now, settings)
        self.played_s = 0.0
        self.plan: tuple[int, Floats] | None = None
        self.proposals: list[Proposal] = []
        self.pushed_until = 0
        self.forbidden_until = self.now  # arming requests up to here must not arm
        self.latest = self.now
        self.counts: Counter[str] = Counter()

    @property
    def end(self) -> int:
        return len(self.checker.rows) - self.checker.reach

    @property
    def played(self) -> int:
        return min(int(self.played_s / self.limits.dt_s), self.end)

    def run(self, steps: int) -> None:
        for _ in range(steps):
            self.step()

    def step(self) -> None:
        """One period: the robot plays, the gate gets its inputs and answers, the checker judges."""
        passed = int(self.random.choice([10, 10, 10, 10, 30, 67]))
        self.played_s = self.played * self.limits.dt_s + passed * 1e-3 * (self.played < self.end)
        self.now += passed * MS
        if self.random.random() < 0.003:
            self.now += int(self.random.choice([-3000, 700, 3_600_000])) * MS
        before = self.core.state
        inputs = self.inputs()
        targets, state, faults = self.core.step(self.now, inputs)
        self.counts[state.value] += 1
        self.counts.update({f"fault {fault.code}" for fault in faults} if state is not before else ())
        self.judge(before, inputs, targets, state)
        self.latest = self.now

    def judge(self, before: State, inputs: Inputs, targets: Targets | None, state: State) -> None:
        if state is State.ARMED and before is not State.ARMED:
            request = inputs.word
            if before not in (State.DISARMED, State.HOLD, State.DISCONNECTED, State.ESTOP, State.STOPPING):
                raise NotAllowedError(f"armed out of {before}")
            if (
                request is None
                or not request.armed
                or request.captured_ns <= self.forbidden_until
                or inputs.arming_faults
            ):
                raise NotAllowedError("armed without an arming request of its own")
        if inputs.emergency and state is not State.ESTOP:
            raise NotAllowedError("pressed and not stopped")
        if state in (State.ESTOP, State.HOLD):
            self.forbidden_until = max(self.forbidden_until, self.now if state is State.ESTOP else 0)
        if targets is None:
            return
        self.counts["given"] += 1
        if State.ARMED not in (before, state):
            raise NotAllowedError(f"rows given while {before.value}")
        if state is not State.ARMED and targets.ramp_rows != len(targets.rows):
            raise NotAllowedError(f"rows other than a stop given while {state.value}")
        assert inputs.measured is not None
        if targets.first_index < inputs.measured.next_index:
            raise NotAllowedError("rows given that are played")
        proposal = inputs.proposal
        if state is State.ARMED:
            if proposal is None or proposal.epoch != EPOCH or not 0 <= self.now - proposal.captured_ns <= 250 * MS:
                raise NotAllowedError("rows given of another life or too old")
            if self.now < self.latest:
                raise NotAllowedError("rows given while the time goes back")
        self.checker.given(targets)

    def inputs(self) -> Inputs:
        random = self.random.random
        emergency = None if random() < 0.3 else random() < 0.01
        if self.core.state is State.ESTOP:
            emergency = [None, True, False, False][self.random.integers(4)]
        request = None
        if random() < (0.02 if self.core.state is State.ARMED else 0.4):
            armed = self.core.state is not State.ARMED or random() < 0.5
            age = int(self.random.choice([0, 0, 0, 100, 2000, -5000])) * MS
            request = ArmingRequest(self.now - age, "a person" if random() < 0.95 else "", armed, by_person=True)
        stop = Fault("test", "", "stop") if random() < 0.005 else None
        checks = (Fault("voltage", "", "low"),) if random() < 0.05 else ()
        measured = self.measured()
        return Inputs(measured, request, self.proposal(), stop, checks, emergency)

    def measured(self) -> Measured | None:
        played = self.played
        pose = self.checker.rows[self.checker.reach + played - 1]
        positions = pose + (0.2 if self.now < self.pushed_until else 0.0)
        if self.random.random() < 0.005:
            self.pushed_until = self.now + 150 * MS
        report = Measured(self.now, positions, pose, played >= self.end, played)
        if self.random.random() > 0.01:
            return report
        odd = [
            None,
            replace(report, captured_ns=self.now - 700 * MS),
            replace(report, captured_ns=self.now + 10**12),
            replace(report, positions=np.full(3, np.nan)),
            replace(report, commanded=np.full(3, np.nan)),
            replace(report, commanded=np.full(3, 1e9)),
            replace(report, positions=np.zeros(2)),
            replace(report, commanded=np.zeros((3, 3))),
            replace(report, next_index=-7),
            replace(report, next_index=10**9),
            replace(report, next_index=max(0, played - 30) if self.core.state is State.ARMED else played),
        ]
        return odd[self.random.integers(len(odd))]

    def proposal(self) -> Proposal | None:
        random = self.random.random
        if random() < 0.1:
            return None
        dt = self.limits.dt_s
        if self.plan is None or self.played >= self.plan[0] + len(self.plan[1]) or self.core.state is not State.ARMED:
            self.plan = (self.end, self.planned()) if self.played >= self.end else self.plan
        if self.plan is None:
            return None
        start, path = self.plan
        cover, ahead = round(0.3 / dt), round(longest_path_s(self.limits) / dt)
        first = start if self.played <= start else min(self.played + round(0.02 / dt), start + len(path))
        rows = path[first - start :][:cover]
        good = Proposal(self.now, EPOCH, NAMES, first, rows, path[first - start + len(rows) :][:ahead])
        if not len(rows):
            return None
        self.proposals = [*self.proposals[-20:], good]
        return good if random() < 0.9 else self.odd(good)

    def planned(self) -> Floats:
        """A movement from where the last ended, within the limits or a little beyond."""
        start = self.checker.rows[-1]
        reach = 1.45 if self.random.random() < 0.8 else 1.65
        path = straight_move(start, self.random.uniform(-reach, reach, 3), self.limits)
        if (np.abs(start) > 1.5).any() or self.random.random() < 0.2:
            slow = np.linspace(0, 1, 400)[:, None]
            path = start + (10 * slow**3 - 15 * slow**4 + 6 * slow**5) * (path[-1] - start)
        if self.random.random() < 0.3 and len(path) > 10:
            times = np.linspace(0, len(path) - 1, int(len(path) / self.random.uniform(0.7, 1.3)))
            path = np.stack([np.interp(times, np.arange(len(path)), joint) for joint in path.T], axis=1)
        return path

    def odd(self, good: Proposal) -> Proposal:
        r = self.random
        rows, ahead = good.rows.copy(), good.ahead
        row, joint = r.integers(len(rows)), r.integers(3)
        kind = r.integers(16)
        if kind < 4:
            rows[row, joint] = [np.nan, np.inf, -np.inf, 1e9][kind]
        elif kind < 8:
            rows[row:, joint] += r.normal() * 10.0 ** -r.integers(0, 6)
        elif kind == 8:
            rows = rows + r.normal(size=rows.shape) * 10.0 ** -r.integers(1, 7)
        elif kind == 9:
            return replace(good, rows=[rows[:, :2], rows[0], rows[:0], np.zeros((6000, 3))][r.integers(4)])
        elif kind == 10:
            return replace(good, ahead=[ahead[:0], ahead[: r.integers(5)], np.full((5, 3), np.nan)][r.integers(3)])
        elif kind == 11:
            return replace(good, joint_names=NAMES[:2], epoch=EPOCH)
        elif kind == 12:
            return replace(good, epoch=int(r.integers(4)))
        elif kind == 13:
            return replace(good, captured_ns=self.now + int(r.choice([-10_000, -300, 1, 10**6])) * MS)
        elif kind == 14:
            return self.proposals[r.integers(len(self.proposals))]
        else:
            return replace(good, first_index=int(good.first_index + r.choice([-(10**6), -40, -3, 3, 40, 10**9])))
        return replace(good, rows=rows)


def main() -> int:
    parser = argparse.ArgumentParser(description="Random steps of the safety gate, judged separately.")
    parser.add_argument("--steps", type=int, default=1_000_000)
    parser.add_argument("--seed", type=int, default=0)
    arguments = parser.parse_args()
    counts: Counter[str] = Counter()
    begun = time.monotonic()
    episodes = -(-arguments.steps // STEPS_PER_EPISODE)
    for number in range(episodes):
        episode = Episode(arguments.seed + number)
        try:
            episode.run(STEPS_PER_EPISODE)
        except (NotAllowedError, ArithmeticError, ValueError, IndexError, TypeError) as error:
            sys.stdout.write(f"seed {arguments.seed + number}: {type(error).__name__}: {error}\n")
            return 1
        counts += episode.counts
        if number % max(1, episodes // 100) == 0:
            steps = (number + 1) * STEPS_PER_EPISODE
            sys.stderr.write(f"{steps} steps, {time.monotonic() - begun:.0f} s\n")
    for what, count in sorted(counts.items()):
        sys.stdout.write(f"{count:9d}  {what}\n")
    sys.stdout.write(f"{episodes * STEPS_PER_EPISODE} steps, nothing given outside the limits\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
