"""The detector's process: images in, key points out."""

from nodes import pose_detector
from paramove.bus import topics
from paramove.bus.recorded import RecordedBus
from paramove.bus.subscriber import Received
from paramove.cameras.frames import Frame, encode
from paramove.observation import key_points_from
from tests.observation.pictures import network, seated_person


def received(images, camera=1):
    for number, image in enumerate(images, start=1):
        message = encode(Frame(image, number, number))
        yield Received(topics.CAMERA_IMAGES[camera - 1], message, number * 1000, number * 1000, number)


def test_key_points_have_the_time_and_the_camera_of_their_image():
    network()
    bus = RecordedBus(received([seated_person(7), seated_person(8)], camera=2))
    pose_detector.run(bus, pose_detector.Config())
    assert [one.topic.name for one in bus.published] == ["camera_2/key_points"] * 2
    assert [one.captured_ns for one in bus.published] == [1000, 2000]
    assert bus.published[0].message.captured.ToNanoseconds() == 1000
    assert key_points_from(bus.published[1].message).has_person
    assert [state for state, _ in bus.states] == ["ready"]


def test_without_the_network_it_is_degraded_and_goes_on(tmp_path):
    image = seated_person(7)
    bus = RecordedBus(received([image, image]))
    pose_detector.run(bus, pose_detector.Config(networks=tmp_path))
    assert bus.published == []
    assert [state for state, _ in bus.states] == ["degraded"]
    assert "paramove webcam setup" in bus.states[0][1]


def test_an_image_that_cannot_be_decoded_is_left_out():
    network()
    images = list(received([seated_person(7), seated_person(8)]))
    images[0].message.data = b"no picture"
    bus = RecordedBus(iter(images))
    pose_detector.run(bus, pose_detector.Config())
    assert len(bus.published) == 1
