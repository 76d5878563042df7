"""A drawn arm is followed through the images of one and two cameras, and what is wrong with them is told."""

from __future__ import annotations

import numpy as np
import pytest

from paramove.action_space.setup import TrackingSetup
from paramove.action_space.video_tracker import AwaitedKeyPoints, VideoTracker
from paramove.cameras import AlignedViews, Views
from paramove.demonstrations import table_place
from paramove.documents.input_error import InputError
from paramove.observation import BodyKeyPoints
from tests.action_space.drawn_arm import RATE_HZ, camera, drawn, pointing, write_setup

MS = 1_000_000
IMAGE = np.zeros((2, 2, 3), np.uint8)
POINTS = BodyKeyPoints.nobody()


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("setup")


@pytest.fixture(scope="module")
def parameters(folder):
    return write_setup(folder, 2)


def tracker(parameters) -> VideoTracker:
    return TrackingSetup.model_validate({**parameters, "rate_hz": RATE_HZ}).video_tracker()


def tracked(video, times, streams):
    states = []
    for time_s, *images in zip(times, *streams, strict=True):
        for number, image in enumerate(images, start=1):
            states += video.see(f"camera_{number}", round(time_s * 1e9), image)
    return states


def test_pointing_is_followed_to_its_target_by_two_cameras(parameters):
    times, poses = pointing((0.4, 0.6))
    video = tracker(parameters)
    states = tracked(video, times, [drawn(poses, camera(1)), drawn(poses, camera(2))])
    assert len(states) == len(times)
    errors = np.array([state.estimate.pose[-3:] for state in states]) - poses[:, -3:]
    assert np.median(np.linalg.norm(errors, axis=1)) < 0.03
    target = states[-1].estimate.target
    assert target is not None
    assert np.linalg.norm(target.place[:2] - table_place((0.4, 0.6))[:2]) < 0.05
    assert {state.n_views for state in states} == {2}
    assert video.trouble() == ""


def test_the_ball_is_where_the_target_is_seen_and_becomes_certain(parameters):
    times, poses = pointing((0.4, 0.6))
    states = tracked(tracker(parameters), times, [drawn(poses, camera(1)), drawn(poses, camera(2))])
    arrived = int(np.argmin(np.linalg.norm(poses[:, -3:] - table_place((0.4, 0.6)), axis=1)))
    there = states[arrived + 2]
    assert np.linalg.norm(there.ball - camera(1).project(table_place((0.4, 0.6)))) < 8.0
    assert there.pointed_deviation.max() < 0.5 * states[3].pointed_deviation.max()


def test_a_camera_that_falls_silent_is_named_and_the_other_goes_on(parameters):
    times, poses = pointing()
    video, first, second = tracker(parameters), drawn(poses, camera(1)), drawn(poses, camera(2))
    states = []
    for number, time_s in enumerate(times):
        states += video.see("camera_1", round(time_s * 1e9), next(first))
        if number < 5:
            states += video.see("camera_2", round(time_s * 1e9), next(second))
        states += video.tick(round(time_s * 1e9))
    assert states[-1].n_views == 1
    assert video.trouble() == "no images from camera_2"


def test_a_dark_camera_counts_as_none_and_is_told(parameters):
    times, poses = pointing()
    dark = [np.random.default_rng(1).integers(0, 4, (120, 160, 3), dtype=np.uint8) for _ in times[:6]]
    video = tracker(parameters)
    states = tracked(video, times[:6], [list(drawn(poses[:6], camera(1))), dark])
    assert {state.n_views for state in states} == {1}
    assert "camera_2 is dark: take off the lens cap" in video.trouble()
    assert not states[-1].estimate.degraded


def test_all_cameras_dark_is_degraded_and_no_target(parameters):
    times, _ = pointing()
    dark = [[np.zeros((120, 160, 3), np.uint8)] * 6] * 2
    states = tracked(tracker(parameters), times[:6], dark)
    assert states[-1].estimate.degraded
    assert states[-1].estimate.target is None
    assert "no usable view" in states[-1].estimate.detail


def test_an_image_of_another_size_is_left_out_and_told(parameters):
    video = tracker(parameters)
    assert list(video.see("camera_1", 0, np.zeros((12, 16, 3), np.uint8))) == []
    assert video.trouble() == (
        "camera_1 gives 16 x 12 px, calibrated are 160 x 120 px: set its resolution or calibrate it again"
    )


def test_the_same_images_give_the_same_estimates(parameters):
    times, poses = pointing()
    runs = [
        tracked(tracker(parameters), times[:20], [list(drawn(poses[:20], camera(n))) for n in (1, 2)]) for _ in range(2)
    ]
    for one, other in zip(*runs, strict=True):
        np.testing.assert_array_equal(one.estimate.pose, other.estimate.pose)


