"""Hidden Markov models of movements: plain chains and explicit durations, trained by Baum-Welch (thesis chapter 2)."""

from paramove.hmm.chain import ChainParameters, Topology
from paramove.hmm.estimation import Parameters
from paramove.hmm.filtering import OnlineFilter
from paramove.hmm.gaussian import GaussianHMM
from paramove.hmm.left_right import LeftRightHMM
from paramove.hmm.options import TrainingOptions, TrainingSummary
from paramove.hmm.rejection import LikelihoodTest
from paramove.hmm.sequences import SequenceLengthError, resample
from paramove.hmm.training import LikelihoodDecreaseWarning

__all__ = [
    "ChainParameters",
    "GaussianHMM",
    "LeftRightHMM",
    "LikelihoodDecreaseWarning",
    "LikelihoodTest",
    "OnlineFilter",
    "Parameters",
    "SequenceLengthError",
    "Topology",
    "TrainingOptions",
    "TrainingSummary",
    "resample",
]
