"""The body frame does not depend on how a person is turned; left arms become right ones."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose

from paramove.demonstrations import body_frame
from paramove.demonstrations.movement import DemonstrationError
from tests.demonstrations.movements import movement


def turned(one, angle, shift, frame="laboratory"):
    turn = np.array([[np.cos(angle), -np.sin(angle), 0.0], [np.sin(angle), np.cos(angle), 0.0], [0.0, 0.0, 1.0]])
    return replace(one, positions=one.positions @ turn.T + shift, theta=turn @ one.theta + shift, frame=frame)


@settings(deadline=None, max_examples=40, derandomize=True)
@given(angle=st.floats(-7.0, 7.0), x=st.floats(-5.0, 5.0), y=st.floats(-5.0, 5.0), z=st.floats(0.0, 2.0))
def test_any_turn_and_place_give_the_same_body(angle, x, y, z):
    found = body_frame.in_body_frame(turned(movement(), angle, np.array([x, y, z])))
    assert found.frame == "body"
    assert_allclose(found.positions, movement().positions, rtol=0.0, atol=1e-12)
    assert_allclose(found.theta, movement().theta, rtol=0.0, atol=1e-12)


@pytest.mark.parametrize("angle", [0.0, 1.0, np.pi])
def test_a_left_arm_becomes_a_right_one(angle):
    flip = np.array([1.0, -1.0, 1.0])
    left = replace(movement(), positions=movement().positions * flip, theta=movement().theta * flip, side="left")
    found = body_frame.mirrored(body_frame.in_body_frame(turned(left, angle, np.array([1.0, 2.0, 0.0]))))
    assert found.side == "right"
    assert_allclose(found.positions, movement().positions, rtol=0.0, atol=1e-12)
    assert_allclose(found.theta, movement().theta, rtol=0.0, atol=1e-12)


def test_both_shoulders_tell_more_than_the_sternum():
    one = movement()
    other = one.point("shoulder") + np.array([0.0, 0.4, 0.0])
    sternum = one.point("sternum") + np.array([0.1, 0.0, 0.0])  # before the shoulders
    positions = np.concatenate([sternum[:, None], one.positions[:, 1:], other[:, None]], axis=1)
    both = replace(one, positions=positions, point_names=(*one.point_names, "other_shoulder"))
    assert_allclose(body_frame.in_body_frame(both).point("index"), one.point("index"), rtol=0.0, atol=1e-12)


def test_parameters_that_are_no_place_are_left_alone():
    one = replace(movement(), parameter_names=("u", "v", "w"))
    assert_allclose(body_frame.in_body_frame(turned(one, 1.0, np.zeros(3))).theta, turned(one, 1.0, 0.0).theta, rtol=0)


def test_arm_and_scale():
    one = movement()
    assert_allclose(body_frame.arm_length(body_frame.scaled(one, 2.0)), 2 * body_frame.arm_length(one), rtol=1e-12)
    assert_allclose(body_frame.scaled(one, 2.0).theta, 2.0 * one.theta, rtol=1e-12)


@pytest.mark.parametrize("change", [body_frame.mirrored, lambda one: body_frame.scaled(one, 2.0)])
def test_only_in_the_body_frame(change):
    with pytest.raises(DemonstrationError, match="is in the frame 'laboratory'; bring it to the body frame"):
        change(replace(movement(), frame="laboratory"))


def test_a_lying_person_or_wrong_axes_are_refused():
    lying = replace(movement(), positions=movement().positions[:, :, [0, 2, 1]])
    with pytest.raises(DemonstrationError, match=r"apart seen from above; .* Check units, axes \(z must point up\)"):
        body_frame.in_body_frame(replace(lying, positions=lying.positions * [1.0, 0.5, 1.0]))
