"""A synthetic demonstrator: a seated person who reaches for objects or points at positions (thesis 4.2.1, 5.2.2).

Frame "demonstrator_table": x forward, y left, z up, metres; the origin lies on the table-top, at its near edge, in
front of the sternum. The resting right shoulder is at RESTING_SHOULDER.
"""

from dataclasses import dataclass, field, replace
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from paramove.demonstrations.arm import UPWARD, ArmLengths, ArmPath, body_points, swivel_towards
from paramove.documents import Floats
from paramove.hmm import minimum_jerk

Action = Literal["reaching", "pointing"]

FRAME = "demonstrator_table"
SAMPLE_RATE_HZ = 60.0
RESTING_STERNUM = np.array([-0.24, 0.0, 0.29])
RESTING_SHOULDER = np.array([-0.27, -0.18, 0.35])
RESTING_HAND = RESTING_SHOULDER + np.array([0.03, -0.08, -0.630])
COMFORTABLE_TARGET = RESTING_SHOULDER + np.array([0.36, 0.0, -0.26])


@dataclass(frozen=True)
class Variation:
    """How much one person's repetitions differ (standard deviations), at a comfortable target; more further away.

    Chosen to give the natural variation of thesis 4.2.4 and 4.2.5.

    Attributes:
        miss: of the reached position from the target per axis, m.
        path: of the control points of the path, m.
        base: of the resting hand, m.
        posture: of the shoulder, m.
        swivel: of the elbow angle, rad.
        rate: of the relative duration of each phase.
        sensor: of each coordinate in each frame, m.
        growth: fraction by which path, base, posture and swivel grow at the least comfortable targets.
        unevenness: standard deviation of the log of a whole repetition's variation at such targets.
    """

    miss: float = 0.005
    path: float = 0.028
    base: float = 0.020
    posture: float = 0.010
    swivel: float = 0.10
    rate: float = 0.06
    sensor: float = 0.001
    growth: float = 0.25
    unevenness: float = 0.35

    @classmethod
    def none(cls) -> "Variation":
        """The prototype movement without any variation."""
        return cls(*([0.0] * 9))


@dataclass(frozen=True)
class Timing:
    """Phases as fractions of the whole movement, so that the target is reached and released in the same HMM states.

    Of 80 states the 37th has reached the target with an open hand, the 45th still holds the object (thesis 5.2.5).
    """

    depart: float = 0.03
    arrive: float = 0.425
    close: float = 0.468
    closed: float = 0.505
    release: float = 0.554
    leave: float = 0.580
    home: float = 0.97
    duration: float = 3.2

    def varied(self, rng: np.random.Generator, rate: float) -> "Timing":
        """The same phases, each longer or shorter by a relative standard deviation."""
        marks = np.array(
            [0.0, self.depart, self.arrive, self.close, self.closed, self.release, self.leave, self.home, 1.0]
        )
        lengths = np.diff(marks) * np.clip(1.0 + rate * rng.standard_normal(8), 0.6, 1.4)
        fractions = (np.cumsum(lengths) / lengths.sum())[:-1]
        scale = float(np.clip(1.0 + rate * rng.standard_normal(), 0.7, 1.3))
        names = ("depart", "arrive", "close", "closed", "release", "leave", "home")
        marks_by_name = {name: float(mark) for name, mark in zip(names, fractions, strict=True)}
        return replace(self, duration=self.duration * scale, **marks_by_name)