@pytest.mark.usefixtures("parameters")
def test_files_of_the_run_come_before_those_of_the_workspace(folder, tmp_path):
    setup = TrackingSetup.model_validate({"cameras": "cameras.yaml", "actions": (str(folder / "pointing.npz"),)})
    assert list(setup.video_tracker(folder).cameras) == ["camera_1", "camera_2"]
    with pytest.raises(InputError, match=r"there is no calibration file .*; `paramove calibrate cameras` writes one"):
        setup.video_tracker(tmp_path)


def test_an_action_that_is_not_there_is_told(parameters):
    with pytest.raises(InputError, match="pointing, reaching or the file of a model expected"):
        TrackingSetup.model_validate({**parameters, "actions": ("poking",)}).video_tracker()


class Awaited:
    """One camera or two, with times in ms; what goes on is (time, whether each image has its key points)."""

    def __init__(self, *names):
        self.awaited = AwaitedKeyPoints(names or ("camera_1",))
        self.count = len(names) or 1

    def images(self, at, *missing):
        views = tuple(None if number in missing else (at * MS, IMAGE) for number in range(self.count))
        return self._released(self.awaited.add_set(Views(at * MS, views)))

    def points(self, at, camera="camera_1"):
        return self._released(self.awaited.add_points(camera, at * MS, POINTS))

    def tick(self, at):
        return self._released(self.awaited.released(at * MS))

    def _released(self, found):
        return [(views.captured_ns // MS, *(one is not None for one in points)) for views, points in found]


def test_without_any_nothing_waits():
    awaited = Awaited()
    assert [awaited.images(at) for at in (0, 66, 133)] == [[(0, False)], [(66, False)], [(133, False)]]


def test_an_image_waits_for_its_own():
    awaited = Awaited()
    assert awaited.images(0) == [(0, False)]
    assert awaited.points(0) == []
    assert awaited.images(66) == []
    assert awaited.points(66) == [(66, True)]


def test_key_points_may_come_before_their_image():
    awaited = Awaited()
    assert awaited.points(66) == []
    assert awaited.images(66) == [(66, True)]


def test_an_image_that_the_network_left_out_goes_on_with_the_next():
    awaited = Awaited()
    awaited.points(0)
    assert awaited.images(66) == []
    assert awaited.images(133) == []
    assert awaited.points(133) == [(66, False), (133, True)]


def test_an_image_waits_at_most_150_ms():
    awaited = Awaited()
    awaited.points(0)
    assert awaited.images(66) == []
    assert awaited.tick(200) == []
    assert awaited.tick(220) == [(66, False)]


def test_a_detector_that_is_gone_is_not_waited_for():
    awaited = Awaited()
    awaited.points(0)
    assert awaited.images(1001) == [(1001, False)]


def test_all_cameras_of_a_set_are_waited_for_together():
    awaited = Awaited("camera_1", "camera_2")
    awaited.points(0, "camera_1")
    awaited.points(0, "camera_2")
    assert awaited.images(66) == []
    assert awaited.points(66, "camera_2") == []
    assert awaited.points(66, "camera_1") == [(66, True, True)]
    assert awaited.images(133, 1) == []
    assert awaited.points(133, "camera_1") == [(133, True, False)]


def test_a_detector_that_is_too_slow_is_reported_and_not_waited_for():
    awaited = Awaited()
    for at in range(0, 400, 66):
        awaited.images(at)
    awaited.points(132)
    assert "camera_1, 264 ms" in awaited.awaited.trouble()
    assert awaited.images(462) == [(462, False)]
    awaited.points(396)
    assert awaited.awaited.trouble() == ""
    assert awaited.images(528) == []


@pytest.mark.parametrize(("network_ms", "least"), [(30, 0.95), (60, 0.9)])
def test_two_cameras_and_one_detector_lose_no_set(network_ms, least):
    """The detector takes the latest image of each camera in turn; both cameras give 15 images a second."""
    names = ("camera_1", "camera_2")
    aligned, awaited = AlignedViews(names, 1 / 15), AwaitedKeyPoints(names)
    released, busy_until, waiting = [], 0, {}
    for now in range(20_000):
        if now % 67 == 0:
            for name in names:
                waiting[name] = now
                for views in aligned.add(name, now * MS, (now * MS, IMAGE)):
                    released += awaited.add_set(views)
        if waiting and now >= busy_until:
            name = min(waiting, key=waiting.get)
            busy_until, done = now + network_ms // 2, (name, waiting.pop(name))
            released += awaited.add_points(done[0], done[1] * MS, POINTS)
        released += awaited.released(now * MS)
    assert all(timed is not None for views, _ in released for timed in views.images), "a camera was left out"
    assert len(released) >= 298
    assert np.mean([all(one is not None for one in points) for _, points in released]) > least
