"""Persons of other sizes at other places."""

import numpy as np
import pytest

from paramove.action_space.placement import PersonPlacement
from paramove.demonstrations import ArmLengths
from paramove.demonstrations.synthetic import RESTING_SHOULDER
from paramove.documents.input_error import InputError


def test_the_default_person_is_the_demonstrator():
    poses = np.random.default_rng(0).random((4, 9))
    np.testing.assert_allclose(PersonPlacement().in_world(poses), poses, rtol=1e-12)


def test_a_person_is_a_similarity_about_the_shoulder():
    placement = PersonPlacement((1.0, 2.0, 3.0), 1.1)
    np.testing.assert_allclose(placement.in_world(RESTING_SHOULDER), [1.0, 2.0, 3.0])
    apart = np.array([[0.0, 0.0, 0.0], [0.1, 0.0, 0.0], [0.0, 0.2, 0.3]])
    pose = (RESTING_SHOULDER + apart).ravel()
    np.testing.assert_allclose(placement.in_world(pose), [1.0, 2.0, 3.0, 1.11, 2.0, 3.0, 1.0, 2.22, 3.33], atol=1e-12)
    np.testing.assert_allclose(placement.in_model(placement.in_world(pose)), pose, atol=1e-12)


def test_scale_from_the_length_of_an_arm():
    usual = ArmLengths()
    length = usual.upper_arm + usual.forearm + usual.fingertip
    assert PersonPlacement.of_arm(RESTING_SHOULDER, 0.9 * length).scale == pytest.approx(0.9)


@pytest.mark.parametrize(("shoulder", "scale"), [((0.0, 0.0, np.nan), 1.0), ((0.0, 0.0, 0.0), 700.0)])
def test_what_is_no_person_is_refused(shoulder, scale):
    with pytest.raises(InputError, match="found"):
        PersonPlacement(shoulder, scale)
