"""Movements found by their speed, and labels that are checked before they are written."""

import numpy as np
import pytest

from paramove.demonstrations.demonstration_set import DemonstrationSet
from paramove.demonstrations.labelling import label, movements_by_speed, next_repetition
from paramove.demonstrations.labels import Segment
from paramove.demonstrations.movement import DemonstrationError
from paramove.demonstrations.writing import Take, write_set
from tests.demonstrations.movements import POINTS, reach


def there_and_back():
    """Two ways with rests of 0.8 s between; 182 frames at 50 Hz."""
    time, positions = reach((0.4, 0.1, -0.1))
    return np.arange(2 * len(time)) / 50.0, np.concatenate([positions, positions[::-1]])


def a_recording(folder, name="a.mcap"):
    time, positions = there_and_back()
    write_set(folder, [Take(name, time, positions, POINTS, "body")])
    (folder / "labels.yaml").unlink()
    return folder


def segment(**changes):
    return Segment(**({"recording": "a.mcap", "start": 0.4, "end": 1.4, "action": "reach"} | changes))


@pytest.mark.parametrize("name", ["../a.mcap", "/tmp/a.mcap", "..", "b/a.mcap", f"{'a' * 300}.mcap"])
def test_a_recording_is_never_written_outside_its_folder(tmp_path, name):
    with pytest.raises(DemonstrationError):
        a_recording(tmp_path / "set", name)
    assert list(tmp_path.iterdir()) == []


def test_there_and_back_are_two_movements():
    time, positions = there_and_back()
    found = movements_by_speed(time, positions, POINTS)
    assert len(found) == 2
    for (first, end), begins in zip(found, (0.4, 2.22), strict=True):
        assert abs(time[first] - begins) < 0.12
        assert abs(time[end - 1] - begins - 1.0) < 0.12


def test_lost_points_do_not_hide_movements():
    time, positions = there_and_back()
    positions[40:43, 4] = np.nan
    assert len(movements_by_speed(time, positions, POINTS)) == 2
    with pytest.raises(DemonstrationError, match=r"there is no point 'indx'.*did you mean 'index'"):
        movements_by_speed(time, positions, POINTS, "indx")
    positions[:, 4] = np.nan
    with pytest.raises(DemonstrationError, match="index is valid in 0 frames"):
        movements_by_speed(time, positions, POINTS)


def test_labels_are_made_and_added(tmp_path):
    folder = a_recording(tmp_path / "set")
    label(folder, [segment(theta=[0.4, 0.1, -0.1])])
    label(folder, [segment(start=2.0, end=3.3, theta=[0.4, 0.1, -0.1], repetition=1)])
    found = DemonstrationSet.load(folder)
    assert [len(one.time) for one in found] == [51, 66]
    assert found.parameter_names == ("target_x", "target_y", "target_z")
    with pytest.raises(DemonstrationError, match=r"has the parameters \(target_x, target_y, target_z\)"):
        label(folder, [segment(start=3.0, end=3.3)], ["u"])


@pytest.mark.parametrize(
    ("changes", "detail"),
    [
        ({"end": 9.0}, "a.mcap, 0.4 to 9 s ends after its recording, which covers 0 to 3.62 s"),
        ({"end": 0.405}, r"holds 1 frame of 182 .*; a movement has at least 2"),
        ({"end": 0.2}, "the end is not after the start"),
        ({"recording": "b.mcap"}, "there is no recording"),
    ],
)
def test_what_is_not_in_the_recording_is_not_labelled(tmp_path, changes, detail):
    folder = a_recording(tmp_path / "set")
    with pytest.raises(DemonstrationError, match=detail):
        label(folder, [segment(), segment(**changes)])
    assert not (folder / "labels.yaml").exists()


def test_repetitions_count_the_same_movement():
    there = [segment(repetition=0), segment(repetition=4), segment(action="point", repetition=9)]
    assert next_repetition(there, segment()) == 5
    assert next_repetition(there, segment(subject="B")) == 0
