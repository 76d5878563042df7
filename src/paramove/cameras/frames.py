"""Frames of a camera: their format, their checks, and their encoding in messages.

Frames of every source (see `frame_sources`) are processed alike: `Frame` -> `FrameChecks` -> `encode`.
"""

from __future__ import annotations

import zlib
from dataclasses import dataclass

import cv2
import numpy as np
from foxglove_schemas_protobuf.CompressedImage_pb2 import CompressedImage
from foxglove_schemas_protobuf.RawImage_pb2 import RawImage

from paramove.documents import JPEG, Image, InputError, decoded

CAMERA_FRAME = "camera_optical"
DARK_LEVEL = 16.0
"""Mean of 255 below which noise hides the colours. A lens cap gives 0 to 5, the demo's darkest scene 50."""
SATURATED_FRACTION = 0.95
_TO_BGR = {"bgr8": None, "8UC3": None, "rgb8": cv2.COLOR_RGB2BGR}


class FrameError(RuntimeError):
    """A missing or unusable frame; the message gives what was expected, what was found and the remedy.

    Attributes:
        kind: The kind of fault, the same for all frames with this fault.
    """

    def __init__(self, message: str, kind: str = "unusable") -> None:
        super().__init__(message)
        self.kind = kind


class SourceError(FrameError, InputError):
    """A source that cannot be opened; the message gives what was found and the remedy."""

    def __init__(self, message: str, missing: bool = False) -> None:
        InputError.__init__(self, message, missing)
        self.kind = "missing" if missing else "source"


class EndOfFrames(FrameError):  # noqa: N818 - an end is no error of the file
    """A recording has been played to its end."""


@dataclass(frozen=True)
class Frame:
    """One picture: image [H, W, 3] uint8 BGR, capture time in ns of the run's clock, count since the source opened."""

    image_bgr: Image
    captured_ns: int
    index: int


class FrameChecks:
    """Rejects frames of the wrong size, black or saturated frames, and an image that no longer changes.

    Args:
        width_px, height_px: Expected size.
        frozen_after: This many equal frames in a row mean a frozen camera: sensor noise makes real ones differ. 5 are
            a third of a second, before a moving object would seem to rest. 0 allows equal frames, for drawn videos.
    """

    def __init__(self, width_px: int, height_px: int, frozen_after: int = 5) -> None:
        self._size = (width_px, height_px)
        self._frozen_after = frozen_after
        self._last_hash = -1
        self._equal_frames = 0

    def passed(self, frame: Frame) -> Frame:
        """The same frame. Raises FrameError if it must not be used."""
        image = frame.image_bgr
        if image.ndim != 3 or image.shape[2] != 3 or image.dtype != np.uint8:
            raise FrameError(f"array of shape {image.shape} and type {image.dtype} found, [H, W, 3] uint8 expected")
        height, width = image.shape[:2]
        if (width, height) != self._size:
            raise FrameError(
                f"frame {frame.index} has {width} x {height} px, {self._size[0]} x {self._size[1]} expected; "
                "set the camera's resolution or the node's width and height",
                "size",
            )
        self._check_frozen(frame)
        self._check_exposure(frame)
        return frame

    def _check_frozen(self, frame: Frame) -> None:
        value = zlib.crc32(frame.image_bgr.tobytes())
        self._equal_frames = self._equal_frames + 1 if value == self._last_hash else 1
        self._last_hash = value
        if self._frozen_after and self._equal_frames >= self._frozen_after:
            raise FrameError(
                f"the last {self._equal_frames} frames are identical: the camera is frozen or unplugged, replug it",
                "frozen",
            )

    def _check_exposure(self, frame: Frame) -> None:
        sparse = frame.image_bgr[::8, ::8]
        if float(sparse.mean()) < DARK_LEVEL:
            raise FrameError(
                f"frame {frame.index} is black or too dark for colours (mean {float(sparse.mean()):.1f} of 255, "
                f"{DARK_LEVEL:g} needed): take off the lens cap, switch on the light or lengthen the exposure",
                "dark",
            )
        saturated = float((sparse.min(axis=2) >= 254).mean())
        if saturated > SATURATED_FRACTION:
            raise FrameError(
                f"frame {frame.index} is saturated ({saturated:.0%} of the pixels are white): shorten the exposure",
                "saturated",
            )


def image_of_raw(message: RawImage) -> Image:
    """BGR pixels of an uncompressed image. Raises FrameError for an unknown encoding or inconsistent sizes."""
    if message.encoding not in _TO_BGR:
        raise FrameError(f"raw image with encoding {message.encoding!r} found, one of {sorted(_TO_BGR)} expected")
    step, size = message.step or 3 * message.width, len(message.data)
    if not message.width or not message.height or step < 3 * message.width or size != step * message.height:
        raise FrameError(
            f"raw image of {message.width} x {message.height} px with rows of {step} bytes holds {size} bytes, "
            f"{max(step, 3 * message.width) * message.height} expected"
        )
    rows: Image = np.frombuffer(message.data, np.uint8).reshape(message.height, step)
    image = rows[:, : 3 * message.width].reshape(message.height, message.width, 3)
    conversion = _TO_BGR[message.encoding]
    return image if conversion is None else cv2.cvtColor(image, conversion)


def encode(frame: Frame, jpeg_quality: int = 95) -> CompressedImage:
    """JPEG with full colour resolution: halved colour, JPEG's default, would smear the borders that are measured."""
    options = [cv2.IMWRITE_JPEG_QUALITY, jpeg_quality]
    options += [cv2.IMWRITE_JPEG_SAMPLING_FACTOR, cv2.IMWRITE_JPEG_SAMPLING_FACTOR_444]
    done, data = cv2.imencode(".jpg", frame.image_bgr, options)
    if not done:
        raise FrameError(f"frame {frame.index} of shape {frame.image_bgr.shape} could not be encoded as JPEG")
    message = CompressedImage(frame_id=CAMERA_FRAME, format="jpeg", data=data.tobytes())
    message.timestamp.FromNanoseconds(frame.captured_ns)
    return message


def decode(message: CompressedImage) -> Image:
    """BGR pixels of a compressed image. Raises FrameError for empty, corrupt or cut data and for huge sizes."""
    try:
        if message.data[:2] == JPEG and b"\xff\xd9" not in message.data[-64:]:
            raise InputError("is cut off")  # OpenCV would fill the missing part with grey
        return decoded(message.data)
    except InputError as error:
        raise FrameError(
            f"compressed image ({message.format!r:.20}, {len(message.data)} bytes) {error}", "corrupt"
        ) from error
