"""Persons who perform, and what they perform: the truth of the evaluation's clips (thesis 6.7).

Performers are not the demonstrator whom the models learned from: other sizes and proportions, another seat, other
timing, more or less variation, elbows carried otherwise, a bent wrist.
World frame: that of the table, m (x forward, y left, z up).
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from paramove.action_space import PersonPlacement
from paramove.demonstrations import (
    POINT_NAMES,
    RESTING_SHOULDER,
    SAMPLE_RATE_HZ,
    UPWARD,
    ArmLengths,
    Demonstrator,
    Timing,
    Variation,
)
from paramove.documents import Floats
from paramove.hmm import minimum_jerk
from paramove.observation import ArmSizes

FIRST_SEED = 20_600
"""Models are trained with seeds 0 to 7."""
MEASURING_SHARE, MEASURING_SHOULDER = 0.03, 0.005
"""Greatest errors of the measured sizes, relative, and of the measured resting shoulder per axis, m."""
SWAY = 0.002
"""Of a person who sits still, m."""
SHOULDER, ELBOW, WRIST, KNUCKLE, INDEX = (
    POINT_NAMES.index(name) for name in ("shoulder", "elbow", "wrist", "knuckle", "index")
)


@dataclass(frozen=True)
class Performer:
    """A person.

    Attributes:
        sizes: of the arm, m. measured: the same as somebody measured them, with errors up to 3 %.
        shoulder: where the right shoulder rests, (3,), m. measured_shoulder: with errors up to 5 mm per axis.
        scale: of all movements, relative to the demonstrator's.
        demonstrator: arm, timing and variation before the scale is applied.
        swivel: angle about the line from shoulder to fingertip by which the elbow is carried higher, rad.
        wrist_offset: of the wrist from the straight line between elbow and fingertip, m.
    """

    sizes: ArmSizes
    measured: ArmSizes
    shoulder: Floats
    measured_shoulder: Floats
    scale: float
    demonstrator: Demonstrator
    swivel: float
    wrist_offset: float

    @property
    def placement(self) -> PersonPlacement:
        """From the demonstrator's frame to the world, without errors of measuring."""
        x, y, z = self.shoulder
        return PersonPlacement((float(x), float(y), float(z)), self.scale)


@dataclass(frozen=True)
class BodyMotion:
    """A person's body over time at 60 Hz, in the world, m.

    Attributes:
        points: the seven body points (T, 7, 3).
        holds: whether the hand holds an object, (T,).
    """

    points: Floats
    holds: NDArray[np.bool_]

    @property
    def poses(self) -> Floats:
        """Shoulder, elbow and tip of the index finger, (T, 9)."""
        return self.points[:, [SHOULDER, ELBOW, INDEX]].reshape(len(self.points), 9)

    @property
    def grip(self) -> Floats:
        """Middle of the fingers that grasp, (T, 3)."""
        return np.asarray(self.points[:, KNUCKLE:].mean(axis=1))


def draw_performer(rng: np.random.Generator) -> Performer:
    """A person unlike the demonstrator: lengths within 10 %, the shoulder within 3 cm of where such a person sits."""
    scale = float(rng.uniform(0.93, 1.07))
    usual = ArmLengths()
    upper, lower, hand = rng.uniform(0.975, 1.025, 3)
    lengths = ArmLengths(
        upper * usual.upper_arm, lower * usual.forearm, hand * usual.grasp, hand * usual.fingertip
    )  # fmt: skip
    default = ArmSizes()
    thick = scale * float(rng.uniform(0.92, 1.08))
    sizes = ArmSizes(
        upper_arm=scale * lengths.upper_arm,
        forearm=scale * lengths.forearm,
        hand=scale * lengths.fingertip,
        shoulder_radius=thick * default.shoulder_radius,
        elbow_radius=thick * default.elbow_radius,
        wrist_radius=thick * default.wrist_radius,
        hand_width=thick * default.hand_width,
        hand_thickness=thick * default.hand_thickness,
    )
    seat = RESTING_SHOULDER.copy()
    seat[2] = 0.07 + scale * (RESTING_SHOULDER[2] - 0.07)  # the table is as high for everybody
    shoulder = seat + rng.uniform(-1.0, 1.0, 3) * np.array([0.03, 0.03, 0.02])
    return Performer(
        sizes=sizes,
        measured=as_measured(sizes, rng),
        shoulder=shoulder,
        measured_shoulder=shoulder + rng.uniform(-MEASURING_SHOULDER, MEASURING_SHOULDER, 3),
        scale=scale,
        demonstrator=Demonstrator(lengths, _variation(rng), _timing(rng)),
        swivel=float(rng.uniform(-0.16, 0.16)),
        wrist_offset=float(rng.uniform(-0.014, 0.014)),
    )


def as_measured(sizes: ArmSizes, rng: np.random.Generator) -> ArmSizes:
    """The sizes with an error of up to 3 % each."""
    names = list(ArmSizes.__dataclass_fields__)
    errors = 1.0 + rng.uniform(-MEASURING_SHARE, MEASURING_SHARE, len(names))
    return replace(sizes, **{name: getattr(sizes, name) * error for name, error in zip(names, errors, strict=True)})


