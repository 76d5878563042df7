"""Parametric hidden Markov models: one model of a movement for all its parameters (thesis chapter 3)."""

from paramove.phmm.classification import Classification, MovementClassifier
from paramove.phmm.description import MovementDescription
from paramove.phmm.grid import ParameterGrid
from paramove.phmm.interpolative import InterpolativePHMM
from paramove.phmm.neural import NeuralPHMM
from paramove.phmm.parametric import ParameterEstimate, ParametricHMM
from paramove.phmm.polynomial import CubicPHMM, Examination, LinearPHMM, PolynomialPHMM, QuadraticPHMM
from paramove.phmm.storage import ModelFileError

__all__ = [
    "Classification",
    "CubicPHMM",
    "Examination",
    "InterpolativePHMM",
    "LinearPHMM",
    "ModelFileError",
    "MovementClassifier",
    "MovementDescription",
    "NeuralPHMM",
    "ParameterEstimate",
    "ParameterGrid",
    "ParametricHMM",
    "PolynomialPHMM",
    "QuadraticPHMM",
]
