"""A recent window of arm poses: each pointing is said once, with its place, and nothing else is."""

from __future__ import annotations

import numpy as np
import pytest

from paramove.action_space.person import PersonPlacement
from paramove.demonstrations import POINT_NAMES, table_place
from paramove.documents.input_error import InputError
from paramove.msgs.arm_pose_pb2 import ArmPose
from paramove.msgs.gesture_pb2 import Gesture
from paramove.pointing.last_part_model import LastPartModel
from paramove.pointing.window import PointingWindow, PointingWindowOptions
from tests.pointing.persons import NAMES, joined, performed, poses

PLACES = [(0.2, 0.3), (0.75, 0.6), (0.5, 0.9)]


@pytest.fixture(scope="module")
def model() -> LastPartModel:
    return LastPartModel.of_points(NAMES)


@pytest.fixture
def window(model) -> PointingWindow:
    return PointingWindow(model, PersonPlacement())


def said(window, messages) -> list[Gesture]:
    return [gesture for pose in messages if (gesture := window.update(pose)) is not None]


def errors(gestures, places) -> np.ndarray:
    found = np.array([(one.x, one.y) for one in gestures])
    return np.linalg.norm(found - table_place(places)[:, :2], axis=1)


@pytest.mark.parametrize(("seed", "rate_hz"), [(0, 15.0), (1, 15.0), (0, 10.0), (0, 60.0)])
def test_each_pointing_is_said_once_with_its_place(window, rate_hz, seed):
    gestures = said(window, poses(performed("pointing", PLACES, seed), rate_hz))
    assert len(gestures) == len(PLACES)
    assert errors(gestures, PLACES).max() < 0.05
    assert all(one.kind == Gesture.KIND_POINTED_AT and one.located and one.frame == "table" for one in gestures)
    assert all(0.5 < one.confidence <= 1.0 for one in gestures)


def test_a_pointing_is_said_while_the_hand_is_still_there(window):
    body = performed("pointing", PLACES[:1])
    index = body[:, POINT_NAMES.index("index")]
    times = np.arange(len(body)) / 60.0
    there = times[np.linalg.norm(index - table_place(PLACES[0]), axis=1) < 0.03]
    (gesture,) = said(window, poses(body))
    assert there[0] < gesture.captured.ToNanoseconds() * 1e-9 < there[-1] + 0.2


@pytest.mark.parametrize("seed", range(2))
def test_reaching_is_not_pointing(window, seed):
    assert said(window, poses(performed("reaching", PLACES, seed))) == []


def test_elbow_and_wrist_alone_are_the_paper_s_and_take_reaching_for_pointing():
    two = ("elbow", "wrist")
    window = PointingWindow(LastPartModel.of_points(two), PersonPlacement(), PointingWindowOptions(points=two))
    gestures = said(window, poses(performed("pointing", PLACES)))
    assert len(gestures) == len(PLACES)
    assert errors(gestures, PLACES).max() < 0.06
    assert said(window, poses(performed("reaching", PLACES))) != []


def resting() -> np.ndarray:
    return np.repeat(performed("pointing", PLACES[:1])[:1], 400, axis=0)


def withdrawing() -> np.ndarray:
    """From the target home: the first that is seen is the hand at the target."""
    body = performed("pointing", PLACES[:1])
    tip = body[:, POINT_NAMES.index("index")]
    return body[int(np.linalg.norm(tip - table_place(PLACES[0]), axis=1).argmin()) :]


def waving() -> np.ndarray:
    """The hand up beside the head, the forearm swinging, six times."""
    base = performed("pointing", PLACES[:1])[0].copy()
    elbow, wrist, index = (POINT_NAMES.index(name) for name in NAMES)
    up, angle = [], 0.5 * np.sin(2 * np.pi * np.arange(240) / 40.0)
    for one in angle:
        body = base.copy()
        body[elbow] = base[1] + (0.10, -0.20, -0.12)
        forearm = np.array([0.3, np.sin(one), np.cos(one)]) / np.linalg.norm([0.3, np.sin(one), np.cos(one)])
        body[wrist], body[index] = body[elbow] + 0.26 * forearm, body[elbow] + 0.44 * forearm
        up.append(body)
    return joined([np.linspace(base, up[0], 60), np.array(up), np.linspace(up[-1], base, 60)])


