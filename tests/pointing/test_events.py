"""A target becomes one gesture, once the hand has rested at it; a lost or unseen arm points at nothing."""

from __future__ import annotations

import pytest

from paramove.action_space.messages import certainty
from paramove.msgs.action_estimate_pb2 import ActionEstimate
from paramove.msgs.gesture_pb2 import Gesture
from paramove.pointing.events import PointingEvents


def estimate(at_ms: int, number: int = 1, arrived_ms: int = 0, deviation: float = 0.01, **changed) -> ActionEstimate:
    message = ActionEstimate(frame="table")
    message.captured.FromMilliseconds(at_ms)
    if number:
        target = message.target
        target.number, target.action = number, changed.pop("action", "pointing")
        target.arrived.FromMilliseconds(arrived_ms)
        target.location.x, target.location.y = 0.1, -0.2
        target.location.x_deviation = deviation
    for name, value in changed.items():
        setattr(message, name, value)
    return message


def said(*estimates: ActionEstimate) -> list[int]:
    """Capture times of the gestures, ms."""
    events = PointingEvents()
    gestures = [events.update(one) for one in estimates]
    return [gesture.captured.ToMilliseconds() for gesture in gestures if gesture is not None]


def test_a_target_is_said_once_when_it_has_settled() -> None:
    assert said(*(estimate(at) for at in range(0, 1000, 100))) == [200]


def test_the_gesture_tells_place_frame_and_certainty() -> None:
    gesture = PointingEvents().update(estimate(300))
    assert gesture is not None
    assert (gesture.kind, gesture.frame, gesture.located) == (Gesture.KIND_POINTED_AT, "table", True)
    assert (gesture.x, gesture.y) == (0.1, -0.2)
    assert gesture.confidence == pytest.approx(0.9)


def test_each_target_is_said_and_a_tracker_that_began_anew_too() -> None:
    assert said(estimate(300), estimate(900, 2, 600), estimate(1500, 1, 1200)) == [300, 900, 1500]


@pytest.mark.parametrize(
    "unfit",
    [
        {"number": 0},
        {"lost": True},
        {"degraded": True},
        {"action": "reaching"},
        {"deviation": 0.09},
    ],
    ids=str,
)
def test_what_is_no_certain_pointing_is_no_gesture(unfit: dict[str, object]) -> None:
    assert said(estimate(300, **unfit)) == []


@pytest.mark.parametrize("x", [float("nan"), float("inf"), 1e300])
def test_a_place_that_is_no_number_is_no_gesture(x: float) -> None:
    message = estimate(300)
    message.target.location.x = x
    assert PointingEvents().update(message) is None


def test_a_target_that_becomes_certain_late_is_said_then() -> None:
    assert said(estimate(300, deviation=0.09), estimate(400, deviation=0.02)) == [400]


def test_a_target_that_becomes_certain_too_late_is_none() -> None:
    """Somebody who rested there a while ago does not point there now."""
    assert said(estimate(300, deviation=0.09), estimate(3100, deviation=0.02)) == []
    assert said(estimate(300, deviation=0.09), estimate(2900, deviation=0.02)) == [2900]


@pytest.mark.parametrize(
    ("deviation", "expected"), [((0.0, 0.0, 0.0), 1.0), ((0.05, 0.01, 0), 0.5), ((0, 1.0, 0), 0.0)]
)
def test_certainty_is_that_of_the_least_certain_axis(deviation: tuple[float, float, float], expected: float) -> None:
    assert certainty(deviation) == pytest.approx(expected)
