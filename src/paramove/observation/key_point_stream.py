"""Key points of cameras one after the other: live, from video files, or from a recording of a run."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path

from paramove.cameras import CalibratedCamera, EndOfFrames, FrameError, open_source
from paramove.documents import Image, InputError
from paramove.observation.body_key_points import BodyKeyPoints, key_points_from
from paramove.observation.pose_detection import PoseDetection
from paramove.recording import read

ENDING = "/key_points"
FILE_STEP_NS = 1_000_000_000 // 15
"""Files are read at this pace of their own time, as fast as the network is."""
PAUSE_S = 0.005
Seen = tuple[str, int, BodyKeyPoints]


def recorded_key_points(path: Path) -> Iterator[Seen]:
    """Camera, capture time, ns, and key points that a recording has. Raises InputError for one that has none."""
    count = 0
    try:
        for one in read(path):
            if one.topic.endswith(ENDING):
                count += 1
                captured_ns = one.message.captured.ToNanoseconds()
                yield one.topic.removesuffix(ENDING), captured_ns, key_points_from(one.message)
    except OSError as error:
        raise InputError(f"{path}: {error.strerror}; a recording of a run expected", missing=True) from error
    except KeyError as error:
        raise InputError(f"{path}: {error}; a recording of a run expected") from error
    if not count:
        raise InputError(
            f"{path} has no key points: record with `paramove launch pointing --with real` and the pose network"
        )


def images_of(
    cameras: Sequence[CalibratedCamera], sources: Sequence[str]
) -> Iterator[tuple[CalibratedCamera, int, Image]]:
    """Camera, capture time, ns, and image as they come, until a file ends.

    Args:
        cameras: As calibrated.
        sources: One per camera: device:PATH, file:PATH or folder:PATH@RATE; all live or all files.

    Raises InputError for a source that cannot be used.
    """
    live = any(source.startswith("device:") for source in sources)
    opened = [
        (camera, open_source(source, camera.width_px, camera.height_px))
        for camera, source in zip(cameras, sources, strict=True)
    ]
    now_ns = 0
    try:
        while True:
            now_ns = time.monotonic_ns() if live else now_ns + FILE_STEP_NS
            frames = [(camera, source.frame(now_ns)) for camera, source in opened]  # at one time, not one by one
            for camera, frame in frames:
                if frame is None:
                    continue
                camera.check_size(frame.image_bgr)
                yield camera, frame.captured_ns, frame.image_bgr
            if live:
                time.sleep(PAUSE_S)
    except EndOfFrames:
        return
    except FrameError as error:
        raise InputError(str(error)) from error
    finally:
        for _, source in opened:
            source.close()


def detected_key_points(
    images: Iterator[tuple[CalibratedCamera, int, Image]], report: Callable[[str], None], *, offline: bool = False
) -> Iterator[Seen]:
    """Camera, capture time, ns, and key points of images.

    Args:
        images: See `images_of`.
        report: Gets what is wrong with the pictures, when it changes.
        offline: See `stored_network`.

    Raises InputError without the pose network.
    """
    detection, reported = PoseDetection(offline=offline), ""
    if detection.missing is not None:
        raise detection.missing
    for camera, captured_ns, image in images:
        points = detection.detect(camera.name, image)
        if points is not None:
            yield camera.name, captured_ns, points
        if detection.trouble != reported:
            reported = detection.trouble
            report(reported)
