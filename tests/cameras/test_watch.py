"""What cameras give is told: silence, wrong sizes, pictures that cannot be read."""

import numpy as np

from paramove.cameras.watch import CameraWatch
from tests.action_space.drawn_arm import HEIGHT, WIDTH, camera

GOOD = np.zeros((HEIGHT, WIDTH, 3), np.uint8)
S = 1_000_000_000


def test_nothing_is_wrong_with_images_in_time():
    watch = CameraWatch([camera(1), camera(2)], 0.1)
    for moment in range(5):
        assert watch.accepts("camera_1", moment * S, GOOD)
        assert watch.accepts("camera_2", moment * S, GOOD)
        watch.tick(moment * S)
        assert watch.troubles() == []


def test_silence_is_told_of_one_and_of_all_and_is_over_with_the_next_image():
    watch = CameraWatch([camera(1), camera(2)], 0.1)
    watch.tick(0)
    watch.accepts("camera_1", 2 * S, GOOD)
    watch.tick(2 * S)
    assert watch.troubles() == ["no images from camera_2"]
    watch.tick(5 * S)
    assert watch.troubles() == ["no images from any camera (camera_1, camera_2)"]
    watch.accepts("camera_1", 5 * S, GOOD)
    watch.accepts("camera_2", 5 * S, GOOD)
    assert watch.troubles() == []


def test_a_wrong_size_is_told_until_a_right_one_comes():
    watch = CameraWatch([camera(1)], 0.1)
    assert not watch.accepts("camera_1", 0, GOOD[::2])
    assert watch.troubles() == [
        "camera_1 gives 160 x 60 px, calibrated are 160 x 120 px: set its resolution or calibrate it again"
    ]
    watch.reject("camera_1", 1, "no picture")
    assert watch.troubles() == ["camera_1: no picture"]
    assert watch.accepts("camera_1", 2, GOOD)
    assert watch.troubles() == []


def test_a_slow_camera_is_reported_with_its_rate_until_it_is_fast_again():
    watch, image = CameraWatch([camera(1)], 1.0 / 15.0), np.zeros((120, 160, 3), np.uint8)
    at_ns = 0
    for count, period_ns, slow in ((15, 200, False), (1, 200, True), (8, 66, False)):
        for _ in range(count):
            at_ns += period_ns * 1_000_000
            watch.accepts("camera_1", at_ns, image)
        watch.tick(at_ns)
        assert ("camera_1 gives 5 images per second" in "".join(watch.troubles())) == slow
