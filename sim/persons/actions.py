"""Training movements of the actions of chapter 6: the demonstrations for the models (thesis 6.4.1, 6.7).

All are made by the default demonstrator in its table frame, m. The performances that are tracked are made by other
persons, with other timing and habits (`sim.persons.performers`), or were recorded.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike, NDArray

from paramove.action_space import arm_poses
from paramove.demonstrations import (
    FRAME,
    RESTING_SHOULDER,
    SAMPLE_RATE_HZ,
    ArmLengths,
    Demonstrations,
    Demonstrator,
    corner_pairs,
    demonstrations_at,
    nine_pairs,
    phase,
    table_place,
    table_targets,
)
from paramove.documents import Floats
from paramove.hmm import minimum_jerk, resample
from paramove.observation import POSE_POINTS, ArmSizes, fitted_poses
from paramove.phmm import MovementDescription
from sim.persons.staging import Stop, staged

PLACE_NAMES = ("u", "v")
PAIR_NAMES = ("a_u", "a_v", "b_u", "b_v")

BOX_PLACE = np.array([0.34, -0.05, 0.21])
"""Middle of the grasping fingers when they put an object on the box, or take it from there (6.7.2)."""
POT_PLACE = np.array([0.24, -0.10, 0.23])
"""Of the fingers while they pour into the teapot (6.7.1.4)."""
BOX_SPREAD = np.array([0.025, 0.025, 0.008])
"""The place on the box is "modeled as noise" (6.7.2): its standard deviations, m."""

EYE = RESTING_SHOULDER + np.array([0.09, 0.18, 0.24])
FAR_DISTANCE = 1.6
FAR_ORIGIN = RESTING_SHOULDER + np.array([FAR_DISTANCE, 0.70, -0.30])
FAR_SPAN = np.array([1.40, 0.80])
"""The plane in front of the person: 1.4 m to the right and 0.8 m up from its origin (6.7.1.3)."""
FAR_REACH = 0.90
"""Distance of the fingertip from the shoulder when pointing far, as a fraction of the arm's length."""
FOLD_START, FOLD_END = 1.3, 1.7
"""Phases (1 to 2 at the place) where the first part of pointing ends, and where withdrawing begins (6.7.3)."""
CROSSING_S, CROSSING_REST = 1.5, 0.18


def far_place(coordinates: ArrayLike) -> Floats:
    """The place (..., 3), m, of coordinates (u, v) (..., 2) on the plane in front of the person (6.7.1.3)."""
    u, v = np.moveaxis(np.asarray(coordinates, dtype=np.float64), -1, 0)
    x, y, z = FAR_ORIGIN
    return np.stack([np.full_like(u, x), y - FAR_SPAN[0] * u, z + FAR_SPAN[1] * v], axis=-1)


def fingertip_towards(target: Floats, lengths: ArmLengths) -> Floats:
    """Where a person with `lengths` holds the fingertip to point at a far target (3,): before the eye. (3,), m."""
    reach = FAR_REACH * (lengths.upper_arm + lengths.forearm + lengths.fingertip)
    line = (target - EYE) / np.linalg.norm(target - EYE)
    offset = EYE - RESTING_SHOULDER
    middle = float(offset @ line)
    along = -middle + float(np.sqrt(middle**2 - offset @ offset + reach**2))
    return np.asarray(EYE + along * line)


def pouring_stops(place: Floats, pot: Floats) -> list[Stop]:
    """Take the glass, pour into the teapot, put the glass back (6.7.1.4); places (3,), m."""
    return [
        Stop(place, 1.25, 0.40, pointing=False, holds=True),
        Stop(pot, 1.00, 1.10, lift=0.10, pointing=False, holds=True),
        Stop(place, 1.00, 0.45, lift=0.08, pointing=False),
    ]


def carrying_stops(first: Floats, second: Floats) -> list[Stop]:
    """Take an object at the first place and put it at the second (6.7.2); places (3,), m."""
    return [
        Stop(first, 1.25, 0.45, pointing=False, holds=True),
        Stop(second, 0.95, 0.45, lift=0.10, pointing=False),
    ]


def pointing(seed: int = 0, *, columns: int = 5, rows: int = 3, repetitions: int = 4) -> Demonstrations:
    """Pointing at the table, theta (u, v) (6.7.1.1, 6.7.1.2). Poses (T, 9) at 60 Hz."""
    targets, places = table_targets(columns, rows)
    demonstrated = demonstrations_at(targets, np.random.default_rng(seed), action="pointing", repetitions=repetitions)
    poses = [arm_poses(sequence) for sequence in demonstrated.sequences]
    return _described("pointing", poses, np.repeat(places, repetitions, axis=0), PLACE_NAMES)


def pointing_far(seed: int = 1, *, columns: int = 5, rows: int = 3, repetitions: int = 4) -> Demonstrations:
    """Pointing at the plane in front of the person, theta (u, v) of `far_place` (6.7.1.3)."""

    def stops(theta: Floats, rng: np.random.Generator) -> list[Stop]:
        return [Stop(fingertip_towards(far_place(theta), ArmLengths()))]

    return _staged_raster("pointing_far", stops, np.random.default_rng(seed), (columns, rows), repetitions)


