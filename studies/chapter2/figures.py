"""Figures 2.8 to 2.24 of the thesis: what is trained in each, and what the thesis reports."""

from dataclasses import dataclass
from typing import Literal

Kind = Literal["ergodic", "skips", "left_right", "durations"]
Start = Literal["segments", "random", "simple"]

WIDE, NARROW = 0.25, 0.125
LAST = {"ergodic": 500, "skips": 500, "left_right": 500, "durations": 100}
"""Iterations until the result. The thesis needed about 70 for figure 2.8; from our equal segments it takes longer."""
RESULT = -1


@dataclass(frozen=True)
class Setting:
    """One HMM in training.

    Attributes:
        kind: ergodic; left-right with skips of one state; left-right; left-right with time restrictions.
        states: N.
        bound: parameters of the movements lie in [-bound, bound].
        frames: T of each of the ten sequences.
        d_min, d_max: time restrictions, 0 without.
        start: equal segments of the sequences; random means and covariances; all means (1, 0) and covariances I.
    """

    kind: Kind
    states: int
    bound: float = WIDE
    frames: int = 50
    d_min: int = 0
    d_max: int = 0
    start: Start = "segments"


@dataclass(frozen=True)
class ThesisFigure:
    """A figure: its number, title, iterations at which it is taken (RESULT: the last), what the thesis reports."""

    number: str
    title: str
    setting: Setting
    iterations: int
    thesis: str


ERGODIC_10 = Setting("ergodic", 10)
ERGODIC_20 = Setting("ergodic", 20)
SKIPS_20 = Setting("skips", 20)
PLAIN_5 = Setting("left_right", 5)
PLAIN_7 = Setting("left_right", 7)
PLAIN_7_NARROW = Setting("left_right", 7, NARROW)
PLAIN_20_NARROW = Setting("left_right", 20, NARROW)
TIMED_5 = Setting("durations", 5, d_min=6, d_max=12)
TIMED_10 = Setting("durations", 10, d_min=3, d_max=6)
TIMED_20 = Setting("durations", 20, frames=100, d_min=3, d_max=6)
RANDOM_10 = Setting("durations", 10, d_min=3, d_max=6, start="random")

FIGURES = (
    ThesisFigure(
        "2.8", "Ergodic 10-state HMM: training result", ERGODIC_10, RESULT,
        "The states form two branches, above and below the x-axis. Training converges very slowly: about 70 iterations "
        "are required.",
    ),
    ThesisFigure(
        "2.9", "Ergodic 10-state HMM: initialisation", ERGODIC_10, 0,
        "Means and covariances of ten equal segments of the sequences; priors and transitions are uniform.",
    ),
    ThesisFigure(
        "2.10", "Ergodic 10-state HMM: 20 iterations", ERGODIC_10, 20,
        "The model still has not much in common with the final result.",
    ),
    ThesisFigure(
        "2.11", "Ergodic 20-state HMM: training result", ERGODIC_20, RESULT,
        "Three branches. A zig-zag through the middle branch, which is no movement of the class, would get a high "
        "likelihood.",
    ),
    ThesisFigure(
        "2.12", "Left-right 20-state HMM with skip transitions: result", SKIPS_20, RESULT,
        "Very similar to the ergodic 10-state result: two branches. The sequence of means is no prototype.",
    ),
    ThesisFigure(
        "2.13", "Left-right 5-state HMM: result", PLAIN_5, RESULT,
        "The means are drawn away from the x-axis; their sequence is not very useful as a prototype.",
    ),
    ThesisFigure(
        "2.14", "Left-right 7-state HMM: initialisation", PLAIN_7, 0,
        "Already a good guess, with the means on the x-axis.",
    ),
    ThesisFigure(
        "2.15", "Left-right 7-state HMM: result", PLAIN_7, RESULT,
        "Worse than with 5 states: the means are further from the x-axis.",
    ),
    ThesisFigure(
        "2.16", "Left-right 7-state HMM, half the variation: result", PLAIN_7_NARROW, RESULT,
        "With parameters in [-0.125, 0.125] the means are on the x-axis; the first and the last state model a greater "
        "part of the movement than the others.",
    ),
    ThesisFigure(
        "2.17", "Left-right 20-state HMM, half the variation: 10 iterations", PLAIN_20_NARROW, 10,
        "The means are drifting to where the variance is high.",
    ),
    ThesisFigure(
        "2.18", "Left-right 20-state HMM, half the variation: result", PLAIN_20_NARROW, RESULT,
        "The means drift from the x-axis, and most are located in the middle of the movements, x in [0.8, 1.2].",
    ),
    ThesisFigure(
        "2.19", "Left-right 5-state HMM with time restrictions: result", TIMED_5, RESULT,
        "6 to 12 frames per state. The means are on the x-axis and uniform in time: a good prototype.",
    ),
    ThesisFigure(
        "2.20", "Left-right 10-state HMM with time restrictions: result", TIMED_10, RESULT,
        "3 to 6 frames per state. The means are on the x-axis and uniform in time.",
    ),
    ThesisFigure(
        "2.21", "Left-right 20-state HMM with time restrictions: result", TIMED_20, RESULT,
        "3 to 6 frames per state, sequences of 100 frames. The means are on the x-axis and uniform in time.",
    ),
    ThesisFigure(
        "2.22", "Left-right 10-state HMM: random initialisation", RANDOM_10, 0,
        "Random means and covariances.",
    ),
    ThesisFigure(
        "2.23", "Left-right 10-state HMM with time restrictions: 5 iterations", TIMED_10, 5,
        "Already very similar to the result of figure 2.20; also from the random start of figure 2.22, and from means "
        "(1, 0) with covariances I.",
    ),
    ThesisFigure(
        "2.24", "Left-right 20-state HMM with time restrictions: 5 iterations", TIMED_20, 5,
        "Already very similar to the result of figure 2.21.",
    ),
)  # fmt: skip
