"""The target at which the hand is, if it is at one of its action."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from paramove.action_space.estimates import ThetaEstimate, theta_estimate
from paramove.action_space.propagation import Particles
from paramove.action_space.vocabulary import PLACE_SIZE, ActionModel, Vocabulary
from paramove.documents import Floats, Ints

CONTACT = 0.8
"""Fraction of the largest dependence of the hand on a target from which on the hand is at that target."""


@dataclass(frozen=True)
class ReachedTarget:
    """The target of the particles whose hand is at one.

    Attributes:
        contact: posterior probability of a progress at which the hand is at a target of its action.
        action: name of the most probable action among those.
        theta: coordinates (u, v) of the target. position: in the models' frame, m, (3,).
    """

    contact: float
    action: str
    theta: ThetaEstimate
    position: Floats


def reached_target(vocabulary: Vocabulary, action: Ints, particles: Particles) -> ReachedTarget | None:
    """The target at which the hand is, by all actions with the same target function; None if no particle is at one.

    When one action ends at a target and the next begins at_target (6.7.3), particles of both contribute.
    """
    at_target = np.zeros(len(particles), dtype=np.bool_)
    coordinates = np.empty((len(particles), PLACE_SIZE))
    for number, model in enumerate(vocabulary.actions):
        rows = np.flatnonzero(action == number)
        if len(rows):
            at_target[rows], coordinates[rows] = _at_target(model, particles.theta[rows], particles.tau[rows])
    mass = np.bincount(action[at_target], particles.weights[at_target], len(vocabulary))
    if not mass.sum() > 0.0:
        return None
    likeliest = vocabulary.actions[int(mass.argmax())]
    same_target = np.array([model.target is likeliest.target for model in vocabulary.actions])
    chosen = at_target & same_target[action]
    theta = theta_estimate(coordinates[chosen], particles.weights[chosen])
    return ReachedTarget(float(mass.sum()), likeliest.name, theta, likeliest.target(theta.mean))


def _at_target(model: ActionModel, theta: Floats, tau: Floats) -> tuple[NDArray[np.bool_], Floats]:
    """Whether each hand is at a target, and the coordinates of the target on which it depends most. (K,), (K, 2)."""
    dependence = np.stack([model.at_progress(table, tau) for table in model.place_dependence])
    which = dependence.argmax(axis=0)
    places = theta[:, : model.n_parameters].reshape(len(theta), -1, PLACE_SIZE)
    return dependence.max(axis=0) >= CONTACT, places[np.arange(len(theta)), which]
