"""BVH: places of joints against poses computed by hand."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from paramove.demonstrations.importing import ImportOptions, import_file
from paramove.demonstrations.importing.bvh import parse, read_bvh
from paramove.demonstrations.movement import DemonstrationError

ARM = """\
HIERARCHY
ROOT Hips
{
  OFFSET 0 0 0
  CHANNELS 6 Xposition Yposition Zposition Zrotation Xrotation Yrotation
  JOINT Shoulder
  {
    OFFSET -20 50 0
    CHANNELS 3 Zrotation Xrotation Yrotation
    JOINT Elbow
    {
      OFFSET -30 0 0
      CHANNELS 3 Zrotation Xrotation Yrotation
      End Site
      {
        OFFSET -25 0 0
      }
    }
  }
}
MOTION
Frames: 5
Frame Time: 0.01
0 100 0  0 0 0   0 0 0   0 0 0
5 100 7  0 0 0   0 0 0   0 0 0
0 100 0  0 0 90  0 0 0   0 0 0
0 100 0  0 0 0   90 0 0  0 0 0
0 100 0  0 0 90  90 0 0  0 0 90
"""
NAMES = ("Hips", "Shoulder", "Elbow", "Elbow_end")
BY_HAND = [
    # at rest the arm points to -x (the person's right)
    [(0, 100, 0), (-20, 150, 0), (-50, 150, 0), (-75, 150, 0)],
    # the root is carried to (5, 100, 7)
    [(5, 100, 7), (-15, 150, 7), (-45, 150, 7), (-70, 150, 7)],
    # a quarter turn about y (up): -x goes to +z
    [(0, 100, 0), (0, 150, 20), (0, 150, 50), (0, 150, 75)],
    # the shoulder turned a quarter about z: -x goes to -y, the arm hangs
    [(0, 100, 0), (-20, 150, 0), (-20, 120, 0), (-20, 95, 0)],
    # body turned about y, arm hanging, forearm turned about its own y: in the body -x goes to +z, which the shoulder's
    # turn about z keeps, and the body's turn about y takes to +x
    [(0, 100, 0), (0, 150, 20), (0, 120, 20), (25, 120, 20)],
]


def write(folder, text):
    path = folder / "take.bvh"
    path.write_text(text)
    return path


def test_poses_computed_by_hand(tmp_path):
    (raw,) = read_bvh(write(tmp_path, ARM))
    assert raw.point_names == NAMES
    assert_allclose(raw.positions, BY_HAND, rtol=0.0, atol=1e-9)
    assert_allclose(raw.time, np.arange(5) * 0.01, rtol=0.0, atol=1e-12)


def test_it_becomes_metres_forward_left_up(tmp_path):
    path = write(tmp_path, ARM)
    (take,) = import_file(path, ImportOptions(unit="cm", points={"elbow": ("Elbow",)}, zeros_are_lost=True)).takes
    assert_allclose(take.positions[0, 0], [0.0, -0.5, 1.5], rtol=0.0, atol=1e-12)  # x left -50, y up 150
    assert_allclose(take.positions[2, 0], [0.5, 0.0, 1.5], rtol=0.0, atol=1e-12)
    with pytest.raises(DemonstrationError, match="does not define its unit; give --unit"):
        import_file(path, ImportOptions())


def test_the_order_of_the_channels_is_the_order_of_the_turns(tmp_path):
    """Two quarter turns: about z, then about the turned x, or the other way round."""
    head = "HIERARCHY\nROOT A\n{\nOFFSET 0 0 0\nCHANNELS 2 %s %s\nEnd Site\n{\nOFFSET 0 1 0\n}\n}\n"
    motion = "MOTION\nFrames: 1\nFrame Time: 0.1\n90 90\n"
    first = parse(head % ("Zrotation", "Xrotation") + motion, "a")
    other = parse(head % ("Xrotation", "Zrotation") + motion, "b")
    from paramove.demonstrations.importing.bvh import joint_positions

    # R_z R_x y = R_z z = z; R_x R_z y = R_x (-x) = -x
    assert_allclose(joint_positions(first.joints, first.values)[0, 1], [0, 0, 1], rtol=0.0, atol=1e-12)
    assert_allclose(joint_positions(other.joints, other.values)[0, 1], [-1, 0, 0], rtol=0.0, atol=1e-12)


def test_position_channels_stand_in_place_of_the_offset(tmp_path):
    text = ARM.replace(
        "CHANNELS 3 Zrotation Xrotation Yrotation\n    JOINT", "CHANNELS 3 Xposition Yposition Zposition\n    JOINT"
    )
    motion = parse(text.replace("0 0 0   0 0 0   0 0 0\n", "0 0 0   1 2 3   0 0 0\n", 1), "a")
    from paramove.demonstrations.importing.bvh import joint_positions

    assert_allclose(joint_positions(motion.joints, motion.values)[0, 1], [1, 102, 3], rtol=0.0, atol=1e-12)


@pytest.mark.parametrize(
    ("old", "new", "detail"),
    [
        ("HIERARCHY", "HIERARCHIE", r"take.bvh:1: 'HIERARCHIE'; expected HIERARCHY"),
        ("JOINT Elbow", "JOINT Hips", "take.bvh:10: a second joint 'Hips'"),
        ("OFFSET -30 0 0", "OFFSET -30 zero 0", "take.bvh:12: 'zero'; expected an offset"),
        ("6 Xposition", "6 Xpos", "take.bvh:5: channel 'Xpos'; expected such as Xposition"),
        ("Frame Time: 0.01", "Frame Time: 0", "take.bvh:23: a frame time of 0 s"),
        ("0 100 0  0 0 90  90 0 0  0 0 90\n", "", "60 frames|48 numbers follow; 5 frames of 12 channels need 60"),
        ("5 100 7", "5 x 7", "take.bvh:25: 'x' is no number"),
        ("5 100 7", "5 nan 7", "take.bvh:25: nan in frame 1"),
        ("MOTION", "", "take.bvh:22: 'Frames:'; expected MOTION"),
        ("End Site", "End", "expected Site"),
    ],
)
def test_what_is_wrong_is_told_with_its_line(tmp_path, old, new, detail):
    assert old in ARM
    with pytest.raises(DemonstrationError, match=detail):
        read_bvh(write(tmp_path, ARM.replace(old, new, 1)))


def test_cut_anywhere_it_is_refused_with_a_line_or_whole():
    whole = parse(ARM, "whole").values
    rejected = 0
    for at in range(len(ARM)):
        try:
            values = parse(ARM[:at], "cut").values
        except DemonstrationError:
            rejected += 1
        else:
            assert (values.ravel()[:-1] == whole.ravel()[:-1]).all()  # of the last number digits may be missing
    assert rejected >= len(ARM) - 3