def pouring(seed: int = 2, *, columns: int = 5, rows: int = 3, repetitions: int = 4) -> Demonstrations:
    """Pouring a glass of water into the teapot, theta (u, v) of the glass (6.7.1.4)."""

    def stops(theta: Floats, rng: np.random.Generator) -> list[Stop]:
        return pouring_stops(table_place(theta), POT_PLACE + 0.5 * BOX_SPREAD * rng.standard_normal(3))

    return _staged_raster("pouring", stops, np.random.default_rng(seed), (columns, rows), repetitions)


def table_to_box(seed: int = 3, *, columns: int = 5, rows: int = 3, repetitions: int = 4) -> Demonstrations:
    """A of 6.7.2: taking an object from the table-top, theta (u, v), and placing it on the box."""

    def stops(theta: Floats, rng: np.random.Generator) -> list[Stop]:
        return carrying_stops(table_place(theta), BOX_PLACE + BOX_SPREAD * rng.standard_normal(3))

    return _staged_raster("table_to_box", stops, np.random.default_rng(seed), (columns, rows), repetitions)


def box_to_table(seed: int = 4, *, columns: int = 5, rows: int = 3, repetitions: int = 4) -> Demonstrations:
    """B of 6.7.2: taking an object from the box and placing it on the table-top, theta (u, v)."""

    def stops(theta: Floats, rng: np.random.Generator) -> list[Stop]:
        return carrying_stops(BOX_PLACE + BOX_SPREAD * rng.standard_normal(3), table_place(theta))

    return _staged_raster("box_to_table", stops, np.random.default_rng(seed), (columns, rows), repetitions)


def point(seed: int = 5, *, columns: int = 5, rows: int = 3, repetitions: int = 4) -> Demonstrations:
    """A of 6.7.3: from the base pose until the hand has reached the place, theta (u, v): cut from pointing."""
    demonstrated = pointing(seed, columns=columns, rows=rows, repetitions=repetitions)
    return _cut("point", demonstrated, lambda phases: phases <= FOLD_START)


def withdraw(seed: int = 6, *, columns: int = 5, rows: int = 3, repetitions: int = 4) -> Demonstrations:
    """C of 6.7.3: from the place, theta (u, v), back to the base pose: cut from pointing."""
    demonstrated = pointing(seed, columns=columns, rows=rows, repetitions=repetitions)
    return _cut("withdraw", demonstrated, lambda phases: phases >= FOLD_END)


def redirect(seed: int = 7, *, extra: int = 24, repetitions: int = 2) -> Demonstrations:
    """B of 6.7.3: from one place to another, theta (a, b), each (u, v): blended from two pointing movements (4.3).

    For all pairs of corners, for nine pairs of the 3 x 3 grid and for `extra` pairs drawn anywhere. Blending
    shortens the arm where the places are far apart; its elbow is then moved as in 6.6.1.2.
    """
    rng = np.random.default_rng(seed)
    pairs = np.concatenate([corner_pairs(), nine_pairs(), rng.random((extra, 4))])
    theta = np.repeat(pairs, repetitions, axis=0)
    n_frames = round(CROSSING_S * SAMPLE_RATE_HZ) + 1
    weight = minimum_jerk(np.linspace(0.0, 1.0, n_frames), CROSSING_REST, 1.0 - CROSSING_REST)[:, None]
    sequences = []
    for pair in theta:
        demonstrated = demonstrations_at(
            table_place(pair.reshape(2, 2)), rng, action="pointing", repetitions=1
        ).sequences
        first, second = (resample(_at_place(arm_poses(sequence)), n_frames) for sequence in demonstrated)
        sequences.append(fitted_poses((1.0 - weight) * first + weight * second, ArmSizes()))
    return _described("redirect", sequences, theta, PAIR_NAMES)


SHOWN: dict[str, Callable[[], Demonstrations]] = {
    "pointing": pointing,
    "pointing_far": pointing_far,
    "pouring": pouring,
    "table_to_box": table_to_box,
    "box_to_table": box_to_table,
    "point": point,
    "redirect": redirect,
    "withdraw": withdraw,
}
"""Training movements by the name of the action."""


def _at_place(poses: Floats) -> Floats:
    """The part of a pointing movement at its place."""
    phases = phase(poses)
    return poses[(phases >= FOLD_START - 0.2) & (phases <= FOLD_END + 0.2)]


def _cut(action: str, demonstrated: Demonstrations, selected: Callable[[Floats], NDArray[np.bool_]]) -> Demonstrations:
    sequences = [poses[selected(phase(poses))] for poses in demonstrated.sequences]
    return _described(action, sequences, demonstrated.theta, PLACE_NAMES)


def _staged_raster(
    action: str,
    stops: Callable[[Floats, np.random.Generator], list[Stop]],
    rng: np.random.Generator,
    size: tuple[int, int],
    repetitions: int,
) -> Demonstrations:
    person = Demonstrator()
    theta = np.repeat(table_targets(*size)[1], repetitions, axis=0)
    sequences = [arm_poses(staged(stops(one, rng), person, rng).points) for one in theta]
    return _described(action, sequences, theta, PLACE_NAMES)


def _described(action: str, sequences: list[Floats], theta: Floats, names: tuple[str, ...]) -> Demonstrations:
    duration = float(np.mean([len(sequence) - 1 for sequence in sequences]) / SAMPLE_RATE_HZ)
    description = MovementDescription(action, POSE_POINTS, "m", FRAME, names, duration, rate_hz=SAMPLE_RATE_HZ)
    return Demonstrations(sequences, np.asarray(theta, dtype=np.float64), description)
