"""Files that appear whole or not at all, and are on the disk."""

import os
import stat

import numpy as np
import pytest

from paramove.cameras.calibrated import write_cameras
from paramove.demonstrations.labels import LabelsFile, Segment, append_segments, write_labels
from paramove.demonstrations.pose_recording import PoseRecording, write_poses
from paramove.documents.atomic_writing import replacing
from paramove.robots.dynamixel.calibration.arm_calibration import sign_again
from paramove.training.movement_writing import Made, write_movement
from tests.cameras.test_calibrated import lens_camera
from tests.phmm.test_model_files import small_model
from tests.robots.dynamixel.calibration.test_arm_calibration import ARM


def test_the_file_appears_at_the_end_of_the_block(tmp_path):
    path = tmp_path / "arm.yaml"
    path.write_text("before")
    with replacing(path) as unfinished:
        unfinished.write_text("after")
        assert path.read_text() == "before"
        assert unfinished.parent == path.parent
    assert path.read_text() == "after"
    assert list(tmp_path.iterdir()) == [path]


def test_an_error_leaves_the_file_as_it_was(tmp_path):
    path = tmp_path / "arm.yaml"
    path.write_text("before")

    def fails():
        with replacing(path) as unfinished:
            unfinished.write_text("half")
            raise OSError("no space")

    with pytest.raises(OSError, match="no space"):
        fails()
    assert path.read_text() == "before"
    assert list(tmp_path.iterdir()) == [path]


def test_what_a_killed_process_left_is_no_obstacle(tmp_path):
    path = tmp_path / "arm.yaml"
    with replacing(path) as unfinished:
        pass
    unfinished.write_text("left")
    with replacing(path) as again:
        assert (again, again.read_text()) == (unfinished, "")


def test_permissions_are_there_before_the_content(tmp_path):
    with replacing(tmp_path / "secret", 0o600) as unfinished:
        assert stat.S_IMODE(unfinished.stat().st_mode) == 0o600


def test_first_the_content_then_the_name_reaches_the_disk(tmp_path, monkeypatch):
    path, done, real, rename = tmp_path / "arm.yaml", [], os.fsync, os.replace

    def sync(descriptor):
        done.append(os.readlink(f"/proc/self/fd/{descriptor}"))
        real(descriptor)

    def replace(source, target):
        done.append("rename")
        rename(source, target)

    monkeypatch.setattr(os, "fsync", sync)
    monkeypatch.setattr(os, "replace", replace)
    with replacing(path) as unfinished:
        unfinished.write_text("content")
    assert done == [str(unfinished), "rename", str(tmp_path)]


POSES = PoseRecording(np.array([1, 2]), np.zeros((2, 1, 3)), ("hand",), "table")
MADE = Made(np.array([0.0, 1.0]), np.zeros((2, 3)), ("hand",), "table", np.zeros(1))
LABELS = LabelsFile(parameters=["x"])
SEGMENT = Segment(recording="a.mcap", start=0.0, end=1.0, action="reaching", theta=[0.1])
MAKERS = {
    "model.npz": lambda path: small_model().save(path),
    "cameras.yaml": lambda path: write_cameras(path, [lens_camera()]),
    "arm.yaml": ARM.save,
    "arm_again.yaml": lambda path: (ARM.save(path), sign_again(path)),
    "labels.yaml": lambda path: write_labels(path, LABELS),
    "more_labels.yaml": lambda path: (write_labels(path, LABELS), append_segments(path, [SEGMENT])),
    "poses.mcap": lambda path: write_poses(path, POSES, "a test"),
    "movement.csv": lambda path: write_movement(MADE, path),
    "movement.npz": lambda path: write_movement(MADE, path),
}


@pytest.mark.parametrize("name", MAKERS)
def test_every_file_that_a_person_makes_reaches_the_disk(tmp_path, monkeypatch, name):
    synced, real = [], os.fsync

    def sync(descriptor):
        found = os.fstat(descriptor)
        synced.append((found.st_ino, found.st_size))
        real(descriptor)

    monkeypatch.setattr(os, "fsync", sync)
    MAKERS[name](tmp_path / name)
    (made,) = tmp_path.iterdir()
    assert made == tmp_path / name
    assert (made.stat().st_ino, made.stat().st_size) in synced
    assert synced[-1][0] == tmp_path.stat().st_ino
