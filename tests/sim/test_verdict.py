"""What the judge calls a success, on synthetic truth."""

from __future__ import annotations

import numpy as np
import pytest

from paramove.msgs.truth_pb2 import TruthBody, TruthLayout, TruthState
from sim import tool_box
from sim.verdict import REST_STATES, Verdict

SURFACE_Z = -0.009
PLACES = {"a": (0.10, -0.2), "b": (0.10, -0.1)}
UPRIGHT = (0.0, 0.0, 0.0, 1.0)
LYING = (np.sqrt(0.5), 0.0, 0.0, np.sqrt(0.5))
BOTTOM_Z = SURFACE_Z - tool_box.COMPARTMENT_DEPTH + tool_box.CYLINDER_HALF_HEIGHT


def _layout() -> TruthLayout:
    layout = TruthLayout(seed=4, surface_z=SURFACE_Z)
    for name, (x, y) in PLACES.items():
        layout.openings.add(name=name, x=x, y=y, radius=tool_box.OPENING_RADIUS)
    layout.rules.add(object="yellow", opening="a")
    layout.objects.add(name="yellow", width=0.020, height=0.050)
    return layout


def _body(
    x: float = 0.10,
    y: float = -0.2,
    z: float = BOTTOM_Z,
    quaternion: tuple[float, ...] = UPRIGHT,
    touched: str = "robot",
) -> TruthBody:
    return TruthBody(name="yellow", x=x, y=y, z=z, quaternion_xyzw=quaternion, last_touched_by=touched)


def _judged(*bodies: TruthBody) -> Verdict:
    """Fed with one state per body; a single body stays for long enough to be at rest."""
    verdict = Verdict(_layout())
    for number, body in enumerate(bodies if len(bodies) > 1 else bodies * REST_STATES):
        verdict.take(_state(number, body))
    return verdict


def _state(number: int, body: TruthBody, gripper: float = 0.0, commanded: float = 0.0) -> TruthState:
    return TruthState(
        time_ns=number * 66_666_667,
        objects=[body],
        gripper=[gripper, 0.0, 0.0],
        gripper_commanded=[commanded, 0.0, 0.0],
        unwanted_contacts=2,
        deepest_penetration_mm=0.31,
    )


def test_an_object_at_the_bottom_of_its_compartment_is_a_success() -> None:
    summary = _judged(_body()).summary()
    assert summary["success"]
    assert summary["placed"] == 1
    assert summary["objects"]["yellow"]["rests_in"] == "a"
    assert summary["unwanted_contacts"] == 2
    assert summary["deepest_penetration_mm"] == pytest.approx(0.31)


@pytest.mark.parametrize(
    ("body", "why"),
    [
        (_body(y=-0.1), "in another opening"),
        (_body(z=SURFACE_Z + 0.025), "stands on the box"),
        (_body(z=SURFACE_Z - 0.020), "sticks out by 5 mm"),
        (_body(x=0.12), "beside the opening"),
        (_body(touched="instructor"), "the instructor touched it last"),
        (_body(touched=""), "nobody touched it"),
        (_body(z=SURFACE_Z + 0.008, quaternion=LYING), "lies over the opening"),
    ],
    ids=lambda value: value if isinstance(value, str) else "",
)
def test_anything_else_is_none(body: TruthBody, why: str) -> None:
    assert not _judged(body).summary()["success"], why


def test_a_tilted_object_counts_by_its_highest_point() -> None:
    tilted = (np.sin(np.pi / 8), 0.0, 0.0, np.cos(np.pi / 8))  # by 45 degrees: 24.7 mm from centre to highest point
    assert _judged(_body(z=SURFACE_Z - 0.0252, quaternion=tilted)).summary()["success"]
    assert not _judged(_body(z=SURFACE_Z - 0.0240, quaternion=tilted)).summary()["success"]


def test_an_object_that_still_moves_is_none() -> None:
    falling = [_body(z=BOTTOM_Z + 0.0005 * (REST_STATES - place)) for place in range(REST_STATES)]
    assert not _judged(*falling).summary()["success"]
    assert _judged(*falling, *[_body()] * REST_STATES).summary()["success"]


def test_an_object_not_seen_for_a_second_is_not_at_rest() -> None:
    assert not _judged(_body(), _body()).summary()["success"]


def test_gripper_error_at_rest_and_overall() -> None:
    verdict = Verdict(_layout())
    for number in range(10):  # moves on by 1 cm each, lags by 3 mm
        verdict.take(_state(number, _body(), gripper=0.01 * number - 0.003, commanded=0.01 * number))
    for number in range(10, 20):  # rests, 0.5 mm off
        verdict.take(_state(number, _body(), gripper=0.0895, commanded=0.09))
    summary = verdict.summary()
    assert summary["gripper_error_mm"] == {"median": pytest.approx(1.75), "max": pytest.approx(3.0), "samples": 20}
    assert summary["gripper_error_at_rest_mm"]["max"] == pytest.approx(0.5)
    assert summary["gripper_error_at_rest_mm"]["samples"] == 8
    assert summary["simulated_s"] == pytest.approx(19 / 15, abs=1e-3)


def test_a_run_without_truth_is_no_success() -> None:
    summary = Verdict(_layout()).summary()
    assert not summary["success"]
    assert "no state" in summary["reason"]
