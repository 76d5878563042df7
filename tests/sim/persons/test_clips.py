"""Files of clips: without loss, apart from the truth, and refused where they do not fit."""

from dataclasses import replace

import numpy as np
import pytest
from ruamel.yaml import YAML

from paramove.cameras.calibrated import CalibratedCamera
from paramove.documents.input_error import InputError
from paramove.observation.arm_body import ArmSizes
from sim.persons import clips
from sim.persons.clips import Clip, Truth, pack, read_clip, read_clips, unpacked, write_clip
from sim.persons.performances import Act

FRAMES = 5
CAMERA_NAMES = ("camera_1", "camera_2", "camera_3", "camera_4")


def pictures(seed):
    draw = np.random.default_rng(seed)
    return [draw.integers(0, 256, (24, 32, 3), dtype=np.uint8) for _ in range(FRAMES)]


@pytest.fixture
def truth():
    act = Act(
        "pointing", 0.1, 0.6, np.array([[0.2, 0.7]]), np.array([[0.1, 0.2, 0.07]]), np.array([0.3]), np.array([0.4])
    )
    dual = Act(
        "point_redirect_withdraw",
        0.7,
        0.9,
        np.array([[0.2, 0.7], [0.1, 0.1]]),
        np.zeros((2, 3)),
        np.array([0.75, 0.8]),
        np.array([0.78, 0.85]),
        0.77,
    )
    labels = np.array(["rest", "pointing", "pointing", "rest", "rest"])
    poses = np.arange(FRAMES * 9, dtype=np.float64).reshape(FRAMES, 9)
    return Truth(
        poses, np.ones((FRAMES, 3)), labels, (act, dual), ArmSizes(), np.array([-0.3, -0.2, 0.3]), cameras(0.0)
    )


def cameras(shift):
    pose = np.eye(4)
    pose[:3, 3] = shift
    matrix = np.array([[30.0, 0.0, 15.5], [0.0, 30.0, 11.5], [0.0, 0.0, 1.0]])
    return tuple(CalibratedCamera(name, 32, 24, matrix, np.zeros(4), pose) for name in CAMERA_NAMES)


@pytest.fixture
def clip(tmp_path, truth):
    made = Clip(
        tmp_path / "pointing_02",
        "pointing_02",
        "pointing",
        2,
        np.arange(FRAMES) / 8.0,
        (1, 3),
        cameras(0.001),
        ArmSizes().scaled(1.02),
        np.array([-0.301, -0.2, 0.3]),
        4.0,
    )
    write_clip(made, truth, {1: pictures(1), 3: pictures(3)})
    return made


def test_images_are_packed_without_loss():
    images = pictures(0)
    for image, again in zip(images, unpacked(*pack(images)), strict=True):
        np.testing.assert_array_equal(image, again)


def test_a_clip_is_read_as_it_was_written(clip):
    again = read_clip(clip.folder)
    assert (again.name, again.kind, again.number, again.views) == ("pointing_02", "pointing", 2, (1, 3))
    assert again.sizes == clip.sizes
    assert again.split == "held_out"
    assert again.rate_hz == pytest.approx(8.0)
    np.testing.assert_array_equal(again.times_s, clip.times_s)
    np.testing.assert_array_equal(again.shoulder, clip.shoulder)
    np.testing.assert_allclose(again.cameras[3].camera_from_world[:3, 3], 0.001, rtol=0.0, atol=1e-12)


def test_truth_is_apart(clip, truth):
    with np.load(clip.folder / "seen.npz", allow_pickle=False) as seen:
        assert not {"poses", "wrist", "labels"} & set(seen.files)
    again = read_clip(clip.folder).truth
    np.testing.assert_array_equal(again.poses, truth.poses)
    assert list(again.labels) == list(truth.labels)
    assert again.sizes == truth.sizes
    for act, known in zip(again.acts, truth.acts, strict=True):
        assert (act.action, act.start_s, act.end_s) == (known.action, known.start_s, known.end_s)
        np.testing.assert_array_equal(act.theta, known.theta)
        np.testing.assert_array_equal(act.targets, known.targets)
        np.testing.assert_array_equal(act.arrives_s, known.arrives_s)
        np.testing.assert_array_equal(act.grasp_s, known.grasp_s)
    np.testing.assert_allclose(again.cameras[0].camera_from_world[:3, 3], 0.0, rtol=0.0, atol=1e-12)


def test_noise_is_the_same_every_time_and_as_strong_as_it_says(clip):
    quiet = [np.full((240, 320, 3), 128, dtype=np.uint8)] * 3
    first = np.array(list(clip._noisy(iter(quiet), 1)), dtype=np.float64)
    again = np.array(list(clip._noisy(iter(quiet), 1)), dtype=np.float64)
    other = np.array(list(clip._noisy(iter(quiet), 3)), dtype=np.float64)
    np.testing.assert_array_equal(first, again)
    assert np.abs(first - other).mean() > 2.0
    assert np.abs(first[0] - first[1]).mean() > 2.0
    assert first.std() == pytest.approx(4.0, abs=0.1)
    assert first.mean() == pytest.approx(128.0, abs=0.1)


def test_frames_have_none_where_a_view_has_no_image(clip):
    frames = list(read_clip(clip.folder).frames())
    assert len(frames) == FRAMES
    assert all([image is None for image in frame] == [True, False, True, False] for frame in frames)
    only = next(read_clip(clip.folder).frames([3]))
    assert [image is None for image in only] == [True, True, True, False]


def test_a_view_without_images_is_refused(clip):
    with pytest.raises(InputError, match=r"view 0 has no images; views with images are \(1, 3\)"):
        next(clip.images(0))


def test_what_is_missing_or_old_is_refused(clip, monkeypatch, tmp_path):
    with pytest.raises(InputError, match=r"sim\.performances") as missing:
        read_clip(tmp_path / "nothing")
    assert missing.value.missing
    with pytest.raises(InputError, match="no clip of kind pouring"):
        read_clips(tmp_path, "pouring")
    with pytest.raises(InputError, match="found 'waving'"):
        read_clips(tmp_path, "waving")
    monkeypatch.setattr(clips, "clips_code", lambda: "of today")
    with pytest.raises(InputError, match="renders it again"):
        read_clip(clip.folder)


def test_manifest_tells_the_split_and_notices_a_change(clip, truth):
    root = clip.folder.parent
    before = YAML(typ="safe").load(clips.write_manifest(root).read_text())
    assert [(one["name"], one["split"], one["frames"]) for one in before["clips"]] == [
        ("pointing_02", "held_out", FRAMES)
    ]
    again = YAML(typ="safe").load(clips.write_manifest(root).read_text())
    assert again == before
    write_clip(clip, replace(truth, poses=truth.poses + 1.0), {1: pictures(1), 3: pictures(3)})
    changed = YAML(typ="safe").load(clips.write_manifest(root).read_text())
    assert changed["clips"][0]["truth.npz"] != before["clips"][0]["truth.npz"]
    assert changed["clips"][0]["seen.npz"] == before["clips"][0]["seen.npz"]
