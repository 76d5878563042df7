"""CSV files with names in their header."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from paramove.demonstrations.importing import ImportOptions, import_file
from paramove.demonstrations.importing.csv_file import read_csv
from paramove.demonstrations.movement import DemonstrationError

GOOD = "time,wrist_x,wrist_y,wrist_z,index_x,index_y,index_z\n0,1,2,3,4,5,6\n0.01,7,8,9,,nan,-\n0.02,1,1,1,2,2,2.5e0\n"


def write(folder, text, name="take.csv"):
    path = folder / name
    path.write_text(text, encoding="utf-8")
    return path


def test_names_times_and_lost_points(tmp_path):
    (raw,) = read_csv(write(tmp_path, GOOD))
    assert raw.point_names == ("wrist", "index")
    assert_allclose(raw.time, [0.0, 0.01, 0.02], rtol=0.0, atol=1e-15)
    assert_allclose(raw.positions[0], [[1, 2, 3], [4, 5, 6]], rtol=0.0, atol=0.0)
    assert np.isnan(raw.positions[1, 1]).all()
    assert raw.positions[2, 1, 2] == 2.5


@pytest.mark.parametrize(
    "text",
    [
        "frame;A.X;A.Y;A.Z\n1;1;2;3\n2;4;5;6\n",
        "\ufeffA X\tA Y\tA Z\r\n1\t2\t3\r\n4\t5\t6\r\n",
        "Ax,Ay,Az\n1,2,3\n\n4,5,6\n",
        '"A_z","A_x","A_y"\n3,1,2\n6,4,5\n',
    ],
)
def test_other_forms(tmp_path, text):
    (raw,) = read_csv(write(tmp_path, text))
    assert raw.point_names == ("A",)
    assert raw.time is None
    assert_allclose(raw.positions[:, 0], [[1, 2, 3], [4, 5, 6]], rtol=0.0, atol=0.0)


def test_columns_of_a_quaternion_are_no_point(tmp_path):
    (raw,) = read_csv(write(tmp_path, "A_x,A_y,A_z,A_qx,A_qy,A_qz,A_qw\n1,2,3,0,0,0,1\n"))
    assert raw.point_names == ("A",)
    assert "'A_qx', 'A_qy', 'A_qz', 'A_qw'" in raw.remarks[0]


def test_float64_is_kept_bit_by_bit(tmp_path):
    values = np.random.default_rng(0).normal(size=(20, 3))
    lines = [",".join(map(repr, row)) for row in values.tolist()]
    path = write(tmp_path, "a_x,a_y,a_z\n" + "\n".join(lines))
    (take,) = import_file(path, ImportOptions(unit="m", rate_hz=50.0)).takes
    assert (take.positions[:, 0] == values).all()


@pytest.mark.parametrize(
    ("old", "new", "detail"),
    [
        ("wrist_y", "wrist", "take.csv:1: wrist_y is missing; column 3 is called 'wrist'"),
        ("index_z", "index_y", r"take.csv:1: index_z is missing"),
        ("0,1,2,3,4,5,6", "0,1,2,3,4,5", "take.csv:2: 6 cells; the header names 7 columns"),
        ("7,8,9", "7,eight,9", "take.csv:3: wrist_y: 'eight' is no number"),
        ("0.02,", ",", "take.csv:4: time is empty; every frame has a time"),
        (",index_z", "", r"take.csv:1: index_z is missing|take.csv:2: 7 cells"),
    ],
)
def test_what_is_wrong_is_told_with_its_line(tmp_path, old, new, detail):
    with pytest.raises(DemonstrationError, match=detail):
        import_file(write(tmp_path, GOOD.replace(old, new, 1)), ImportOptions(unit="m"))


def test_decimal_commas_are_recognised(tmp_path):
    with pytest.raises(DemonstrationError, match="'1,5' is no number; write decimal points"):
        import_file(write(tmp_path, "a_x;a_y;a_z\n1,5;2;3\n1;2;3\n"), ImportOptions(unit="m", rate_hz=50.0))


@pytest.mark.parametrize("text", ["", "a_x,a_y,a_z\n", "time\n1\n2\n"])
def test_nothing_in_it(tmp_path, text):
    with pytest.raises(DemonstrationError, match=r"expected a header|no column of a point"):
        read_csv(write(tmp_path, text))
