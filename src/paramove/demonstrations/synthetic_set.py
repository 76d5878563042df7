"""Takes made by the synthetic demonstrator, for use without motion capture."""

from __future__ import annotations

import numpy as np

from paramove.demonstrations.reaching import demonstrations_at
from paramove.demonstrations.synthetic import SAMPLE_RATE_HZ, Action, table_targets
from paramove.demonstrations.writing import Label, Take

SUBJECT = "synthetic"


def synthetic_takes(
    action: Action, columns: int, rows: int, repetitions: int, seed: int
) -> tuple[list[Take], tuple[str, ...]]:
    """Movements to a grid of targets over 80 x 30 cm of the table (`table_targets`), and the parameters' names."""
    targets, _ = table_targets(columns, rows)
    demonstrations = demonstrations_at(targets, np.random.default_rng(seed), action=action, repetitions=repetitions)
    about = demonstrations.description
    takes = []
    for number, (sequence, theta) in enumerate(zip(demonstrations.sequences, demonstrations.theta, strict=True)):
        label = Label(0, len(sequence), action, tuple(theta.tolist()), SUBJECT, number % repetitions)
        time = np.arange(len(sequence)) / SAMPLE_RATE_HZ
        positions = sequence.reshape(len(sequence), -1, 3)
        takes.append(Take(f"{action}.mcap", time, positions, about.point_names, about.frame, (label,)))
    return takes, about.parameter_names