@dataclass(frozen=True)
class Demonstrator:
    """The person. `demonstrate` gives one movement as body points over time."""

    lengths: ArmLengths = field(default_factory=ArmLengths)
    variation: Variation = field(default_factory=Variation)
    timing: Timing = field(default_factory=Timing)

    def demonstrate(self, action: Action, target: ArrayLike, rng: np.random.Generator) -> Floats:
        """One movement to `target` (3,), m, in the frame of this module. Shape (T, 21) at 60 Hz.

        Raises ValueError for an unknown action or a target out of reach.
        """
        position = np.asarray(target, dtype=np.float64)
        if action not in ("reaching", "pointing"):
            raise ValueError(f"the actions are 'reaching' and 'pointing', found {action!r}")
        if position.shape != (3,) or not 0.2 <= np.linalg.norm(position - RESTING_SHOULDER) <= 0.85:
            raise ValueError(
                "a target is a point 0.2 to 0.85 m from the resting shoulder "
                f"{RESTING_SHOULDER.tolist()} m, found {position.tolist()}"
            )
        timing = self.timing.varied(rng, self.variation.rate)
        path = self._path(action, position, timing, rng)
        points = body_points(path, self.lengths)
        return points + self.variation.sensor * rng.standard_normal(points.shape)

    def _path(self, action: Action, target: Floats, timing: Timing, rng: np.random.Generator) -> ArmPath:
        scale = self._variation_scale(target, rng)
        progress = np.linspace(0.0, 1.0, round(timing.duration * SAMPLE_RATE_HZ) + 1)
        nearness = at_target(progress, timing)
        pointing = nearness**0.4 if action == "pointing" else np.zeros_like(progress)
        reach = self.lengths.grasp + pointing * (self.lengths.fingertip - self.lengths.grasp)
        posture = scale * self.variation.posture * rng.standard_normal(3)
        lean = leaning(target, self.lengths.upper_arm + self.lengths.forearm + float(reach.max()))
        shoulder = RESTING_SHOULDER + posture + nearness[:, None] * lean
        sternum = RESTING_STERNUM + 0.7 * posture + nearness[:, None] * 0.35 * lean
        effector = self._hand_path(target, progress, timing, scale, rng)
        effector = kept_clear(effector, shoulder, target)
        shoulder = shoulder + overreach(effector - shoulder, self.lengths.upper_arm + self.lengths.forearm + reach)
        swivel = self._swivel(target, lean, nearness, scale, rng)
        aperture = grasping(progress, timing) if action == "reaching" else np.full_like(progress, RELAXED)
        facing = np.sqrt(nearness)
        return ArmPath(sternum, shoulder, effector, reach, swivel, aperture, pointing, facing)

    def _variation_scale(self, target: Floats, rng: np.random.Generator) -> float:
        """Factor on this repetition's variation; larger and less even the less comfortable the target."""
        discomfort = min(1.0, float(np.linalg.norm((target - COMFORTABLE_TARGET)[:2])) / 0.42)
        uneven = self.variation.unevenness * discomfort * rng.standard_normal()
        return float((1.0 + self.variation.growth * discomfort) * np.exp(np.clip(uneven, -0.8, 0.8)))

    def _hand_path(
        self, target: Floats, progress: Floats, timing: Timing, scale: float, rng: np.random.Generator
    ) -> Floats:
        """Out along a raised arc and back along a similar one. Shape (T, 3)."""
        base = RESTING_HAND + scale * self.variation.base * np.clip(rng.standard_normal(3), -1.5, 1.5)
        reached = target + self.variation.miss * rng.standard_normal(3)
        sway = [scale * self.variation.path * rng.standard_normal(3) for _ in range(3)]
        out = arc(base, reached, sway[0], sway[1], minimum_jerk(progress, timing.depart, timing.arrive))
        back = arc(base, reached, sway[0], sway[2], 1.0 - minimum_jerk(progress, timing.leave, timing.home))
        return np.where((progress < timing.leave)[:, None], out, back)

    def _swivel(self, target: Floats, lean: Floats, nearness: Floats, scale: float, rng: np.random.Generator) -> Floats:
        """Elbow angle: hanging back at rest, towards `usual_elbow` at the target. Shape (T,)."""
        at_rest = 0.25
        at_the_target = swivel_towards(usual_elbow(target), RESTING_SHOULDER + lean, target)
        noise = scale * self.variation.swivel * rng.standard_normal(2)
        result: Floats = (1.0 - nearness) * (at_rest + noise[0]) + nearness * (at_the_target + noise[1])
        return result


RELAXED, OPEN, CLOSED = 0.055, 0.100, 0.035  # distance between thumb and index finger, m


ELBOW_AT_COMFORT = RESTING_SHOULDER + np.array([0.045, -0.185, -0.165])
ELBOW_PER_TARGET = np.array([[0.55, 0.15, 0.00], [0.00, 0.15, 0.00], [0.10, 0.00, 0.25]])


def table_targets(columns: int, rows: int, height: float = 0.07) -> tuple[Floats, Floats]:
    """A grid over 80 x 30 cm of the table (thesis 4.2.1), `height` above it, and its coordinates (u, v) in [0, 1].

    u runs from the person's left to the right, v away from the person. Shapes (M, 3), m, and (M, 2).
    """
    u, v = np.meshgrid(np.linspace(0.0, 1.0, columns), np.linspace(0.0, 1.0, rows), indexing="ij")
    coordinates = np.stack([u, v], axis=-1).reshape(-1, 2)
    return table_place(coordinates, height), coordinates


