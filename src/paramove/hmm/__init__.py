"""Hidden Markov models of movements: left-right, with explicit durations, trained by Baum-Welch (thesis chapter 2)."""

from paramove.hmm.estimation import Parameters
from paramove.hmm.left_right import LeftRightHMM
from paramove.hmm.options import TrainingOptions, TrainingSummary
from paramove.hmm.sequences import SequenceLengthError, resample
from paramove.hmm.training import LikelihoodDecreaseWarning

__all__ = [
    "LeftRightHMM",
    "LikelihoodDecreaseWarning",
    "Parameters",
    "SequenceLengthError",
    "TrainingOptions",
    "TrainingSummary",
    "resample",
]
