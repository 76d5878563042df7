import cv2
import numpy as np
from foxglove_schemas_protobuf.CompressedImage_pb2 import CompressedImage

from nodes import colour_tracker
from paramove.bus import topics
from paramove.cameras.frames import Frame, encode
from tests.nodes.recorded_bus import bus_that_heard


def _drawn() -> CompressedImage:
    image = np.full((360, 480, 3), 60, np.uint8)
    cv2.rectangle(image, (100, 100), (113, 129), (20, 180, 210), -1)
    return encode(Frame(image, 0, 0))


def test_says_what_each_image_shows() -> None:
    bus = bus_that_heard([(topics.CAMERA_IMAGE, _drawn())] * 3)
    colour_tracker.run(bus, colour_tracker.Config())
    assert [said.topic for said in bus.published] == [topics.OBJECTS_TRACKED] * 3
    tracked = bus.published[1].message
    assert tracked.captured.ToNanoseconds() == bus.published[1].captured_ns
    assert [(o.name, round(o.u_px), round(o.v_px)) for o in tracked.objects] == [("yellow", 106, 114)]


def test_a_corrupt_image_is_left_out_and_told() -> None:
    broken = CompressedImage(format="jpeg", data=b"\xff\xd8 not a picture")
    bus = bus_that_heard([(topics.CAMERA_IMAGE, image) for image in (_drawn(), broken, _drawn())])
    colour_tracker.run(bus, colour_tracker.Config())
    assert len(bus.published) == 2
    assert [state for state, _ in bus.states] == ["ready", "degraded", "ready"]
    assert "('jpeg', 16 bytes)" in bus.states[1][1]


def test_colours_come_from_the_parameters() -> None:
    config = colour_tracker.Config.model_validate({"colours": [{"name": "amber", "hue_deg": [40, 80]}]})
    bus = bus_that_heard([(topics.CAMERA_IMAGE, _drawn())])
    colour_tracker.run(bus, config)
    assert [found.name for found in bus.published[0].message.objects] == ["amber"]
