"""Joint units of HOAP-3: thesis table 5.1 to the count, round trips, refusals."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from paramove.robots.joint_units import JointRangeError
from tests.robots.hoap3.movements import HOAP3

UNITS = HOAP3.units
TABLE_5_1 = {  # joint: minimum deg, its integer, maximum deg, its integer
    "right_shoulder_pitch": (-91, -19019, 151, 31559),
    "right_shoulder_roll": (-96, -20064, 1, 209),
    "right_shoulder_torsion": (-91, 19019, 91, -19019),
    "right_elbow": (-115, 24035, 1, -209),
    "right_wrist": (-90, 0, 90, 120),
    "right_fingers": (-60, 0, 60, 120),
}


@pytest.mark.parametrize("joint", TABLE_5_1)
def test_right_arm_is_that_of_table_5_1(joint: str) -> None:
    low_deg, low_counts, high_deg, high_counts = TABLE_5_1[joint]
    place = HOAP3.index(joint)
    for degrees, counts in ((low_deg, low_counts), (high_deg, high_counts)):
        pose = HOAP3.base_pose.copy()
        pose[place] = np.deg2rad(degrees)
        assert UNITS.to_counts(pose)[place] == counts
    np.testing.assert_allclose(HOAP3.lower[place], np.deg2rad(low_deg), rtol=0, atol=1e-12)
    np.testing.assert_allclose(HOAP3.upper[place], np.deg2rad(high_deg), rtol=0, atol=1e-12)


@settings(deadline=None, max_examples=200, derandomize=True)
@given(part=st.lists(st.floats(min_value=0, max_value=1), min_size=28, max_size=28))
def test_round_trip_is_within_half_a_count(part: list[float]) -> None:
    angles = HOAP3.lower + np.array(part) * (HOAP3.upper - HOAP3.lower)
    back = UNITS.to_radians(UNITS.to_counts(angles))
    half_a_count = 0.5 / np.abs(UNITS.counts_per_rad)
    assert (np.abs(back - angles) <= half_a_count * (1 + 1e-9)).all()


@settings(deadline=None, max_examples=100, derandomize=True)
@given(
    joint=st.integers(min_value=0, max_value=27),
    value=st.one_of(
        st.sampled_from([np.nan, np.inf, -np.inf, 1e300]),
        st.floats(min_value=3.5, max_value=1e6),
        st.floats(min_value=-1e6, max_value=-3.5),
    ),
)
def test_what_no_joint_can_do_is_refused_and_named(joint: int, value: float) -> None:
    pose = HOAP3.base_pose.copy()
    pose[joint] = value
    with pytest.raises(JointRangeError, match=HOAP3.joint_names[joint]):
        UNITS.to_counts(pose)


@pytest.mark.parametrize("bad", [40000.0, -40000.0, 0.5, np.nan])
def test_counts_that_are_no_16_bit_integers_are_refused(bad: float) -> None:
    counts = UNITS.to_counts(HOAP3.base_pose).astype(float)
    counts[3] = bad
    with pytest.raises(JointRangeError, match="right_knee"):
        UNITS.to_radians(counts)


@pytest.mark.parametrize("shape", [(), (0,), (27,), (29,), (28, 1)])
def test_a_wrong_number_of_joints_is_refused(shape: tuple[int, ...]) -> None:
    with pytest.raises(JointRangeError, match="28 joints"):
        UNITS.to_counts(np.zeros(shape))
