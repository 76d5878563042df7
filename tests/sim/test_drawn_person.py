"""The person who is drawn around the simulated hand: for people, not for the robot."""

from __future__ import annotations

import numpy as np
import pytest

from paramove.bus import topics
from sim.drawn_person import FOREARM_M, UPPER_ARM_M, elbow_of
from sim.scenes import at_the_tool_box
from sim.simulator import Config


def picture(message) -> np.ndarray:
    return np.frombuffer(message.data, dtype=np.uint8).reshape(message.height, message.width, 3)


@pytest.mark.parametrize("wrist", [(0.3, 0.0, -0.2), (0.1, 0.3, 0.1), (-0.2, 0.1, -0.4)])
def test_an_arm_that_reaches_keeps_its_lengths_and_hangs(wrist) -> None:
    elbow = elbow_of(np.zeros(3), np.array(wrist))
    np.testing.assert_allclose(np.linalg.norm(elbow), UPPER_ARM_M, rtol=0, atol=1e-9)
    np.testing.assert_allclose(np.linalg.norm(np.array(wrist) - elbow), FOREARM_M, rtol=0, atol=1e-9)
    assert elbow[2] <= np.array(wrist)[2] / 2 + 1e-9


def test_an_arm_that_is_too_short_is_straight() -> None:
    elbow = elbow_of(np.zeros(3), np.array((0.9, 0.0, 0.0)))
    np.testing.assert_allclose(elbow[1:], 0.0, rtol=0, atol=1e-9)


def test_the_view_shows_a_person_and_the_robots_camera_shows_the_hand_alone() -> None:
    images = {}
    for video in (True, False):
        simulation = at_the_tool_box(Config(seed=3, video=video))
        shown = simulation.shown()
        images[video] = picture(shown[topics.CAMERA_IMAGE_RAW])
        if video:
            red, green, blue = np.moveaxis(picture(shown[topics.TRUTH_VIEW]).astype(int), 2, 0)
            shirt = (blue > red + 40) & (blue > green + 20)
            assert shirt.mean() > 0.02
        simulation.close()
    np.testing.assert_array_equal(images[True], images[False])
