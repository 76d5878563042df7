"""NPZ files: one take as plain arrays, or many labelled movements."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from paramove.demonstrations.importing import ImportOptions, import_file
from paramove.demonstrations.movement import DemonstrationError
from paramove.demonstrations.writing import Label, write_set

RNG = np.random.default_rng(0)
ONE = {"positions": RNG.normal(size=(10, 2, 3)), "points": ["wrist", "index"], "rate_hz": 50.0, "unit": "m"}
MANY = {
    "flat": RNG.normal(size=(30, 6)).astype(np.float32) * 1000,
    "flat_time": np.tile(np.arange(10) / 100, 3),
    "offsets": np.array([0, 10, 20, 30]),
    "points": ["wrist", "index"],
    "unit": "mm",
    "axes": "Unity, x right, y up, z forward",
    "action": ["point", "point", "reach"],
    "target": np.array([[100.0, 200.0, 300.0], [np.nan] * 3, [0.0, 0.0, 500.0]]),
    "subject": [1, 1, 2],
    "repetition": [0, 1, 0],
    "hand": ["R", "R", "L"],
    "segment": np.array([[2, 9], [0, 10], [1, 10]]),
    "ok": [True, True, True],
    "reason": ["", "", ""],
}


def write(folder, arrays):
    path = folder / "data.npz"
    np.savez(path, **arrays)
    return path


@pytest.mark.parametrize("shape", [(10, 2, 3), (10, 6)])
def test_plain_arrays(tmp_path, shape):
    path = write(tmp_path, ONE | {"positions": ONE["positions"].reshape(shape)})
    (take,) = import_file(path, ImportOptions(), Label(0, 0, "reach")).takes
    assert (take.positions == ONE["positions"]).all()
    assert_allclose(take.time, np.arange(10) / 50, rtol=0.0, atol=1e-15)
    assert take.labels[0].end == 10


def test_many_labelled_movements(tmp_path):
    found = import_file(write(tmp_path, MANY), ImportOptions())
    assert [take.recording for take in found.takes] == ["data_subject_1.mcap", "data_subject_2.mcap"]
    first, second = found.takes
    assert first.labels == (Label(2, 9, "point", pytest.approx((0.3, -0.1, 0.2)), "1", 0, "right"),)
    assert second.labels[0].side == "left"
    raw = MANY["flat"][20, :3].astype(np.float64)
    assert_allclose(second.positions[0, 0], np.array([raw[2], -raw[0], raw[1]]) / 1000, rtol=1e-12, atol=0.0)
    assert found.parameter_names == ("target_x", "target_y", "target_z")
    assert f"{tmp_path / 'data.npz'}: left out 1 movements that have no target" in found.remarks


def test_what_the_file_marks_as_unusable_is_left_out_and_told(tmp_path):
    found = import_file(
        write(tmp_path, MANY | {"ok": [False, True, True], "reason": ["jump", "", ""]}), ImportOptions()
    )
    assert len(found.takes) == 1
    assert "movements 0 (jump)" in found.remarks[0]


@pytest.mark.parametrize(
    ("changes", "detail"),
    [
        ({"points": ["wrist"]}, "positions have shape"),
        ({"positions": np.zeros((10, 3, 2))}, r"\(10, 3, 2\); 2 points need \(T, 2, 3\); transpose"),
        ({"rate_hz": None, "time": np.arange(9)}, "10 frames have times of shape"),
        ({"rate_hz": 0.0}, "a frame rate above 0 expected"),
        ({"points": None}, "the array 'points' is missing; there are positions, rate_hz, unit"),
        ({"positions": np.array([None, None])}, "found pickled objects"),
    ],
)
def test_arrays_that_do_not_fit(tmp_path, changes, detail):
    arrays = {key: value for key, value in (ONE | changes).items() if value is not None}
    with pytest.raises(DemonstrationError, match=detail):
        import_file(write(tmp_path, arrays), ImportOptions())


@pytest.mark.parametrize(
    ("changes", "detail"),
    [
        ({"segment": np.array([[2, 99], [0, 10], [1, 10]])}, "movement 0 has the segment 2 to 99 of 10 frames"),
        ({"flat_time": np.arange(7)}, "its arrays do not fit together"),
        ({"target": np.full((3, 3), np.nan)}, "no movement that is ok and has a target"),
        ({"segment": None}, "the array 'segment' is missing"),
    ],
)
def test_many_that_do_not_fit(tmp_path, changes, detail):
    arrays = {key: value for key, value in (MANY | changes).items() if value is not None}
    with pytest.raises(DemonstrationError, match=detail):
        import_file(write(tmp_path, arrays), ImportOptions())


@pytest.mark.parametrize("content", [b"", b"no archive", b"PK\x03\x04 cut"])
def test_damaged_files(tmp_path, content):
    path = tmp_path / "data.npz"
    path.write_bytes(content)
    with pytest.raises(DemonstrationError, match="cut off or damaged"):
        import_file(path, ImportOptions())


def test_files_of_no_known_kind(tmp_path):
    path = tmp_path / "data.trc"
    path.touch()
    with pytest.raises(DemonstrationError, match=r"files of motion capture end in \.c3d, \.bvh"):
        import_file(path, ImportOptions())
    with pytest.raises(DemonstrationError, match="there is no file"):
        import_file(tmp_path / "no.c3d", ImportOptions())


def test_takes_of_one_name_must_fit(tmp_path):
    (take,) = import_file(write(tmp_path, ONE), ImportOptions()).takes
    other = type(take)(take.recording, take.time, take.positions[:, :1], ("wrist",), take.frame)
    with pytest.raises(DemonstrationError, match="differ in points or frame"):
        write_set(tmp_path / "set", [take, other])
    labelled = [replace(one, recording=f"{n}.mcap", labels=(Label(0, 10, "x"),)) for n, one in enumerate([take, other])]
    with pytest.raises(
        DemonstrationError, match=r"1\.mcap has the points wrist, 0\.mcap has wrist, index; choose those"
    ):
        write_set(tmp_path / "set", labelled)
    assert not (tmp_path / "set").exists()
