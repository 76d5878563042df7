"""C3D files that ezc3d writes; a damaged one is refused and harms nobody."""

import ezc3d
import numpy as np
import pytest
from numpy.testing import assert_allclose

from paramove.demonstrations.importing import ImportOptions, import_file
from paramove.demonstrations.importing.c3d import read_c3d
from paramove.demonstrations.movement import DemonstrationError
from paramove.demonstrations.writing import Label

NAMES = ["Anna:RSHO", "Anna:RELB", "Anna:RFIN"]


@pytest.fixture
def points():
    return np.random.default_rng(0).uniform(-900.0, 900.0, (60, 3, 3))


def write(path, points, names=NAMES, unit="mm", rate=100.0):
    file = ezc3d.c3d()
    file["parameters"]["POINT"]["RATE"]["value"] = [rate]
    file["parameters"]["POINT"]["LABELS"]["value"] = list(names)
    file["parameters"]["POINT"]["UNITS"]["value"] = [unit]
    file["data"]["points"] = np.concatenate([np.moveaxis(points, 0, -1).swapaxes(0, 1), np.ones((1, len(names), 60))])
    file.write(str(path))
    return path


@pytest.mark.parametrize(("unit", "factor"), [("mm", 1e-3), ("cm", 1e-2), ("m", 1.0)])
def test_points_names_unit_and_rate(tmp_path, points, unit, factor):
    (raw,) = read_c3d(write(tmp_path / "take.c3d", points, unit=unit, rate=120.0))
    assert raw.point_names == tuple(NAMES)
    assert raw.unit == unit
    assert_allclose(raw.positions, points, rtol=1e-6, atol=1e-4)  # C3D keeps 32 bits
    assert_allclose(np.diff(raw.time), 1 / 120, rtol=1e-6)
    options = ImportOptions(points={"shoulder": ("RSHO",), "index": ("Anna:RFIN",)})
    (take,) = import_file(tmp_path / "take.c3d", options).takes
    assert take.point_names == ("shoulder", "index")
    assert_allclose(take.positions, factor * points[:, [0, 2]], rtol=1e-6, atol=factor * 1e-4)


def test_names_that_are_no_utf_8_are_taken_for_latin_1(tmp_path, points):
    path = write(tmp_path / "take.c3d", points, names=["Ann?:RSHO", *NAMES[1:]])
    path.write_bytes(path.read_bytes().replace(b"Ann?:RSHO", b"Ann\xe9:RSHO"))
    assert read_c3d(path)[0].point_names[0] == "Ann\u00e9:RSHO"


def test_lost_markers_are_named_filled_or_refused(tmp_path, points):
    points[10:14, 1] = np.nan
    points[30:42, 2] = 0.0
    path = write(tmp_path / "take.c3d", points)
    label = Label(0, 0, "reach", (), "Anna")
    found = import_file(path, ImportOptions(), label)
    assert found.takes[0].labels == ()
    (detail,) = found.rejected
    assert "take.c3d: reach, frames 0-59: lost for longer than 0.1 s: Anna:RFIN in frames 30-41 (0.12 s)" in detail
    found = import_file(path, ImportOptions(), label, max_gap=0.2)
    assert found.rejected == ()
    assert "filled Anna:RELB in frames 10-13 (0.04 s); Anna:RFIN in frames 30-41" in found.remarks[0]
    assert [(one.first, one.end) for one in found.takes[0].labels] == [(0, 60)]


def test_damaged_files_are_refused(tmp_path, points):
    content = write(tmp_path / "take.c3d", points).read_bytes()
    for number, damaged in enumerate([b"", b"no C3D at all", content[:100], content[:700], bytes(600) + content]):
        path = tmp_path / f"{number}.c3d"
        path.write_bytes(damaged)
        with pytest.raises(DemonstrationError, match=r"cannot be read as C3D: .*export it again|names; expected"):
            read_c3d(path)


def test_a_reader_that_hangs_is_ended(tmp_path, points):
    path = write(tmp_path / "take.c3d", points)
    with pytest.raises(DemonstrationError, match=r"is not read within 0.001 s: a damaged C3D file"):
        read_c3d(path, time_limit_s=0.001)