def table_place(coordinates: ArrayLike, height: float = 0.07) -> Floats:
    """The position (..., 3), m, of coordinates (u, v) (..., 2) on the table region of `table_targets`."""
    u, v = np.moveaxis(np.asarray(coordinates, dtype=np.float64), -1, 0)
    x, y, _ = RESTING_SHOULDER
    return np.stack([x + 0.20 + 0.30 * v, y + 0.40 - 0.80 * u, np.full_like(u, height)], axis=-1)


def usual_elbow(target: Floats) -> Floats:
    """The elbow's preferred position: it follows the target forward, to the left and up, only partly. (3,)."""
    result: Floats = ELBOW_AT_COMFORT + ELBOW_PER_TARGET @ (target - COMFORTABLE_TARGET)
    return result


def at_target(progress: Floats, timing: Timing) -> Floats:
    """How near the hand is to the target, 0 at rest, 1 at the target. Shape (T,)."""
    out = minimum_jerk(progress, timing.depart, timing.arrive)
    # The polynomial may exceed 1 by rounding, and roots are taken of what is returned.
    return np.maximum(out * (1.0 - minimum_jerk(progress, timing.leave, timing.home)), 0.0)


def grasping(progress: Floats, timing: Timing) -> Floats:
    """Distance of thumb and index finger: opens on approach, closes at the target, releases, relaxes. Shape (T,)."""
    opening = minimum_jerk(progress, timing.depart, 0.75 * timing.arrive)
    closing = minimum_jerk(progress, timing.close, timing.closed)
    releasing = minimum_jerk(progress, timing.release, timing.release + 0.05)
    relaxing = minimum_jerk(progress, timing.leave + 0.10, timing.home)
    aperture = RELAXED + (OPEN - RELAXED) * opening + (CLOSED - OPEN) * closing
    return aperture + (OPEN - CLOSED) * releasing + (RELAXED - OPEN) * relaxing


def arc(base: Floats, reached: Floats, sway_low: Floats, sway_high: Floats, progress: Floats) -> Floats:
    """Bezier curve from the hanging hand out to the side, over the table's edge, and down to the target. (T, 3)."""
    lifted = RESTING_SHOULDER + np.array([0.05, -0.40, 0.0]) + 0.15 * (reached - COMFORTABLE_TARGET) + sway_low
    away = (RESTING_SHOULDER - reached) * np.array([1.0, 1.0, 0.0])
    above = reached + 0.10 * away + 0.20 * UPWARD + sway_high
    s = progress[:, None]
    result: Floats = (1 - s) ** 3 * base + 3 * s * (1 - s) ** 2 * lifted + 3 * s**2 * (1 - s) * above + s**3 * reached
    return result


def leaning(target: Floats, arm_length: float) -> Floats:
    """Displacement of the shoulder at the target: a little always, more where the arm alone is too short. (3,)."""
    line = target - RESTING_SHOULDER
    distance = float(np.linalg.norm(line))
    width = 0.008
    further = width * float(np.log1p(np.exp((distance - 0.99 * arm_length) / width)))
    result: Floats = (0.006 + further) * line / distance
    return result


def kept_clear(effector: Floats, shoulder: Floats, target: Floats) -> Floats:
    """The path with positions too near to the shoulder for a bent arm moved outward; the target stays. (T, 3)."""
    width = 0.03
    minimum = min(0.26, float(np.linalg.norm(target - shoulder, axis=1).min()) - 2.0 * width)
    line = effector - shoulder
    distance = np.linalg.norm(line, axis=1)
    beyond = distance - minimum
    softened = np.where(beyond > width, beyond, np.clip(beyond + width, 0.0, None) ** 2 / (4.0 * width))
    result: Floats = shoulder + line * ((minimum + softened) / distance)[:, None]
    return result


def overreach(line: Floats, arm_length: Floats) -> Floats:
    """How far the shoulder must follow the hand so that the arm stays a little bent. Shape (T, 3)."""
    distance = np.linalg.norm(line, axis=1)
    excess = np.clip(distance - 0.992 * arm_length, 0.0, None)
    result: Floats = line * (excess / distance)[:, None]
    return result
