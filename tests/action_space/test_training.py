"""Action models trained from demonstrations, and kept."""

import numpy as np
import pytest

from paramove.action_space.training import arm_poses, cached_action, table_action_demonstrations
from paramove.demonstrations import POINT_NAMES, table_place
from paramove.documents.input_error import InputError


def shown():
    return table_action_demonstrations("pointing", columns=3, rows=2, repetitions=2)


def test_poses_are_shoulder_elbow_and_finger_tip():
    sequence = shown().sequences[0]
    poses = arm_poses(sequence)
    assert poses.shape == (len(sequence), 9)
    for number, name in enumerate(("shoulder", "elbow", "index")):
        k = 3 * POINT_NAMES.index(name)
        np.testing.assert_array_equal(poses[:, 3 * number : 3 * number + 3], sequence[:, k : k + 3])
    assert arm_poses(poses) is poses


def test_points_that_are_missing_are_named():
    with pytest.raises(InputError, match="shoulder, elbow, index"):
        arm_poses(np.zeros((5, 6)), ("wrist", "index"))


def test_a_trained_action_is_kept_and_read(tmp_path):
    calls = []

    def show():
        calls.append(1)
        return shown()

    first = cached_action("pointing", "test", show, n_states=20, folder=tmp_path)
    again = cached_action("pointing", "test", show, n_states=20, folder=tmp_path)
    assert len(calls) == 1
    theta = np.array([[0.3, 0.8]])
    np.testing.assert_array_equal(first.poses(theta, 0.5), again.poses(theta, 0.5))
    assert first.name == again.name == "pointing"
    assert first.parameter_names == ("u", "v")
    assert first.duration_s == pytest.approx(3.2, abs=0.3)
    assert np.linalg.norm(first.poses(theta, 0.5)[0, 6:] - table_place(theta[0])) < 0.04


def test_another_source_trains_anew_and_damage_is_repaired(tmp_path):
    cached_action("pointing", "one", shown, n_states=20, folder=tmp_path)
    cached_action("pointing", "two", shown, n_states=20, folder=tmp_path)
    files = sorted(tmp_path.iterdir())
    assert len(files) == 2
    files[0].write_bytes(b"no model")
    for source in ("one", "two"):
        assert cached_action("pointing", source, shown, n_states=20, folder=tmp_path).n_parameters == 2
    assert files[0].stat().st_size > 1000
