"""Persons of other sizes at other places."""

import numpy as np
import pytest

from paramove.action_space.person import Person, PersonPlacement, read_person
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


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("upper_arm: 28", "upper_arm: input should be less than 0.6, found 28; expected for example"),
        ("upper_am: 0.28", "upper_am: extra inputs are not permitted, found 0.28"),
        ("shoulder: [1, 2]", "shoulder.2 is missing"),
        ("shoulder: [", "person.yaml:1:12"),
    ],
)
def test_a_wrong_person_is_told_with_an_example(tmp_path, text, told):
    (tmp_path / "person.yaml").write_text(text)
    with pytest.raises(InputError, match="all in m") as caught:
        read_person(tmp_path / "person.yaml")
    assert told in str(caught.value)


def test_a_person_s_measures_make_the_arm(tmp_path):
    (tmp_path / "person.yaml").write_text("shoulder: [-0.3, -0.2, 0.4]\nupper_arm: 0.30\nforearm: 0.25\nhand: 0.18\n")
    person = read_person(tmp_path / "person.yaml")
    assert (person.sizes.upper_arm, person.sizes.lower_arm) == (0.30, 0.43)
    assert person.placement.shoulder == (-0.3, -0.2, 0.4)
    assert person.sizes.shoulder_radius > Person().sizes.shoulder_radius
