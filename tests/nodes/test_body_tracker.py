"""The body tracker's process: images of marked arms in, arm poses out, and what is wrong told."""

from __future__ import annotations

import numpy as np
import pytest

from nodes import body_tracker
from paramove.bus import topics
from paramove.bus.recorded import RecordedBus
from paramove.bus.subscriber import Received
from paramove.bus.ticks import Tick
from paramove.cameras.calibrated import write_cameras
from paramove.cameras.frames import Frame, encode
from paramove.documents.input_error import InputError
from tests.nodes.recorded_bus import PERIOD_NS
from tests.observation.test_markers import ARM, EYES, HUES, with_colours, with_markers

BOTH = (0, 1)


@pytest.fixture(scope="module")
def cameras(tmp_path_factory):
    path = tmp_path_factory.mktemp("setup") / "cameras.yaml"
    write_cameras(path, EYES)
    return path


@pytest.fixture(scope="module")
def images():
    return [with_markers(eye, seed=number) for number, eye in enumerate(EYES)]


def moments(pictures, count, seeing=lambda moment: BOTH):
    """Images of both cameras, and the tick of each period."""
    for moment in range(1, count + 1):
        now_ns = moment * PERIOD_NS
        for camera in seeing(moment):
            frame = encode(Frame(pictures[camera], now_ns, moment))
            yield Received(topics.CAMERA_IMAGES[camera], frame, now_ns, now_ns, moment)
        yield Tick(moment, now_ns)


def run(cameras, events, **parameters):
    bus = RecordedBus(events)
    body_tracker.run(bus, body_tracker.Config.model_validate({"cameras": cameras, **parameters}))
    return bus


def poses(bus):
    said = [one.message for one in bus.published if one.topic is topics.HUMAN_ARM_POSE]
    return [{point.name: (point.x, point.y, point.z) for point in one.points} for one in said]


def test_says_pose_outline_and_scene_of_each_moment(cameras, images):
    bus = run(cameras, moments(images, 3))
    assert [one.topic for one in bus.published] == list(body_tracker.PUBLISHES) * 3
    found = poses(bus)[-1]
    assert list(found) == ["elbow", "wrist", "index"]
    for name, place in found.items():
        np.testing.assert_allclose(place, ARM[name], rtol=0, atol=0.004)
    outline = bus.published[1].message
    seen = np.array([(point.x, point.y) for point in outline.points[0].points])
    np.testing.assert_allclose(seen[0], EYES[0].project(ARM["elbow"]), rtol=0, atol=2.0)
    assert len(bus.published[2].message.entities[0].lines[0].points) == 3
    assert bus.states == [("ready", "looking for elbow, wrist, index with camera_1, camera_2")]


def test_colours_instead_of_printed_markers(cameras):
    markers = {name: {"hue_deg": HUES[name][1]} for name in ("elbow", "wrist")}
    bus = run(cameras, moments([with_colours(eye) for eye in EYES], 2), markers=markers)
    assert list(poses(bus)[-1]) == ["elbow", "wrist"]


def test_a_camera_that_is_gone_is_told_and_its_return(cameras, images):
    bus = run(cameras, moments(images, 60, lambda moment: BOTH if moment < 10 or moment > 40 else (0,)))
    assert [state for state, _ in bus.states] == ["ready", "degraded", "ready"]
    assert bus.states[1][1] == "no images from camera_2"
    assert [len(points) for points in poses(bus)][-1] == 3


def test_both_cameras_gone_is_told(cameras, images):
    bus = run(cameras, moments(images, 40, lambda moment: BOTH if moment < 10 else ()))
    assert bus.states[-1] == ("degraded", "no images from any camera (camera_1, camera_2)")


def test_an_image_of_another_size_gives_no_points_and_is_told_until_it_is_over(cameras, images):
    small = [images[0], images[1][::2, ::2]]
    bus = run(cameras, [*moments(images, 3), *moments(small, 3)])
    assert [state for state, _ in bus.states] == ["ready", "degraded"]
    assert "camera_2 gives 320 x 240 px, calibrated are 640 x 480 px" in bus.states[-1][1]


def test_an_image_that_cannot_be_read_is_told(cameras, images):
    events = list(moments(images, 4))
    events[-2].message.data = b"no picture"
    bus = run(cameras, events)
    assert bus.states[-1][0] == "degraded"
    assert bus.states[-1][1].startswith("camera_2: ")


def test_markers_that_nobody_sees_are_named(cameras):
    without = {name: ARM[name] for name in ("elbow", "wrist")}
    bus = run(cameras, moments([with_markers(eye, without) for eye in EYES], 60))
    assert bus.states[-1][0] == "degraded"
    assert "fewer than two cameras see index" in bus.states[-1][1]
    assert list(poses(bus)[-1]) == ["elbow", "wrist"]


def test_black_images_give_no_points(cameras, images):
    bus = run(cameras, moments([np.zeros_like(image) for image in images], 60))
    assert all(points == {} for points in poses(bus))
    assert "fewer than two cameras see elbow, wrist, index" in bus.states[-1][1]


def test_late_images_are_left_out(cameras, images):
    events = list(moments(images, 6))
    late = [event for event in events[:4] if isinstance(event, Received)]
    assert len(poses(run(cameras, [*events, *late]))) == len(poses(run(cameras, events)))


def test_one_camera_and_none_are_refused(tmp_path):
    with pytest.raises(InputError, match="there is no calibration file"):
        run(tmp_path / "none.yaml", [])
    write_cameras(tmp_path / "one.yaml", EYES[:1])
    with pytest.raises(InputError, match="need at least two calibrated cameras"):
        run(tmp_path / "one.yaml", [])


@pytest.mark.parametrize(
    "marker", [{}, {"number": 91, "hue_deg": (0.0, 10.0)}, {"number": 3}, {"hue_deg": (0.0, 999.0)}]
)
def test_wrong_markers_are_refused(cameras, marker):
    with pytest.raises((InputError, ValueError)):
        run(cameras, [], markers={"elbow": marker})
