"""Training sets on grids of targets, and the reaching model that moves the robot (thesis 4.2.1, 5.2.2)."""

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from paramove.demonstrations.arm import POINT_NAMES
from paramove.demonstrations.movement import TARGET_NAMES
from paramove.demonstrations.synthetic import FRAME, RESTING_SHOULDER, SAMPLE_RATE_HZ, Action, Demonstrator
from paramove.documents import Floats
from paramove.phmm import InterpolativePHMM, MovementDescription, ParameterGrid, stored_model
from paramove.source_code import code_digest


@dataclass(frozen=True)
class Demonstrations:
    """Movements with their labels.

    Attributes:
        sequences: body points over time, each (T_k, 21), m, in the frame of the description, 60 Hz.
        theta: target of each movement, shape (K, 3), m.
        description: action, point names, unit, frame, mean duration.
    """

    sequences: list[Floats]
    theta: Floats
    description: MovementDescription


def reaching_cuboid() -> ParameterGrid:
    """The eight targets of the robot's reaching model: 21 x 59.5 x 13.5 cm before the right shoulder.

    Scaled by 243 / 679.1 it holds the robot's working area (x 12-19 cm, y -12..+8 cm, 6-10 cm below the shoulder) but
    for its far edge, which only extrapolation reaches: a longer cuboid would have corners beyond the person's arm.
    """
    x, y, z = RESTING_SHOULDER
    return ParameterGrid.from_lines([x + 0.29, x + 0.50], [y - 0.345, y + 0.25], [z - 0.285, z - 0.15])


def demonstrations_at(
    targets: ArrayLike,
    rng: np.random.Generator,
    *,
    action: Action = "reaching",
    repetitions: int = 10,
    demonstrator: Demonstrator | None = None,
) -> Demonstrations:
    """`repetitions` movements to each target (M, 3), m, in the demonstrator's table frame."""
    person = demonstrator if demonstrator is not None else Demonstrator()
    theta = np.repeat(np.atleast_2d(np.asarray(targets, dtype=np.float64)), repetitions, axis=0)
    sequences = [person.demonstrate(action, target, rng) for target in theta]
    duration = float(np.mean([len(sequence) - 1 for sequence in sequences]) / SAMPLE_RATE_HZ)
    return Demonstrations(
        sequences, theta, MovementDescription(action, POINT_NAMES, "m", FRAME, TARGET_NAMES, duration)
    )


def reaching_grid_demonstrations(rng: np.random.Generator, *, repetitions: int = 10) -> Demonstrations:
    """Movements to the eight corners of `reaching_cuboid`."""
    return demonstrations_at(reaching_cuboid().points(), rng, repetitions=repetitions)


def train_reaching_model(
    seed: int = 0, *, n_states: int = 80, repetitions: int = 10, cache: Path | None = None
) -> InterpolativePHMM:
    """The 2 x 2 x 2 interpolative model of reaching, 80 states of 2 or 3 frames (thesis 5.2.2).

    Its description holds the progress of arrival and grasp. With `cache` the model is read from that file if it was
    made with the same arguments by the present code, and written there otherwise.
    """
    source = f"synthetic demonstrator, seed {seed}, {repetitions} repetitions, code {code_digest(__name__)}"
    model = InterpolativePHMM(n_states, 2, 3, resampled_frames=round(2.5 * n_states), residuals="independent")
    stored = stored_model(InterpolativePHMM, cache)
    if (
        stored is not None
        and stored.n_states == n_states
        and stored.description
        and stored.description.source == source
    ):
        return stored
    demonstrations = reaching_grid_demonstrations(np.random.default_rng(seed), repetitions=repetitions)
    model.fit(demonstrations.sequences, demonstrations.theta)
    arrival, grasp = grasp_states(model.means_)
    model.description = replace(
        demonstrations.description, source=source, arrival=arrival / (n_states - 1), grasp=grasp / (n_states - 1)
    )
    if cache is not None:
        model.save(cache)
    return model


def grasp_states(means: Floats) -> tuple[int, int]:
    """Last state with the hand open at the target, last with the object held, from 0, in all local models (G, N, 21).

    In the thesis these are states 37 and 45 of 80, counted from 1 (5.2.5).
    """
    index, thumb = POINT_NAMES.index("index"), POINT_NAMES.index("thumb")
    points = means.reshape(*means.shape[:2], len(POINT_NAMES), 3)
    aperture = np.linalg.norm(points[:, :, thumb] - points[:, :, index], axis=2)
    middle = int(aperture.mean(axis=0)[means.shape[1] // 4 : -means.shape[1] // 4].argmin()) + means.shape[1] // 4
    open_hand = (aperture > 0.97 * aperture.max(axis=1, keepdims=True)).all(axis=0)
    closest = aperture[:, middle : middle + 1]
    held = (aperture < closest + 0.1 * (aperture.max(axis=1, keepdims=True) - closest)).all(axis=0)
    arrival = int(np.flatnonzero(open_hand[:middle])[-1])
    after = np.flatnonzero(~held[middle:])
    return arrival, middle + int(after[0]) - 1
