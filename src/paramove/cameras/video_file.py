"""Frames of a video file at the times that the file gives them.

Phones, browsers and screen recorders write videos of variable rate: they slow down in the dark, leave out what does not
change, or name no rate at all. A frame's number divided by the nominal rate is then seconds away from its time.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np

from paramove.cameras.frames import FrameError, SourceError
from paramove.documents import Image, opened_video

MAX_GAP_S = 60.0
"""A frame that comes longer after the one before it has a wrong time: nobody waits for it."""
CUT_OFF_S = 1.0
"""A file that ends so much earlier than its header claims may be cut off; the claim may include longer sound."""


@dataclass(frozen=True)
class VideoFrame:
    """One picture of a video.

    Attributes:
        image_bgr: [H, W, 3], turned upright as the file demands.
        time_s: Since the first frame.
        gap_s: Time since the frame before it, 0 of the first one.
        index: Its number, from 0.
    """

    image_bgr: Image
    time_s: float
    gap_s: float
    index: int


class VideoFile:
    """Reads the frames of a video file one after the other.

    OpenCV's `CAP_PROP_POS_MSEC` after `grab` is the frame's presentation time, counted from the stream's start.

    Raises SourceError if the file does not exist or is no video.

    Attributes:
        path: The file.
        count: How many frames were read, usable or not.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self.count = 0
        self._capture = opened_video(path, SourceError)
        self._rate_hz = float(self._capture.get(cv2.CAP_PROP_FPS))
        self._claimed = float(self._capture.get(cv2.CAP_PROP_FRAME_COUNT))
        self._first_stamp_s = 0.0
        self._time_s = 0.0
        self._gap_s = 0.0

    def read(self) -> VideoFrame | None:
        """The next frame, None after the last one.

        Raises FrameError for a frame that cannot be decoded, and for one whose time stands still, goes back or is far
        away. It is left out; the next call reads on.
        """
        if not self._capture.grab():
            return None
        index = self.count
        self.count += 1
        self._advance(index)
        done, image = self._capture.retrieve()
        if not done:
            raise FrameError(f"frame {index} of {self.path} cannot be decoded", "corrupt")
        return VideoFrame(np.asarray(image, dtype=np.uint8), self._time_s, self._gap_s, index)

    def ending(self) -> str:
        """What was read of the file, and whether it may be cut off."""
        message = f"{self.path} has ended after {self.count} frames, {self._time_s:.2f} s"
        missing_s = self._missing_s()
        if missing_s <= CUT_OFF_S:
            return message
        return f"{message}; its header claims {missing_s:.2f} s more: it may be cut off"

    def close(self) -> None:
        """Close the file."""
        self._capture.release()

    def _advance(self, index: int) -> None:
        """Sets the time of the frame that was just grabbed. Raises FrameError if that cannot be its time."""
        stamp_s = float(self._capture.get(cv2.CAP_PROP_POS_MSEC)) * 1e-3
        if index == 0:
            self._first_stamp_s = stamp_s
            return
        time_s = stamp_s - self._first_stamp_s
        is_without_stamp = stamp_s == 0.0 and self._time_s > 0.0
        if is_without_stamp:  # as the last ones of an AVI with B frames, which the decoder held back
            time_s = self._time_s + self._gap_s
        gap_s = time_s - self._time_s
        if not 0.0 < gap_s <= MAX_GAP_S:
            raise FrameError(
                f"frame {index} of {self.path} has the time {time_s:.3f} s, the one before {self._time_s:.3f} s: it is "
                "left out; if there are many, write the file anew at its rate, such as 30 Hz: ffmpeg -i IN -vf "
                "setpts=N/30/TB -r 30 OUT.mp4",
                "time",
            )
        self._time_s = time_s
        self._gap_s = gap_s

    def _missing_s(self) -> float:
        """Time by which the file ends earlier than its header claims; 0 if it claims nothing."""
        if not (self._rate_hz > 0.0 and self._claimed > 0.0):
            return 0.0
        last = float(self._capture.get(cv2.CAP_PROP_PTS))  # in periods of the nominal rate, as the claimed number
        return (self._claimed - 1.0 - last) / self._rate_hz
