"""Errors of gripper and homography against constructed ones."""

import cv2
import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from paramove.runs.rule_learning.accuracy import accuracy_of, project, summary_statistics
from tests.runs.synthetic_run import SHOULDER, layout


def test_commanded_gripper_on_its_target_has_no_error(evaluated):
    summary = evaluated().summary
    assert summary["gripper_error_commanded_mm"]["grasp"]["samples"] == 1
    np.testing.assert_allclose(summary["gripper_error_commanded_mm"]["grasp"]["max"], 0.0, rtol=0, atol=1e-9)


def test_physical_error_is_the_distance_from_the_commanded_gripper(evaluated):
    error = evaluated(gripper_off=(0.003, 0.0, -0.004)).summary["gripper_error_physical_mm"]
    np.testing.assert_allclose([error["grasp"]["max"], error["overall"]["median"]], [5.0, 5.0], rtol=1e-9)


def test_homography_of_the_true_camera_errs_only_by_the_lens(evaluated):
    grid = accuracy_of(evaluated().run)["grid_mm"]
    assert 0.0 < grid["median"] < grid["p95"] <= grid["max"] < 1.0
    assert grid["samples"] == 12 * 23


def test_homography_that_is_off_is_found_out(evaluated):
    accuracy = accuracy_of(evaluated(calibration_off=(0.0, 0.006)).run)
    np.testing.assert_allclose(accuracy["grid_mm"]["median"], 6.0, rtol=0, atol=0.5)


def test_only_standing_objects_count_as_seen_at_rest(evaluated):
    (seen,) = accuracy_of(evaluated().run)["seen_at_rest"]
    assert seen["object"] == "yellow"
    np.testing.assert_allclose(seen["error_mm"], 1.0, rtol=1e-6)


def test_run_without_calibration_has_no_errors(evaluated):
    run = evaluated().run
    run.messages.pop("calibration/plane")
    assert accuracy_of(run)["grid_mm"] == {"median": None, "max": None, "samples": 0, "p95": None}


@settings(deadline=None, max_examples=30, derandomize=True)
@given(st.lists(st.tuples(*[st.floats(-0.1, 0.1)] * 3), min_size=1, max_size=5))
def test_projection_is_that_of_opencv(offsets):
    points = np.array(offsets) + SHOULDER + [0.16, 0.0, -0.1]
    truth = layout()
    fx, fy, cx, cy, k1 = truth.camera_intrinsics
    matrix = np.array(truth.camera_from_world).reshape(4, 4)
    camera = np.array([[fx, 0, cx], [0, fy, cy], [0, 0, 1]])
    turn = cv2.Rodrigues(matrix[:3, :3])[0]
    expected = cv2.projectPoints(points, turn, matrix[:3, 3], camera, np.array([k1, 0, 0, 0]))[0][:, 0]
    np.testing.assert_allclose(project(truth, points), expected, rtol=0, atol=1e-6)


def test_spread_of_nothing_is_not_zero():
    assert summary_statistics([]) == {"median": None, "max": None, "samples": 0}
    assert summary_statistics([3.0, 1.0, 2.0]) == {"median": 2.0, "max": 3.0, "samples": 3}
