"""Units, axes and names: every file's numbers become metres, x forward, y left, z up."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from paramove.demonstrations.importing import ImportOptions, read_mapping_file
from paramove.demonstrations.importing.checking import RawTake
from paramove.demonstrations.importing.conversion import axes_matrix, converted
from paramove.demonstrations.movement import DemonstrationError
from paramove.demonstrations.writing import Label

FILE = "take.csv"


def raw(**changes):
    positions = np.arange(1.0, 19.0).reshape(3, 2, 3)
    return RawTake(
        **(
            {"name": "a take", "time": np.arange(3) / 100, "positions": positions, "point_names": ("A", "S:B")}
            | changes
        )
    )


@pytest.mark.parametrize(
    ("axes", "forward_left_up"),
    [
        ("z_up", [1, 2, 3]),
        ("y_up", [3, 1, 2]),
        ("right,up,forward", [3, -1, 2]),
        ("Unity, x right, y up, z forward", [3, -1, 2]),
        ("Vicon lab frame, z up", [1, 2, 3]),
        ("some frame, y up", [3, 1, 2]),
        ("backward,right,up", [-1, -2, 3]),
        ("right, down, forward", [3, -1, -2]),
    ],
)
def test_axes(axes, forward_left_up):
    assert_allclose(axes_matrix(axes) @ [1, 2, 3], forward_left_up, rtol=0.0, atol=0.0)


@pytest.mark.parametrize("axes", ["", "up", "x_up", "forward,backward,up", "forward,left", "forward,left,up,down"])
def test_what_is_no_axes(axes):
    with pytest.raises(DemonstrationError, match="expected z_up, y_up, or the directions of the file's x, y and z"):
        axes_matrix(axes)


@pytest.mark.parametrize(
    ("unit", "factor"), [("m", 1.0), ("cm", 0.01), ("mm", 0.001), ("MM", 0.001), ("Meters", 1.0), ("centimetres", 0.01)]
)
def test_units(unit, factor):
    take, _ = converted(raw(unit=unit), ImportOptions(), FILE)
    assert_allclose(take.positions, factor * raw().positions, rtol=1e-15, atol=0.0)
    assert take.recording == "a_take.mcap"


def test_what_the_user_says_comes_before_what_the_file_says():
    take, _ = converted(raw(unit="mm", axes="z_up"), ImportOptions(unit="m", axes="y_up", rate_hz=10.0), FILE)
    assert_allclose(take.positions[0, 0], [3.0, 1.0, 2.0], rtol=0.0, atol=0.0)
    assert_allclose(take.time, [0.0, 0.1, 0.2], rtol=0.0, atol=1e-15)


def test_targets_are_converted_with_the_points():
    label = Label(0, 3, "reach", (100.0, 200.0, 300.0), "P1")
    names = ("target_x", "target_y", "target_z")
    take, _ = converted(raw(unit="mm", axes="y_up", labels=(label,), parameter_names=names), ImportOptions(), FILE)
    assert take.labels[0].theta == pytest.approx((0.3, 0.1, 0.2))
    other, _ = converted(raw(unit="mm", labels=(label,), parameter_names=("u", "v", "w")), ImportOptions(), FILE)
    assert other.labels[0].theta == (100.0, 200.0, 300.0)


@pytest.mark.parametrize(
    ("changes", "options", "detail"),
    [
        ({}, {}, "take.csv does not define its unit; give --unit m, cm, mm"),
        ({"unit": "inch"}, {}, "the unit is 'inch'; give --unit"),
        ({"unit": "m", "time": None}, {}, "has neither times nor a frame rate; give --rate"),
        ({"unit": "m", "time": np.array([0.0, 2.0, 1.0])}, {}, "the time of frame 2 is 1, not after 2"),
        ({"unit": "m"}, {"points": {"index": ("C",)}}, "has no point 'C' for index"),
    ],
)
def test_what_is_missing_is_told_with_its_option(changes, options, detail):
    with pytest.raises(DemonstrationError, match=detail):
        converted(raw(**changes), ImportOptions(**options), FILE)


def test_points_are_chosen_renamed_and_averaged():
    points = {"wrist": ("A", "B"), "index": ("S:B",)}
    take, _ = converted(raw(unit="m"), ImportOptions(points=points), FILE)
    assert take.point_names == ("wrist", "index")
    assert_allclose(take.positions[:, 0], raw().positions.mean(axis=1), rtol=1e-15, atol=0.0)
    assert_allclose(take.positions[:, 1], raw().positions[:, 1], rtol=0.0, atol=0.0)


def test_zeros_are_lost_unless_they_are_places():
    positions = raw().positions.copy()
    positions[1, 0] = 0.0
    positions[2, 1, 0] = 0.0
    lost, _ = converted(raw(unit="m", positions=positions), ImportOptions(), FILE)
    assert np.isnan(lost.positions[1, 0]).all()
    assert np.isfinite(lost.positions).sum() == 15
    places, _ = converted(raw(unit="m", positions=positions), ImportOptions(zeros_are_lost=False), FILE)
    assert np.isfinite(places.positions).all()


def test_a_mapping_file(tmp_path):
    path = tmp_path / "mapping.yaml"
    path.write_text("unit: mm\naxes: y_up\nrate: 120\npoints:\n  wrist: [RWRA, RWRB]\n  index: RFIN\n")
    options = read_mapping_file(path)
    assert options == ImportOptions("mm", "y_up", {"wrist": ("RWRA", "RWRB"), "index": ("RFIN",)}, 120.0, True)


@pytest.mark.parametrize(
    ("text", "detail"),
    [
        ("units: mm", r"mapping.yaml:1:1: units: did you mean 'unit'\?"),
        ("unit: inch", "mapping.yaml:1:1: unit: Input should be 'm', 'cm' or 'mm'"),
        ("axes: up", "axes 'up': expected z_up"),
        ("points: {index: []}", "mapping.yaml:1:10: points.index"),
        ("points: {index: [}", "mapping.yaml:1:"),
    ],
)
def test_a_wrong_mapping_file_is_told_with_its_place(tmp_path, text, detail):
    path = tmp_path / "mapping.yaml"
    path.write_text(text)
    with pytest.raises(DemonstrationError, match=detail):
        read_mapping_file(path)


def test_a_missing_mapping_file(tmp_path):
    with pytest.raises(DemonstrationError, match="there is no mapping file"):
        read_mapping_file(tmp_path / "no.yaml")
