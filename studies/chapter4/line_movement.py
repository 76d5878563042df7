"""Linear PHMMs of the synthetic parametric movement: figures 4.2 to 4.6 (thesis 4.1.1)."""

from __future__ import annotations

import time
from dataclasses import dataclass
from typing import Any

import numpy as np

from paramove.documents import Floats
from paramove.hmm import TrainingOptions
from paramove.phmm import LinearPHMM
from studies.chapter2.movement import PARAMETER_FRACTIONS, demonstration, prototype

BOUND, SEQUENCES, PROGRESSION = 0.25, 10, 0.3
PARAMETERS = (0.25, 0.0, -0.25)
ITERATIONS, FLOOR = 10, 0.002
SAMPLES = 200
THESIS_TRAINING_S = 50.0


@dataclass(frozen=True)
class LineFigure:
    """A figure of 4.1.1.

    Attributes:
        number, states, frames: as many frames per sequence as leave 4.5 per state.
        progression: how much the progression rates of the training sequences differ.
        thesis: what the thesis reports.
    """

    number: str
    states: int
    frames: int
    progression: float
    thesis: str


FIGURES = (
    LineFigure("4.3", 21, 94, PROGRESSION, "very similar to the true prototypes"),
    LineFigure("4.4", 6, 28, PROGRESSION, "approximates the true prototypes only coarsely"),
    LineFigure("4.5", 30, 136, PROGRESSION, "slightly distorted through the different progression rates"),
    LineFigure("4.6", 30, 136, 0.0, "as 4.5, of movements with the same progression rate"),
)


def trained_line(figure: LineFigure, seed: int) -> LinearPHMM:
    """The linear PHMM of a figure: 3 to 6 frames per state, 10 iterations of EM, no prior (4.1.1)."""
    rng = np.random.default_rng([seed, figure.states])
    parameters = BOUND * np.repeat(PARAMETER_FRACTIONS, SEQUENCES // len(PARAMETER_FRACTIONS))
    sequences = [demonstration(float(p), figure.frames, rng, progression=figure.progression) for p in parameters]
    options = TrainingOptions(max_iterations=ITERATIONS, tolerance=0.0, floor_deviation=FLOOR)
    model = LinearPHMM(figure.states, 3, 6, options=options, smoothness=None, residuals="independent")
    return model.fit(sequences, parameters)


def measured_line(seed: int) -> dict[str, Any]:
    """Per figure the distance of the synthesised from the true movements, and the seconds of a training.

    The distance is the maximum over all samples from the true curve, as a fraction of the bound; the first training
    compiles and is not timed.
    """
    values: dict[str, list[float]] = {}
    curves: dict[str, list[list[list[float]]]] = {}
    for figure in FIGURES:
        model = trained_line(figure, seed)
        made = [model.synthesize([p], SAMPLES, path="linear") for p in PARAMETERS]
        values[f"distance_{figure.number}"] = [
            distance_from_curve(one, p) for one, p in zip(made, PARAMETERS, strict=True)
        ]
        curves[figure.number] = [one.round(5).tolist() for one in made]
    began = time.perf_counter()
    model = trained_line(FIGURES[0], seed)
    seconds = {"fit": time.perf_counter() - began}
    states = {
        "means": [model.state_means([p]).round(5).tolist() for p in PARAMETERS],
        "covariances": model.covariances_.round(9).tolist(),
    }
    return {"values": values, "seconds": seconds, "curves": curves, "states": states}


def distance_from_curve(movement: Floats, p: float) -> float:
    """Maximum distance of a sample (T, 2) from the true movement's curve, as a fraction of the bound."""
    curve = prototype(p, np.linspace(0.0, 2.0, 2001))
    gaps = np.linalg.norm(movement[:, None] - curve[None], axis=2).min(axis=1)
    return float(gaps.max() / BOUND)
