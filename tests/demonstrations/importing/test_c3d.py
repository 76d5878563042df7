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
    assert any("filled Anna:RELB in frames 10-13 (0.04 s); Anna:RFIN in frames 30-41" in one for one in found.remarks)
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


def finger(labels, frames=61, **parameters):
    """A C3D file of points at (0.2, -0.1, 0.9) m that go 0.4 m along x, in mm; `parameters`: of POINT."""
    file = ezc3d.c3d()
    file["parameters"]["POINT"]["RATE"]["value"] = [60.0]
    file["parameters"]["POINT"]["LABELS"]["value"] = list(labels)
    file["parameters"]["POINT"]["UNITS"]["value"] = ["mm"]
    for name, value in parameters.items():
        file.add_parameter("POINT", name, [value])
    points = np.ones((4, len(labels), frames))
    points[:3] = np.array([200.0, -100.0, 900.0])[:, None, None]
    points[0] += np.linspace(0.0, 400.0, frames)
    points[1] += 50.0 * np.arange(len(labels))[:, None]
    file["data"]["points"] = points
    return file


@pytest.mark.parametrize(
    ("up", "turned"),
    [("+Z", "xyz"), ("+Y", "yzx"), ("+X", "zxy"), ("-Z", "xYZ"), ("-Y", "YZx"), ("-X", "ZxY"), ("z", "xyz")],
)
def test_y_screen_says_which_axis_is_up(tmp_path, up, turned):
    """`turned`: which of forward, left, up each axis of the file is, as x, y, z; capital: against it."""
    file = finger(["index"], X_SCREEN="+X", Y_SCREEN=up)
    as_is = np.array(file["data"]["points"])
    for axis, letter in enumerate(turned):
        sign = -1.0 if letter.isupper() else 1.0
        file["data"]["points"][axis] = sign * as_is["xyz".index(letter.lower())]
    file.write(str(tmp_path / "take.c3d"))
    found = import_file(tmp_path / "take.c3d", ImportOptions())
    assert_allclose(found.takes[0].positions[0, 0], [0.2, -0.1, 0.9], rtol=0.0, atol=1e-6)
    assert not any("taken as up" in remark for remark in found.remarks)


def test_a_big_endian_file_is_named_with_the_remedy(tmp_path):
    path = tmp_path / "take.c3d"
    finger(["index"]).write(str(path))
    content = bytearray(path.read_bytes())
    content[512 * (content[0] - 1) + 3] = 86
    path.write_bytes(content)
    with pytest.raises(DemonstrationError, match=r"big-endian.*Intel"):
        read_c3d(path)


@pytest.mark.parametrize("labels", [["index", "elbow", "*", "*"], ["index", "a", "a"], ["index", "", ""]])
def test_equal_names_matter_only_where_they_are_requested(tmp_path, labels):
    finger(labels).write(str(tmp_path / "take.c3d"))
    (take,) = import_file(tmp_path / "take.c3d", ImportOptions(points={"index": ("index",)})).takes
    assert take.point_names == ("index",)
    finger([*labels, "index"]).write(str(tmp_path / "take.c3d"))
    with pytest.raises(DemonstrationError, match=rf"index \(point 1\), index \(point {len(labels) + 1}\)"):
        import_file(tmp_path / "take.c3d", ImportOptions(points={"index": ("index",)}))


def test_a_negative_residual_is_a_loss(tmp_path):
    file = finger(["index", "elbow"])
    residuals = np.zeros((1, 2, 61))
    residuals[0, 0, 20:40] = -1.0
    file["data"]["meta_points"]["residuals"] = residuals
    file.write(str(tmp_path / "take.c3d"))
    found = import_file(tmp_path / "take.c3d", ImportOptions(), Label(0, 0, "reach"))
    assert "index in frames 20-39" in found.rejected[0]


@pytest.mark.parametrize("form", ["trial", "long frames", "none"])
def test_a_capture_longer_than_its_header_can_say_is_not_cut_without_a_word(tmp_path, form):
    """ezc3d 1.7.2 writes all frames, and reads 65535 of them."""
    frames = 65600
    file = finger(["index", "elbow"], frames)
    if form == "trial":
        file.add_parameter("TRIAL", "ACTUAL_START_FIELD", [1, 0])
        file.add_parameter("TRIAL", "ACTUAL_END_FIELD", [frames % 65536, frames // 65536])
    if form == "long frames":
        file.add_parameter("POINT", "LONG_FRAMES", [float(frames)])
    file.write(str(tmp_path / "take.c3d"))
    with pytest.raises(DemonstrationError, match=r"656\d\d frames were captured.* counts only 65535"):
        read_c3d(tmp_path / "take.c3d")


def test_frames_that_were_never_captured_are_left_out(tmp_path):
    """POINT:FRAMES at its largest value, and the true number in TRIAL: ezc3d 1.7.2 adds frames at the origin."""
    frames = 65530
    file = finger(["index", "elbow"], frames)
    file.add_parameter("TRIAL", "ACTUAL_START_FIELD", [1, 0])
    file.add_parameter("TRIAL", "ACTUAL_END_FIELD", [frames, 0])
    path = tmp_path / "take.c3d"
    file.write(str(path))
    content = bytearray(path.read_bytes())
    at = content.index(b"FRAMES") + len(b"FRAMES") + 4
    assert content[at : at + 2] == frames.to_bytes(2, "little")
    content[at : at + 2] = b"\xff\xff"
    path.write_bytes(content)
    (raw,) = read_c3d(path)
    assert len(raw.positions) == frames
    assert (raw.positions != 0.0).all()
