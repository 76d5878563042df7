"""Motion blending: the redirect action, "take this object here and put it there", made of pointing (thesis 4.3).

A redirect action points at one position on the table, then at another; theta = (start u, start v, end u, end v). It is
blended from two pointing movements, either synthesised by a parametric HMM, as in the thesis, or demonstrated.
"""

from itertools import product

import numpy as np
from numpy.typing import ArrayLike

from paramove.alignment import warp
from paramove.demonstrations.arm import POINT_NAMES
from paramove.demonstrations.reaching import Demonstrations, demonstrations_at
from paramove.demonstrations.synthetic import FRAME, Demonstrator, Timing, table_place, table_targets
from paramove.documents import Floats
from paramove.hmm import checked_sequence, interpolate, minimum_jerk, resample
from paramove.phmm import InterpolativePHMM, MovementDescription, ParametricHMM

ALIGNED_FRAMES = 200
SMOOTHED_FRAMES = 7  # over which speed is measured; noise of a sensor is slower then
PARAMETER_NAMES = ("start_u", "start_v", "end_u", "end_v")
CROSSING = 0.36
"""Fraction of the whole movement between arriving at the first position and leaving the second."""
PAUSE = 0.12
"""Fraction of the crossing during which the hand rests at each of the two positions."""
STILLNESS = 0.1
"""A movement is at its position while it is slower than this fraction of its maximum speed."""


def blended(first: ArrayLike, second: ArrayLike, n_samples: int = 80) -> Floats:
    """Out as in the first movement, over to the second's position, back as in the second. (T_1, D), (T_2, D) -> (n, D).

    Both movements go out from a base pose, stay at a position and return. They are aligned by dynamic time warping of
    their phases, not of their points: they go to different positions. The weight of the second rises from 0 to 1 with
    minimum jerk while both are at their positions. Raises ValueError where a movement never stays or dimensions differ.
    """
    p, q = checked_sequence(first), checked_sequence(second)
    if p.shape[1] != q.shape[1]:
        raise ValueError(f"movements to blend have equally many dimensions, found {p.shape[1]} and {q.shape[1]}")
    p, q = resample(p, ALIGNED_FRAMES), resample(q, ALIGNED_FRAMES)
    phases = [phase(one) for one in (p, q)]
    alignment = warp(phases[0][:, None], phases[1][:, None], "B")  # which never halts one of the movements
    p, q = p[alignment.first], q[alignment.second]
    together = phases[0][alignment.first] + phases[1][alignment.second]
    arrived, leaves = np.searchsorted(together, [2.0, 4.0])
    progress = np.linspace(0.0, 1.0, n_samples)
    begin = float((1.0 - CROSSING) * arrived / (arrived + len(p) - leaves))
    end = begin + CROSSING
    positions = np.interp(progress, [0.0, begin, end, 1.0], [0.0, arrived, leaves - 1.0, len(p) - 1.0])
    rest = PAUSE * CROSSING
    weight = minimum_jerk(progress, begin + rest, end - rest)[:, None]
    return (1.0 - weight) * interpolate(p, positions) + weight * interpolate(q, positions)


def phase(movement: Floats) -> Floats:
    """0 to 1 going out, to 2 at the position, to 3 returning: by path length, at the position by time. Shape (T,).

    The position is where a movement (T, D) is slowest in its middle half. Raises ValueError if it is not still there.
    """
    reach = SMOOTHED_FRAMES // 2
    padded = np.pad(movement, ((reach, reach), (0, 0)), mode="edge")
    speed = np.linalg.norm(padded[2 * reach :] - padded[: -2 * reach], axis=1)
    moving = np.flatnonzero(speed >= STILLNESS * speed.max())
    quarter = len(movement) // 4
    stillest = quarter + int(speed[quarter:-quarter].argmin())
    before, after = moving[moving < stillest], moving[moving > stillest]
    if len(before) == 0 or len(after) == 0 or after[0] - before[-1] < 4:
        raise ValueError(
            f"a movement to blend goes out, stays at a position and returns; in the middle half it is never below "
            f"{STILLNESS:g} of its largest speed for three frames: demonstrate a longer stay"
        )
    arrived, leaves = int(before[-1]) + 1, int(after[0]) - 1
    length = np.cumsum(speed)
    out = (length - length[0]) / (length[arrived] - length[0])
    at_place = 1.0 + (np.arange(len(movement)) - arrived) / (leaves - arrived)
    back = 2.0 + (length - length[leaves]) / (length[-1] - length[leaves])
    number = np.arange(len(movement))
    return np.where(number < arrived, out, np.where(number <= leaves, at_place, back))