def in_person(points: Floats, person: Performer) -> Floats:
    """Body points (T, 21) of the demonstrator's frame as this person moves, in the world, (T, 7, 3)."""
    body = points.reshape(len(points), len(POINT_NAMES), 3).copy()
    tip, shoulder = body[:, INDEX], body[:, SHOULDER]
    axis = _unit(tip - shoulder)
    for joint in (ELBOW, WRIST):
        body[:, joint] = shoulder + _turned(body[:, joint] - shoulder, axis, person.swivel)
    lower = _unit(tip - body[:, ELBOW])
    aside = _unit(np.cross(lower, np.cross(UPWARD, lower) + 1e-9))
    body[:, WRIST] += person.wrist_offset / person.scale * aside
    return person.placement.in_world(body.reshape(len(body), -1)).reshape(body.shape)


def joined(
    parts: list[BodyMotion], rests_s: list[float], rng: np.random.Generator
) -> tuple[BodyMotion, list[tuple[float, float]]]:
    """Movements one after the other with rests before, between and after; and when each begins and ends, s.

    In a rest the arm goes from one base pose to the next; the body sways a little all the time.
    """
    points, holds = [], []
    spans: list[tuple[float, float]] = []
    frames = 0
    for number, rest in enumerate(rests_s):
        count = round(rest * SAMPLE_RATE_HZ)
        before = parts[number - 1].points[-1] if number else parts[0].points[0]
        after = parts[number].points[0] if number < len(parts) else parts[-1].points[-1]
        fraction = minimum_jerk(np.arange(count) / max(count, 1), 0.0, 1.0)[:, None, None]
        points.append(_keeping_lengths(before + fraction * (after - before), before))
        holds.append(np.zeros(count, dtype=np.bool_))
        frames += count
        if number < len(parts):
            spans.append((frames / SAMPLE_RATE_HZ, (frames + len(parts[number].points) - 1) / SAMPLE_RATE_HZ))
            points.append(parts[number].points)
            holds.append(parts[number].holds)
            frames += len(parts[number].points)
    whole = np.concatenate(points)
    return BodyMotion(whole + _sway(len(whole), rng)[:, None], np.concatenate(holds)), spans


def _keeping_lengths(points: Floats, like: Floats) -> Floats:
    """The elbow moved along the upper arm so that this is as long as in the pose `like` (7, 3). (T, 7, 3)."""
    length = float(np.linalg.norm(like[ELBOW] - like[SHOULDER]))
    corrected = points.copy()
    corrected[:, ELBOW] = points[:, SHOULDER] + length * _unit(points[:, ELBOW] - points[:, SHOULDER])
    return corrected


def _sway(n_frames: int, rng: np.random.Generator) -> Floats:
    """Slow displacement of the whole upper body, (T, 3), m."""
    times = np.arange(n_frames) / SAMPLE_RATE_HZ
    rates, phases = rng.uniform(0.15, 0.4, 3), rng.uniform(0.0, 2 * np.pi, 3)
    result: Floats = SWAY * np.sin(2 * np.pi * rates * times[:, None] + phases)
    return result


def _variation(rng: np.random.Generator) -> Variation:
    usual = Variation()
    more = rng.uniform(0.8, 1.3, 6)
    return Variation(
        miss=usual.miss * more[0],
        path=usual.path * more[1],
        base=usual.base * more[2],
        posture=usual.posture * more[3],
        swivel=usual.swivel * more[4],
        rate=usual.rate * more[5],
        sensor=0.0,
        growth=usual.growth,
        unevenness=usual.unevenness,
    )


def _timing(rng: np.random.Generator) -> Timing:
    """Whole movements 0.75 to 1.3 times as long, arriving and leaving at other phases."""
    usual = Timing()
    arrive = usual.arrive + float(rng.uniform(-0.045, 0.035))
    leave = usual.leave + float(rng.uniform(-0.03, 0.06))
    marks = np.interp(
        [usual.close, usual.closed, usual.release], [usual.arrive, usual.leave], [arrive, leave]
    )  # fmt: skip
    close, closed, release = (float(mark) for mark in marks)
    duration = usual.duration * float(rng.uniform(0.75, 1.3))
    return Timing(usual.depart, arrive, close, closed, release, leave, usual.home, duration)


def _unit(vectors: Floats) -> Floats:
    return np.asarray(vectors / np.linalg.norm(vectors, axis=-1, keepdims=True))


def _turned(vectors: Floats, axis: Floats, angle: float) -> Floats:
    """Vectors (T, 3) turned about unit axes (T, 3) by an angle, rad (Rodrigues)."""
    along = (vectors * axis).sum(axis=1, keepdims=True) * axis
    cos, sin = np.cos(angle), np.sin(angle)
    return np.asarray(along + cos * (vectors - along) + sin * np.cross(axis, vectors))
