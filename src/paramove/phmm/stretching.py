"""What is known beforehand of a movement whose parameters are the position at which the hand arrives.

A few movements to near positions differ more by chance than by their target, and a regression that is chosen by
leaving out movements then finds no effect of the target at all. But the hand does arrive at its target: coefficients
are therefore shrunk towards a movement that is stretched to there, rather than towards one that does not change.
"""

from __future__ import annotations

import numpy as np

from paramove.documents import Floats
from paramove.hmm import minimum_jerk
from paramove.phmm.description import MovementDescription
from paramove.phmm.features import Monomials

FOLLOWS = {"knuckle": 1.0, "index": 1.0, "thumb": 1.0, "wrist": 0.9, "elbow": 0.4}
"""How far a point follows the target, as a fraction of it; others do not."""
AXES = ("_x", "_y", "_z")


def stretched(description: MovementDescription | None, shape: tuple[int, ...], monomials: Monomials) -> Floats:
    """Coefficients of that shape (N, D, F) of a movement that is stretched to its target; 0 for all others.

    That a movement ends at its target is known if the description has `arrival` 1, and parameters that end in _x, _y or
    _z.
    """
    names = () if description is None else description.point_names
    result = np.zeros(shape)
    if description is None or description.arrival != 1.0 or 3 * len(names) != shape[1]:
        return result
    progress = minimum_jerk(np.linspace(0.0, 1.0, shape[0]), 0.0, 1.0)
    linear = np.flatnonzero(monomials.degrees == 1)
    for component, name in enumerate(description.parameter_names):
        if name[-2:] in AXES:
            (monomial,) = linear[monomials.exponents[linear, component] == 1]
            for point, follows in enumerate(FOLLOWS.get(one, 0.0) for one in names):
                along = follows * progress * monomials.scale[component]
                result[:, 3 * point + AXES.index(name[-2:]), monomial] = along
    return result
