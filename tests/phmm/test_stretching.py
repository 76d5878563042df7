"""What is known of a movement that arrives at its parameters."""

from dataclasses import replace

import numpy as np
import pytest

from paramove.phmm import MovementDescription, QuadraticPHMM
from paramove.phmm.features import Monomials
from paramove.phmm.stretching import stretched

POINTS = ("shoulder", "elbow", "index")
KNOWN = MovementDescription("reach", POINTS, parameter_names=("target_x", "target_y"), arrival=1.0)
THETA = np.array([(x, y) for x in (0.0, 0.1, 0.2) for y in (-0.1, 0.0, 0.1)])


def test_the_fingertip_follows_the_target_at_the_end_only():
    monomials = Monomials.of_degree(2, THETA)
    known = stretched(KNOWN, (10, 9, len(monomials)), monomials)
    apart = known @ (monomials.at(np.array([0.2, -0.1])) - monomials.at(np.array([0.1, 0.0])))
    np.testing.assert_allclose(apart[0], 0.0, atol=1e-12)
    np.testing.assert_allclose(apart[-1], [0, 0, 0, 0.04, -0.04, 0, 0.1, -0.1, 0], atol=1e-12)


@pytest.mark.parametrize(
    "other",
    [
        None,
        replace(KNOWN, arrival=-1.0),
        replace(KNOWN, parameter_names=("u", "v")),
        replace(KNOWN, point_names=POINTS[:1]),
    ],
)
def test_nothing_is_known_of_other_movements(other):
    monomials = Monomials.of_degree(1, THETA)
    assert not stretched(other, (5, 9, len(monomials)), monomials).any()


def movements(noise, seed=0):
    """To positions near to each other, with starts and paths that differ more than these; they end there exactly."""
    rng, progress = np.random.default_rng(seed), np.linspace(0.0, 1.0, 40)[:, None]
    result = []
    for x, y in THETA:
        start = np.array([-0.3, -0.3, -0.3]) + noise * rng.standard_normal(3)
        bow = np.sin(np.pi * progress) * (np.array([0.0, -0.1, 0.2]) + noise * rng.standard_normal(3))
        tip = start + progress * (np.array([x, y, 0.0]) - start) + bow
        shoulder = np.array([-0.3, -0.2, 0.3]) + 0.1 * noise * rng.standard_normal((40, 3)) * (1.0 - progress)
        elbow = 0.5 * (shoulder + tip) + noise * rng.standard_normal(3) * np.sin(np.pi * progress)
        result.append(np.concatenate([shoulder, elbow, tip], axis=1) + 0.001 * rng.standard_normal((40, 9)))
    return result


def end_error(description):
    model = QuadraticPHMM(20, description=description).fit(movements(0.1), THETA)
    new = np.array([[0.05, -0.05], [0.15, 0.05], [0.18, -0.08]])
    return max(np.linalg.norm(model.synthesize(one, 60)[-1, 6:8] - one) for one in new)


def test_nine_movements_that_differ_by_chance_still_lead_to_new_positions():
    assert end_error(KNOWN) < 0.01 < end_error(replace(KNOWN, arrival=-1.0))
