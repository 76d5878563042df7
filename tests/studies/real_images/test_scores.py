"""Distances in the image: what is measured, and when the goal is met."""

import numpy as np
import pytest

from paramove.documents.input_error import InputError
from studies.real_images.replay import ReplayedEstimate
from studies.real_images.scores import (
    Distances,
    Reference,
    distances,
    middle_of_hand,
    network_alone,
    read_reference,
)
from studies.real_images.seated_person import SIZES, in_camera, resting_pose
from tests.studies.real_images.synthetic_recording import key_points, write_lens


def of_pixels(pixels, frames=None):
    frames = np.arange(len(pixels)) if frames is None else np.asarray(frames)
    metres = np.full(len(frames), 0.1)
    return Distances(frames, np.asarray(pixels, float), metres, metres, metres, np.zeros(len(frames), bool))


def estimate(frame, pose):
    return ReplayedEstimate(frame, pose, np.empty((0, 2)), 0.0, np.zeros(2), False)


def test_the_middle_of_the_hand_is_half_a_hand_from_its_tip(tmp_path):
    pose = resting_pose(write_lens(tmp_path))
    assert np.linalg.norm(middle_of_hand(pose)[0] - pose[6:]) == pytest.approx(0.5 * SIZES.hand, abs=1e-9)


def test_distances_are_those_in_the_image_and_in_space(tmp_path):
    camera = write_lens(tmp_path)
    pose = resting_pose(camera)
    pixels = np.tile(camera.project(middle_of_hand(pose))[0], (3, 1)) + np.array([[0, 0], [3, 4], [0, 7]])
    hand = in_camera(np.tile(middle_of_hand(pose), (3, 1)), camera)
    shoulder = in_camera(np.tile(pose[:3], (3, 1)), camera)
    reference = Reference(pixels, hand + np.array([0.0, 0.03, 0.0]), shoulder + np.array([0.0, 0.03, 0.04]))
    found = distances([estimate(frame, pose) for frame in range(3)], reference, camera)
    np.testing.assert_allclose(found.pixels, [0.0, 5.0, 7.0], rtol=0.0, atol=1e-9)
    np.testing.assert_allclose(found.hand, 0.03, atol=1e-9)
    np.testing.assert_allclose(found.from_shoulder, 0.04, atol=1e-9)
    assert (found.direction < np.arcsin(0.04 / np.linalg.norm(hand[0] - shoulder[0])) + 1e-9).all()


def test_medians_are_those_of_the_frames_told():
    pixels = np.full(60, 100.0)
    pixels[6:10] = [1.0, 2.0, 4.0, 90.0]
    pixels[32:51] = 20.0
    numbers = of_pixels(pixels).numbers(60)
    assert numbers["frames 6-9"]["median_px"] == 3.0
    assert numbers["frames 32-50"] == {
        "median_px": 20.0, "far_frames": 0, "lost_frames": 0,
        "hand_cm": 10.0, "from_shoulder_cm": 10.0, "direction_deg": 5.7,
    }  # fmt: skip
    assert numbers["all frames"]["far_frames"] == 38


def test_a_frame_without_an_estimate_is_far_off_and_lost():
    numbers = of_pixels([1.0, 2.0], frames=[6, 7]).numbers(10)
    assert numbers["frames 6-9"]["far_frames"] == 2
    assert numbers["frames 6-9"]["lost_frames"] == 2
    assert numbers["frames 6-9"]["median_px"] is None


def test_the_network_alone_is_judged_by_its_hand(tmp_path):
    camera = write_lens(tmp_path)
    points = key_points(camera, np.tile(resting_pose(camera), (2, 1)))
    pixels = np.array([one.positions[0, 3] for one in points]) + np.array([[0.0, 2.0], [3.0, 4.0]])
    points[1].positions[...] = np.nan
    found = network_alone(points, Reference(pixels, np.zeros((2, 3)), np.zeros((2, 3))))
    assert found.pixels.tolist() == [2.0, np.inf]
    assert found.lost.tolist() == [False, True]


def test_frames_without_a_reference_are_refused(tmp_path):
    camera = write_lens(tmp_path)
    nothing = Reference(np.zeros((2, 2)), np.zeros((2, 3)), np.zeros((2, 3)))
    with pytest.raises(InputError, match="2 frames have a reference"):
        distances([estimate(2, resting_pose(camera))], nothing, camera)


def test_without_depth_images_the_shoulder_is_unknown(tmp_path):
    camera = write_lens(tmp_path)
    np.savez(tmp_path / "hand_reference.npz", uv=np.zeros((2, 2)), xyz_m=np.zeros((2, 3)))
    points = key_points(camera, np.tile(resting_pose(camera), (1, 1)))
    assert np.isnan(read_reference(tmp_path, camera, points).shoulder).all()


@pytest.mark.parametrize(
    "arrays",
    [
        {"uv": np.zeros(4), "xyz_m": np.zeros((4, 3))},
        {"uv": np.zeros((4, 2)), "xyz_m": np.zeros(4)},
        {"uv": np.zeros((4, 2))},
    ],
)
def test_a_reference_of_no_use_is_told(tmp_path, arrays):
    camera = write_lens(tmp_path)
    with pytest.raises(InputError, match="positions of the hand") as caught:
        read_reference(tmp_path, camera, [])
    assert caught.value.missing
    np.savez(tmp_path / "hand_reference.npz", **arrays)
    with pytest.raises(InputError, match="xyz_m"):
        read_reference(tmp_path, camera, [])
