"""The tracker's process: images in, estimates, arm poses, outlines and a ball out."""

from __future__ import annotations

import numpy as np
import pytest

from nodes import action_tracker
from paramove.action_space.messages import TablePose
from paramove.bus import topics
from paramove.bus.recorded import RecordedBus
from paramove.bus.subscriber import Received
from paramove.cameras.frames import Frame, encode
from paramove.demonstrations import table_place
from tests.action_space.drawn_arm import camera, drawn, pointing, write_setup


@pytest.fixture(scope="module")
def config(tmp_path_factory):
    return action_tracker.Config.model_validate(write_setup(tmp_path_factory.mktemp("setup")))


def heard(images, times, topic=topics.CAMERA_IMAGES[0]):
    for number, (image, time_s) in enumerate(zip(images, times, strict=True), start=1):
        time_ns = round(time_s * 1e9) + 1
        yield Received(topic, encode(Frame(image, time_ns, number)), time_ns, time_ns, number)


def test_says_estimate_pose_outline_and_ball_of_each_image(config):
    times, poses = pointing((0.5, 0.5))
    bus = RecordedBus(heard(drawn(poses, camera(1)), times))
    action_tracker.run(bus, config)
    assert [one.topic for one in bus.published[:4]] == list(action_tracker.PUBLISHES)
    assert len(bus.published) == 4 * len(times)
    estimates = [one.message for one in bus.published[::4]]
    assert estimates[0].actions[0].action == "pointing"
    assert sum(action.probability for action in estimates[10].actions) == pytest.approx(1.0)
    assert sum(estimates[10].progress) == pytest.approx(1.0)
    assert estimates[-1].HasField("target")
    found = estimates[-1].target.location
    assert np.hypot(*(np.array([found.x, found.y]) - table_place((0.5, 0.5))[:2])) < 0.12  # one camera: depth is weak
    pose = bus.published[1].message
    assert [point.name for point in pose.points] == ["shoulder", "elbow", "index"]
    outline = bus.published[2].message.points[0].points
    assert len(outline) > 20
    ball = bus.published[3].message.entities[0].spheres[0]
    assert ball.color.r > 0.5  # nothing is known yet
    assert [state for state, _ in bus.states] == ["ready"]


def test_what_is_wrong_with_the_images_is_told_once_and_when_it_is_over(config):
    times, poses = pointing()
    images = list(drawn(poses[:12], camera(1)))
    small = np.zeros((12, 16, 3), np.uint8)
    bus = RecordedBus(heard([*images[:4], small, small, *images[6:]], times[:12]))
    action_tracker.run(bus, config)
    assert [state for state, _ in bus.states] == ["ready", "degraded", "ready"]
    assert "camera_1 gives 16 x 12 px" in bus.states[1][1]


def test_places_are_told_in_the_frame_that_is_asked_for(config):
    times, poses = pointing((0.5, 0.5))
    images = list(drawn(poses[:6], camera(1)))
    said = {}
    for name, place in (("table", {}), ("right_shoulder", {"x": 0.2, "y": -0.1, "z": -0.3, "yaw": np.pi / 2})):
        placed = config.model_copy(update={"table_place": TablePose(frame=name, **place)})
        bus = RecordedBus(heard(images, times[:6]))
        action_tracker.run(bus, placed)
        said[name] = [one.message for one in bus.published if one.topic is topics.ACTION_ESTIMATE]
        assert bus.published[3].message.entities[0].frame_id == name
    for table, shoulder in zip(said["table"], said["right_shoulder"], strict=True):
        assert (table.frame, shoulder.frame) == ("table", "right_shoulder")
        for there, here in ((table.hand, shoulder.hand), (table.pointed, shoulder.pointed)):
            assert here.x == pytest.approx(0.2 - there.y)
            assert here.y == pytest.approx(-0.1 + there.x)
            assert here.z == pytest.approx(-0.3 + there.z)
            assert here.x_deviation == pytest.approx(there.y_deviation)


def test_what_is_worse_than_asked_for_is_lost_and_points_at_nothing(config):
    """However used the track is to it: nothing is ever better here than what is asked for."""
    times, poses = pointing((0.5, 0.5))
    strict = config.model_copy(update={"min_log_likelihood": 1e6})
    bus = RecordedBus(heard(drawn(poses, camera(1)), times))
    action_tracker.run(bus, strict)
    estimates = [one.message for one in bus.published if one.topic is topics.ACTION_ESTIMATE]
    assert all(estimate.lost for estimate in estimates[20:])
    assert not any(estimate.HasField("target") for estimate in estimates)
    assert [state for state, _ in bus.states] == ["ready", "degraded"]


def test_a_camera_that_is_not_calibrated_is_passed_over(config):
    times, poses = pointing()
    bus = RecordedBus(heard(drawn(poses[:3], camera(1)), times[:3], topics.CAMERA_IMAGES[2]))
    action_tracker.run(bus, config)
    assert bus.published == []
