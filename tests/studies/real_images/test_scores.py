"""Distances in the image: what is measured, and when the goal is met."""

import numpy as np
import pytest

from paramove.documents.input_error import InputError
from studies.real_images.replay import ReplayedEstimate
from studies.real_images.scores import (
    GOAL_PX,
    Distances,
    distances,
    is_met,
    middle_of_hand,
    read_reference,
)
from studies.real_images.seated_person import SIZES, resting_pose
from tests.studies.real_images.synthetic_recording import write_lens


def found(middle, frames=None):
    frames = np.arange(len(middle)) if frames is None else np.asarray(frames)
    return Distances(frames, np.asarray(middle, float), np.asarray(middle, float), np.zeros(len(frames), bool))


def test_the_middle_of_the_hand_is_half_a_hand_from_its_tip(tmp_path):
    pose = resting_pose(write_lens(tmp_path))
    assert np.linalg.norm(middle_of_hand(pose)[0] - pose[6:]) == pytest.approx(0.5 * SIZES.hand, abs=1e-9)


def test_distances_are_those_in_the_image(tmp_path):
    camera = write_lens(tmp_path)
    pose = resting_pose(camera)
    reference = np.tile(camera.project(middle_of_hand(pose))[0], (3, 1)) + np.array([[0, 0], [3, 4], [0, 7]])
    said = [ReplayedEstimate(frame, pose, np.empty((0, 2)), 0.0, np.zeros(2), False) for frame in (0, 1, 2)]
    np.testing.assert_allclose(distances(said, reference, camera).middle, [0.0, 5.0, 7.0], rtol=0.0, atol=1e-9)


def test_medians_are_those_of_the_frames_told():
    middle = np.full(60, 100.0)
    middle[6:10] = [1.0, 2.0, 4.0, 90.0]
    middle[32:51] = 20.0
    numbers = found(middle).numbers()
    assert numbers["frames 6-9"]["median_px"] == 3.0
    assert numbers["frames 32-50"] == {
        "median_px": 20.0, "median_of_tip_px": 20.0, "frames": 19, "far_frames": 0, "frames_said_to_be_lost": 0
    }  # fmt: skip


def test_a_frame_without_an_estimate_is_far_off():
    numbers = found([1.0, 2.0], frames=[6, 7]).numbers()
    assert numbers["frames 6-9"]["far_frames"] == 2
    assert numbers["frames 6-9"]["median_px"] is None


@pytest.mark.parametrize(("medians", "met"), [((25.0, 25.0), True), ((5.0, 25.1), False), ((5.0, None), False)])
def test_the_goal_is_met_in_both_ranges_with_every_seed(medians, met):
    runs = [
        {"frames 6-9": {"median_px": 1.0}, "frames 32-50": {"median_px": GOAL_PX}},
        {name: {"median_px": value} for name, value in zip(("frames 6-9", "frames 32-50"), medians, strict=True)},
    ]
    assert is_met(runs) == met
    assert not is_met([])


def test_frames_without_a_reference_are_refused(tmp_path):
    camera = write_lens(tmp_path)
    said = [ReplayedEstimate(2, resting_pose(camera), np.empty((0, 2)), 0.0, np.zeros(2), False)]
    with pytest.raises(InputError, match="2 frames have a reference"):
        distances(said, np.zeros((2, 2)), camera)


def test_a_reference_of_no_use_is_told(tmp_path):
    with pytest.raises(InputError, match="where the hand is seen") as caught:
        read_reference(tmp_path)
    assert caught.value.missing
    np.savez(tmp_path / "hand_reference.npz", uv=np.zeros(4))
    with pytest.raises(InputError, match=r"uv of shape \(4,\)"):
        read_reference(tmp_path)
    np.savez(tmp_path / "hand_reference.npz", other=np.zeros(4))
    with pytest.raises(InputError, match="uv"):
        read_reference(tmp_path)