def corner_pairs(*, staying: bool = True) -> Floats:
    """From each corner of the table region to each, theta (16, 4); without staying at a corner (12, 4).

    Corrected: the corner set of 4.3 holds (0, 1), and there are 16 or 12 such pairs, not 10.
    """
    corners = list(product((0.0, 1.0), repeat=2))
    pairs = [(*start, *end) for start in corners for end in corners if staying or start != end]
    return np.array(pairs)


def nine_pairs() -> Floats:
    """Nine pairs over the 3 x 3 grid, theta (9, 4): each level of a component meets each of any other once.

    The orthogonal array of four factors with three levels: the fewest demonstrations that show every component at three
    levels without confounding any two.
    """
    rows = [(a, b, (a + b) % 3, (a + 2 * b) % 3) for a, b in product(range(3), repeat=2)]
    return 0.5 * np.array(rows, dtype=np.float64)


def redirect_from_model(pointing: ParametricHMM, theta: ArrayLike, n_samples: int = 80) -> Demonstrations:
    """Redirect movements for theta (K, 4), blended from prototypes of a pointing model with parameters (u, v) (4.3)."""
    pairs = checked_pairs(theta)
    samples = ALIGNED_FRAMES
    sequences = [
        blended(pointing.synthesize(pair[:2], samples), pointing.synthesize(pair[2:], samples), n_samples)
        for pair in pairs
    ]
    return Demonstrations(sequences, pairs, _described("blended from a pointing model"))


def redirect_demonstrations(
    theta: ArrayLike,
    rng: np.random.Generator,
    *,
    n_samples: int = 80,
    demonstrator: Demonstrator | None = None,
) -> Demonstrations:
    """Redirect movements for theta (K, 4), each blended from two pointing movements demonstrated for it."""
    pairs = checked_pairs(theta)
    sequences = []
    for pair in pairs:
        targets = table_place(pair.reshape(2, 2))
        sequences_of_pair = demonstrations_at(
            targets, rng, action="pointing", repetitions=1, demonstrator=demonstrator
        ).sequences
        sequences.append(blended(sequences_of_pair[0], sequences_of_pair[1], n_samples))
    return Demonstrations(sequences, pairs, _described("blended from pointing demonstrations"))


def train_pointing_model(seed: int = 0, *, n_states: int = 80, repetitions: int = 10) -> InterpolativePHMM:
    """The 2 x 2 interpolative model of pointing with parameters (u, v) that the blending starts from (4.3)."""
    targets, theta = table_targets(2, 2)
    demonstrations = demonstrations_at(targets, np.random.default_rng(seed), action="pointing", repetitions=repetitions)
    model = InterpolativePHMM(n_states, 2, 3, resampled_frames=round(2.5 * n_states), residuals="independent")
    return model.fit(demonstrations.sequences, np.repeat(theta, repetitions, axis=0))


def checked_pairs(theta: ArrayLike) -> Floats:
    """Theta of redirect actions as float64 (K, 4). Raises ValueError for another shape or values not finite."""
    pairs = np.atleast_2d(np.asarray(theta, dtype=np.float64))
    if pairs.ndim != 2 or pairs.shape[1] != len(PARAMETER_NAMES) or not np.isfinite(pairs).all():
        raise ValueError(f"theta of a redirect action has the finite components {PARAMETER_NAMES}, found {pairs}")
    return pairs


def _described(source: str) -> MovementDescription:
    usual = Timing()
    duration = usual.duration * (1.0 - usual.leave + usual.arrive) / (1.0 - CROSSING)
    return MovementDescription("redirect", POINT_NAMES, "m", FRAME, PARAMETER_NAMES, duration, source=source)
