"""Lights through camera, action tracker and recognizer, as their processes run; what they say and how they fare."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from foxglove_schemas_protobuf.RawImage_pb2 import RawImage

from nodes import action_tracker, camera, recognizer
from paramove.bus import topics
from paramove.bus.recorded import RecordedBus, with_ticks
from paramove.bus.subscriber import Received

Image = np.ndarray


@dataclass(frozen=True)
class Outcome:
    """Attributes: states (state, sentence) of each camera and of the tracker, estimates, gestures."""

    cameras: list[list[tuple[str, str]]]
    tracker: list[tuple[str, str]]
    estimates: list[Any]
    gestures: list[Any]


def image_raw(image: Image, time_ns: int) -> RawImage:
    height, width = image.shape[:2]
    message = RawImage(encoding="bgr8", width=width, height=height, step=3 * width, data=image.tobytes())
    message.timestamp.FromNanoseconds(time_ns)
    return message


def heard(said: Sequence[Received], topic: topics.Topic) -> Iterator[Received]:
    """What was said, as the next process hears it."""
    for number, one in enumerate(said, start=1):
        yield Received(topic, one.message, one.captured_ns, one.captured_ns, number)


def through_the_chain(
    config: action_tracker.Config, streams: Sequence[Sequence[Image | None]], times_s: Sequence[float]
) -> Outcome:
    """One stream of BGR images for each camera, None where there is none."""
    states, images = [], []
    height, width = next(image for image in streams[0] if image is not None).shape[:2]
    for stream, topic in zip(streams, topics.CAMERA_IMAGES, strict=False):
        images_raw = []
        for image, time_s in zip(stream, times_s, strict=True):
            time_ns = round(time_s * 1e9) + 1
            if image is not None:
                images_raw.append(
                    Received(topics.CAMERA_IMAGE_RAW, image_raw(image, time_ns), time_ns, time_ns, len(images_raw) + 1)
                )
        bus = RecordedBus(images_raw)
        camera.run(bus, camera.Config(width=width, height=height))
        states.append(bus.states)
        images += heard(bus.published, topic)
    images.sort(key=lambda one: one.captured_ns)
    end_ns = round(times_s[-1] * 1e9) + 1
    nobody = Received(
        topics.CAMERA_IMAGE_RAW, RawImage(), end_ns, end_ns, 1
    )  # time goes on when no camera gives images
    tracking = RecordedBus(with_ticks([*images, nobody]))
    action_tracker.run(tracking, config)
    estimates = [one for one in tracking.published if one.topic is topics.ACTION_ESTIMATE]
    recognizing = RecordedBus(heard(estimates, topics.ACTION_ESTIMATE))
    recognizer.run(recognizing, recognizer.Config())
    return Outcome(
        states, tracking.states, [one.message for one in estimates], [one.message for one in recognizing.published]
    )