def scratching() -> np.ndarray:
    """The hand to the head, little circles there, and back."""
    base = performed("pointing", PLACES[:1])[0].copy()
    elbow, wrist, index = (POINT_NAMES.index(name) for name in NAMES)
    there = base.copy()
    there[elbow], there[wrist], there[index] = (-0.05, -0.35, 0.35), (-0.15, -0.15, 0.50), (-0.22, -0.05, 0.62)
    circles = np.repeat(there[None], 120, axis=0)
    phase = 2 * np.pi * np.arange(120) / 20.0
    circles[:, index] += 0.02 * np.stack([np.sin(phase), np.cos(phase), 0 * phase], axis=1)
    share = (0.5 - 0.5 * np.cos(np.linspace(0.0, np.pi, 60)))[:, None, None]
    return np.concatenate([base + share * (there - base), circles, there + share * (base - there)])


@pytest.mark.parametrize("movement", [resting, withdrawing, waving, scratching])
def test_other_movements_are_not_said(window, movement):
    assert said(window, poses(movement())) == []


def test_a_hand_that_stays_is_said_once_and_again_only_after_it_was_away(window):
    body = performed("pointing", PLACES[:1])
    tip = body[:, POINT_NAMES.index("index")]
    there = int(np.linalg.norm(tip - table_place(PLACES[0]), axis=1).argmin())
    stays = np.concatenate([body[:there], np.repeat(body[there : there + 1], 300, axis=0), body[there:]])
    assert len(said(window, poses(stays))) == 1


def test_a_gap_in_the_window_is_not_bridged(window):
    """The last part is not seen: from 0.7 s before the hand is there until it has been there for a moment."""
    body = performed("pointing", PLACES[:1])
    tip = body[:, POINT_NAMES.index("index")]
    arrives_s = float(np.argmax(np.linalg.norm(tip - table_place(PLACES[0]), axis=1) < 0.02)) / 60.0
    hidden = [one for one in poses(body) if not arrives_s - 0.5 < one.captured.ToNanoseconds() * 1e-9 < arrives_s]
    assert len(hidden) < len(list(poses(body)))
    assert said(window, hidden) == []


def test_a_few_missing_points_do_no_harm(window):
    messages = list(poses(performed("pointing", PLACES[:1])))
    for number, pose in enumerate(messages):
        if number % 7 == 3:
            del pose.points[number % 3]
        if number % 7 == 5:
            pose.points[0].x = float("nan")
    assert len(said(window, messages)) == 1


def test_repeated_and_late_samples_change_nothing(model):
    messages = list(poses(performed("pointing", PLACES[:2])))
    shuffled = []
    for number, pose in enumerate(messages):
        shuffled += [pose, pose] if number % 2 else [pose]
        if number > 5:
            shuffled.append(messages[number - 3])
    one, other = (said(PointingWindow(model, PersonPlacement()), some) for some in (messages, shuffled))
    assert one == other
    assert len(one) == 2


def test_a_tracker_that_was_started_again_is_heard(window):
    messages = list(poses(performed("pointing", PLACES[:1])))
    assert len(said(window, messages)) == 1
    assert len(said(window, messages)) == 1  # the clock began anew


def test_poses_of_another_frame_are_left_out(window):
    messages = list(poses(performed("pointing", PLACES[:1])))
    for pose in messages:
        pose.frame = "right_shoulder"
    assert said(window, messages) == []
    assert window.update(ArmPose()) is None


def test_where_and_how_tall_a_person_sits_changes_only_the_place(model):
    placement = PersonPlacement((0.1, -0.05, 0.42), 1.1)
    messages = list(poses(performed("pointing", PLACES)))
    for pose in messages:
        for point in pose.points:
            point.x, point.y, point.z = placement.in_world(np.array([point.x, point.y, point.z]))
    gestures = said(PointingWindow(model, placement), messages)
    expected = placement.in_world(table_place(PLACES))[:, :2]
    assert np.linalg.norm(np.array([(one.x, one.y) for one in gestures]) - expected, axis=1).max() < 0.06


def test_the_ball_is_green_when_the_hand_is_at_the_target_and_not_before(window):
    body = performed("pointing", PLACES[:1])
    green = []
    for pose in poses(body):
        gesture, ball = window.update(pose), window.ball()
        if ball is not None:
            colour = ball.entities[0].spheres[0].color
            green.append((colour.g > 0.9, gesture is not None))
    first = next(number for number, (is_green, _) in enumerate(green) if is_green)
    told = next(number for number, (_, is_said) in enumerate(green) if is_said)
    assert 0 < first <= told <= first + 8
    assert np.mean([is_green for is_green, _ in green]) < 0.5


@pytest.mark.parametrize(
    ("wrong", "told"),
    [({"points": ("elbow",)}, "at least two different points"), ({"settled_s": -1.0}, "settled_s: a positive")],
)
def test_wrong_options_are_refused(wrong, told):
    with pytest.raises(InputError, match=told):
        PointingWindowOptions(**wrong)
