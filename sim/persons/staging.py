"""Movements with several stops: from the base pose to one place after the other, and back (thesis 6.7.1.3 to 6.7.3).

Frame: the demonstrator's table frame, m (`paramove.demonstrations.synthetic`). The demonstrator's own movements have
one stop; pouring, taking an object elsewhere and dual pointing are staged here with the same arm, arcs and variation.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from paramove.demonstrations import (
    CLOSED,
    OPEN,
    RELAXED,
    RESTING_HAND,
    RESTING_SHOULDER,
    RESTING_STERNUM,
    SAMPLE_RATE_HZ,
    UPWARD,
    ArmPath,
    Demonstrator,
    arc,
    body_points,
    kept_clear,
    leaning,
    overreach,
    swivel_towards,
    usual_elbow,
)
from paramove.documents import Floats
from paramove.hmm import minimum_jerk

SWIVEL_AT_REST = 0.25
USUAL_DURATION_S = 3.2
"""Of the demonstrator's movements; the times of stops hold for it and scale with a person's own duration."""


@dataclass(frozen=True)
class Stop:
    """A place where the hand stays.

    Attributes:
        place: of the fingertip where the hand points, else of the middle of the grasping fingers, (3,), m.
        travel_s: on the way there.
        stay_s: at the place.
        lift: height of the arc on the way from another stop, m.
        pointing: the hand points; otherwise it grasps.
        holds: whether it holds an object when it leaves.
    """

    place: Floats
    travel_s: float = 1.25
    stay_s: float = 0.5
    lift: float = 0.08
    pointing: bool = True
    holds: bool = False


@dataclass(frozen=True)
class StagedMovement:
    """A movement at 60 Hz.

    Attributes:
        points: body points (T, 21), m.
        arrives_s, leaves_s: when each stop is reached and left, (stops,).
        holds: whether an object is held in each frame, (T,).
    """

    points: Floats
    arrives_s: Floats
    leaves_s: Floats
    holds: NDArray[np.bool_]

    @property
    def duration_s(self) -> float:
        """From leaving the base pose to being there again."""
        return (len(self.points) - 1) / SAMPLE_RATE_HZ


def staged(
    stops: Sequence[Stop], person: Demonstrator, rng: np.random.Generator, back_s: float = 1.25
) -> StagedMovement:
    """One movement through all stops and back in `back_s`. Raises ValueError without stops or where one is too far."""
    if not stops:
        raise ValueError("a staged movement has at least one stop, found none")
    times, travels = _timed(stops, person, rng, back_s)
    fractions = [minimum_jerk(times, start, end) for start, end in travels]
    unevenness = float(np.exp(np.clip(person.variation.unevenness * 0.5 * rng.standard_normal(), -0.8, 0.8)))
    reach = np.array([_reach(stop, person) for stop in stops])
    lower = person.lengths.forearm
    posture = unevenness * person.variation.posture * rng.standard_normal(3)
    reached = [stop.place + person.variation.miss * rng.standard_normal(3) for stop in stops]
    leans = [leaning(place, person.lengths.upper_arm + lower + far) for place, far in zip(reached, reach, strict=True)]
    lean = _through(fractions, np.array([np.zeros(3), *leans, np.zeros(3)]))
    shoulder = RESTING_SHOULDER + posture + lean
    effector = kept_clear(_hand_path(stops, reached, fractions, person, unevenness, rng), shoulder, _nearest(reached))
    usual = person.lengths.grasp
    along = _through(fractions, np.array([usual, *reach, usual]))
    shoulder = shoulder + overreach(effector - shoulder, person.lengths.upper_arm + lower + along)
    pointing = _through(fractions, np.array([0.0, *(float(stop.pointing) for stop in stops), 0.0]))
    out_of_rest = _through(fractions, np.array([0.0, *(1.0 for _ in stops), 0.0]))
    aperture, holds = _grip(stops, times, travels)
    swivels = [
        swivel_towards(usual_elbow(place), RESTING_SHOULDER + add, place)
        for place, add in zip(reached, leans, strict=True)
    ]
    noise = unevenness * person.variation.swivel * rng.standard_normal(len(stops) + 1)
    rest = SWIVEL_AT_REST + noise[0]
    swivel = _through(fractions, np.array([rest, *(np.array(swivels) + noise[1:]), rest]))
    sternum = RESTING_STERNUM + 0.7 * posture + 0.35 * lean
    facing = np.sqrt(np.clip(out_of_rest, 0.0, 1.0))
    points = body_points(
        ArmPath(sternum, shoulder, effector, along, swivel, aperture, pointing, facing), person.lengths
    )
    points = points + person.variation.sensor * rng.standard_normal(points.shape)
    arrives = np.array([end for _, end in travels[:-1]])
    leaves = np.array([start for start, _ in travels[1:]])
    return StagedMovement(points, arrives, leaves, holds)


def _timed(
    stops: Sequence[Stop], person: Demonstrator, rng: np.random.Generator, back_s: float
) -> tuple[Floats, list[tuple[float, float]]]:
    """Times (T,) of the frames, and beginning and end of every path in s: to each stop, and back."""
    tempo = person.timing.duration / USUAL_DURATION_S
    travels = []
    now = 0.10 * tempo
    for stop in stops:
        length, stay = tempo * np.array([stop.travel_s, stop.stay_s]) * _uneven(rng, person.variation.rate, 2)
        travels.append((now, now + float(length)))
        now += float(length + stay)
    end = now + float(back_s * tempo * _uneven(rng, person.variation.rate, 1)[0])
    travels.append((now, end))
    n_frames = round((end + 0.10 * tempo) * SAMPLE_RATE_HZ) + 1
    return np.arange(n_frames) / SAMPLE_RATE_HZ, travels


def _uneven(rng: np.random.Generator, rate: float, count: int) -> Floats:
    result: Floats = np.clip(1.0 + rate * rng.standard_normal(count), 0.7, 1.3)
    return result


def _reach(stop: Stop, person: Demonstrator) -> float:
    return person.lengths.fingertip if stop.pointing else person.lengths.grasp


def _through(fractions: Sequence[Floats], values: Floats) -> Floats:
    """From the first value to the last, each fraction leading from one to the next. (paths + 1, ...) -> (T, ...)."""
    steps = np.diff(values, axis=0)
    result: Floats = values[0] + np.tensordot(np.stack(fractions, axis=1), steps, axes=1)
    return result


def _nearest(places: Sequence[Floats]) -> Floats:
    distances = [float(np.linalg.norm(place - RESTING_SHOULDER)) for place in places]
    return places[int(np.argmin(distances))]


def _hand_path(
    stops: Sequence[Stop],
    reached: Sequence[Floats],
    fractions: Sequence[Floats],
    person: Demonstrator,
    unevenness: float,
    rng: np.random.Generator,
) -> Floats:
    """Out along the demonstrator's arc, over lower arcs from stop to stop, and back. Shape (T, 3)."""
    variation = person.variation
    base = RESTING_HAND + unevenness * variation.base * np.clip(rng.standard_normal(3), -1.5, 1.5)
    sway = unevenness * variation.path * rng.standard_normal((len(stops) + 2, 3))
    path = arc(base, reached[0], sway[0], sway[1], fractions[0])
    for number in range(1, len(stops)):
        s = fractions[number][:, None]
        bump = 16.0 * s**2 * (1.0 - s) ** 2
        path = path + s * (reached[number] - reached[number - 1])
        path = path + bump * (stops[number].lift * UPWARD + 0.5 * sway[number + 1])
    back = arc(base, reached[-1], sway[0], sway[-1], 1.0 - fractions[-1])
    return np.where((fractions[-1] > 0.0)[:, None], back, path)


def _grip(
    stops: Sequence[Stop], times: Floats, travels: Sequence[tuple[float, float]]
) -> tuple[Floats, NDArray[np.bool_]]:
    """Distance of thumb and index finger, and whether an object is held. Shapes (T,)."""
    aperture = np.full_like(times, RELAXED)
    holds = np.zeros(len(times), dtype=np.bool_)
    now = RELAXED
    held = False
    for number, stop in enumerate(stops):
        (start, arrives), (leaves, _) = travels[number], travels[number + 1]
        if not stop.pointing and not held:
            aperture += (OPEN - now) * minimum_jerk(times, start, 0.25 * start + 0.75 * arrives)
            now = OPEN
        middle = 0.5 * (arrives + leaves)
        if stop.holds != held:
            aperture_then = CLOSED if stop.holds else OPEN
            aperture += (aperture_then - now) * minimum_jerk(times, arrives, middle + 0.05)
            holds[times >= middle] = stop.holds
            now, held = aperture_then, stop.holds
    start, end = travels[-1]
    aperture += (RELAXED - now) * minimum_jerk(times, start + 0.1, end)
    return aperture, holds
