"""Where the hand is if it is at one of the places that its action is about."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from paramove.action_space.estimates import ThetaEstimate, theta_estimate
from paramove.action_space.propagation import Particles
from paramove.action_space.vocabulary import PLACE_SIZE, ActionModel, Vocabulary
from paramove.documents import Floats, Ints

CONTACT = 0.8
"""Share of the largest dependence of the hand on a place from which on the hand is at that place."""


@dataclass(frozen=True)
class ReachedPlace:
    """The place of the particles whose hand is at a place.

    Attributes:
        contact: posterior probability of a progress at which the hand is at a place of its action.
        action: name of the most probable action among those.
        theta: coordinates (u, v) of the place. place: in the models' frame, m, (3,).
    """

    contact: float
    action: str
    theta: ThetaEstimate
    place: Floats


def reached_place(vocabulary: Vocabulary, action: Ints, particles: Particles) -> ReachedPlace | None:
    """The place where the hand is, by all actions whose places are meant alike; None if no particle is at one.

    When one action ends at a place and the next begins there (6.7.3), particles of both know the place.
    """
    there = np.zeros(len(particles), dtype=np.bool_)
    coordinates = np.empty((len(particles), PLACE_SIZE))
    for number, model in enumerate(vocabulary.actions):
        rows = np.flatnonzero(action == number)
        if len(rows):
            there[rows], coordinates[rows] = _at_place(model, particles.theta[rows], particles.tau[rows])
    mass = np.bincount(action[there], particles.weights[there], len(vocabulary))
    if not mass.sum() > 0.0:
        return None
    likeliest = vocabulary.actions[int(mass.argmax())]
    alike = np.array([model.target is likeliest.target for model in vocabulary.actions])
    chosen = there & alike[action]
    theta = theta_estimate(coordinates[chosen], particles.weights[chosen])
    return ReachedPlace(float(mass.sum()), likeliest.name, theta, likeliest.target(theta.mean))


def _at_place(model: ActionModel, theta: Floats, tau: Floats) -> tuple[NDArray[np.bool_], Floats]:
    """Whether each hand is at a place, and the coordinates of that on which it depends most. (K,), (K, 2)."""
    dependence = np.stack([model.at_progress(table, tau) for table in model.place_dependence])
    which = dependence.argmax(axis=0)
    places = theta[:, : model.n_parameters].reshape(len(theta), -1, PLACE_SIZE)
    return dependence.max(axis=0) >= CONTACT, places[np.arange(len(theta)), which]
