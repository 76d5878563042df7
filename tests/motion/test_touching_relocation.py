"""The relocation action by a movement of people who touch and do not come back."""

from __future__ import annotations

import numpy as np
import pytest

from tests.motion.reaching import CORNERS, GRASP_Z, OPENINGS, at
from tests.motion.test_relocation import BASE, accept, commanded, end_of, names, opening
from tests.motion.touching import touching_planner

PLACES = [(0.17, -0.06), (0.178, 0.0), (0.185, 0.06), CORNERS[2]]


@pytest.mark.parametrize("place", PLACES)
def test_fetch(place: tuple[float, float]) -> None:
    motion = touching_planner().fetch(at(place))
    assert names(motion) == ["approach", "lower", "reach", "grasp", "lift"]
    accept(motion, BASE)
    assert np.abs(motion.angles[0] - BASE).max() < np.deg2rad(2.0)
    points, grasp = commanded(motion), end_of(motion, "grasp")
    assert abs(points[grasp, 2] - GRASP_Z) < 0.0005
    assert abs(np.linalg.norm(points[grasp] - at(place)) - touching_planner().options.grasp_aside) < 0.0005
    assert opening(motion)[end_of(motion, "reach")] > 0.7


@pytest.mark.parametrize("place", [OPENINGS[1], OPENINGS[2], OPENINGS[3]])
def test_deliver(place: tuple[float, float]) -> None:
    fetch = touching_planner().fetch(at(PLACES[1]))
    motion = touching_planner().deliver(fetch.gripper[-1], at(place))
    assert names(motion) == ["carry", "place", "release", "withdraw", "retreat"]
    accept(motion, fetch.angles[-1])
    np.testing.assert_allclose(motion.angles[-1], BASE, rtol=0, atol=np.deg2rad(0.1))
    placed = end_of(motion, "place")
    np.testing.assert_allclose(
        commanded(motion)[placed],
        at(place, GRASP_Z + touching_planner().options.release_height),
        rtol=0,
        atol=5e-4,
    )


def test_the_way_to_the_table_goes_round_its_edge() -> None:
    """The hand hangs below the table beside its edge, at x 0.10."""
    points = commanded(touching_planner().offer(at((0.17, 0.0), -0.05)))
    over = points[points[:, 0] > 0.09]
    assert over[:, 2].min() > -0.09
    assert np.linalg.norm(points, axis=1).min() > 0.134
