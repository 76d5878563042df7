"""Sources of images for a calibration: a folder, a video file, or a live camera.

Every source gives the views of the board held in front of the camera, for the lens, and those of the board on the
table, for the camera's pose.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Protocol

import numpy as np

from paramove.cameras.calibration import GOOD_VIEWS, CalibrationError
from paramove.cameras.charuco_board import BoardFinder, BoardView
from paramove.cameras.frames import FrameError, SourceError
from paramove.cameras.video_file import VideoFile
from paramove.documents import Image, InputError, read_picture

IMAGE_SUFFIXES = (".png", ".jpg", ".jpeg", ".bmp", ".tif", ".tiff", ".webp")
TABLE_PREFIX = "table"
LOOKS_PER_S = 5.0
"""Rate at which a video or a live camera is searched for a new view."""
STILL_FRACTION = 0.01
"""Fraction of the image's width that a still board may move between two looks; faster ones are blurred."""
NEW_FRACTION = 0.05
"""Fraction of the image's width by which the corners of a new view differ from those of all previous views."""
MAX_VIEWS = 40
"""More views cost time without improving the calibration."""
TABLE_S = 1.0
"""Time for which the board lies still on the table, at the end of a video or in front of a live camera."""
TABLE_LOOKS = 5
TIMEOUT_S = 60.0
"""Maximum time that a live camera is watched without a new view."""


@dataclass(frozen=True)
class Found:
    """Views of a camera. `looked_at`: number of images that were searched for the board."""

    views: tuple[BoardView, ...]
    looked_at: int


class ImageSource(Protocol):
    """Images of one camera."""

    name: str

    def held(self) -> Found:
        """Views of the board in front of the camera, the table's included. Raises InputError."""

    def table(self) -> Found:
        """Views of the board on the table. Raises InputError."""


class FolderImages:
    """Images of a folder; those whose names begin with "table" show the board on the table.

    Raises InputError if there is no folder, or no image in it, or one that cannot be read.
    """

    def __init__(self, folder: Path) -> None:
        self.name = folder.resolve().name
        self._paths = sorted(path for path in folder.iterdir() if path.suffix.lower() in IMAGE_SUFFIXES)
        if not self._paths:
            raise InputError(f"no image in {folder}: {', '.join(IMAGE_SUFFIXES)} expected", missing=True)

    def held(self) -> Found:
        return _found(self._views.values())

    def table(self) -> Found:
        return _found(view for path, view in self._views.items() if path.name.lower().startswith(TABLE_PREFIX))

    @cached_property
    def _views(self) -> dict[Path, BoardView | None]:
        finder = BoardFinder()
        return {path: finder.find(read_picture(path), path.name) for path in self._paths}


class VideoImages:
    """A video in which the board is held at many angles, briefly still each time, and lies on the table at the end.

    Raises InputError if the file is no video.
    """

    def __init__(self, path: Path) -> None:
        self.name = path.stem
        self._path = path

    def held(self) -> Found:
        collector = ViewCollector()
        for _, view in self._looks:
            collector.offer(view)
        return Found(tuple(collector.views), len(self._looks))

    def table(self) -> Found:
        return _found(view for time_s, view in self._looks if time_s > self._looks[-1][0] - TABLE_S)

    @cached_property
    def _looks(self) -> list[tuple[float, BoardView | None]]:
        return list(_looks(self._path.name, _video(self._path)))


class LiveImages:
    """A camera that is watched: a view is taken automatically whenever the board is held still in a new pose.

    Args:
        name: Of the camera.
        frames: Pairs of time, s, and image, without end.
        say: Shows the person what to do next.
    """

    def __init__(self, name: str, frames: Iterator[tuple[float, Image]], say: Callable[[str], None]) -> None:
        self.name = name
        self._frames = frames
        self._say = say

    def held(self) -> Found:
        """Views of the board in front of the camera, the table's included. Raises InputError."""
        collector, looked_at, latest_s = ViewCollector(), 0, None
        self._say(f"{self.name}: hold the board in front of the camera, briefly still, each time at another angle")
        for time_s, view in _looks(self.name, self._frames):
            looked_at += 1
            latest_s = time_s if latest_s is None else latest_s
            if collector.offer(view):
                latest_s = time_s
                self._say(f"{self.name}: view {len(collector.views)} of {GOOD_VIEWS}")
            if len(collector.views) == GOOD_VIEWS:
                break
            if time_s - latest_s > TIMEOUT_S:
                raise CalibrationError(
                    f"{self.name}: no new view of the board for {TIMEOUT_S:g} s, {len(collector.views)} of "
                    f"{GOOD_VIEWS} taken: more light, the board nearer, tilted, and held still for a second"
                )
        return Found(tuple(collector.views), looked_at)

    def table(self) -> Found:
        """Views of the board on the table. Raises InputError."""
        self._say(f"{self.name}: waiting until the board lies still on the table")
        lying: list[BoardView] = []
        start_s = None
        for looked_at, (time_s, view) in enumerate(_looks(self.name, self._frames), 1):
            start_s = time_s if start_s is None else start_s
            still = view is not None and (not lying or _motion(view, lying[0]) < 0.2 * STILL_FRACTION)
            lying = [*lying, view] if still and view is not None else []
            if len(lying) > TABLE_LOOKS:
                return Found(tuple(lying), looked_at)
            if time_s - start_s > TIMEOUT_S:
                break
        raise CalibrationError(f"{self.name}: the board on the table was not detected lying still for {TIMEOUT_S:g} s")


class ViewCollector:
    """Collects the views in which the board is still and that differ from all collected before."""

    def __init__(self) -> None:
        self.views: list[BoardView] = []
        self._before: BoardView | None = None

    def offer(self, view: BoardView | None) -> bool:
        """Offers the next view, None where no board was detected. True if it is collected."""
        before, self._before = self._before, view
        if view is None or before is None or len(self.views) >= MAX_VIEWS:
            return False
        if _motion(view, before) > STILL_FRACTION or any(_motion(view, other) < NEW_FRACTION for other in self.views):
            return False
        self.views.append(view)
        return True


def _looks(name: str, frames: Iterable[tuple[float, Image]]) -> Iterator[tuple[float, BoardView | None]]:
    """Time, s, and view of the board, if it is there, in as many frames as `LOOKS_PER_S`."""
    finder, last_s = BoardFinder(), -np.inf
    for time_s, image in frames:
        if time_s - last_s >= 1.0 / LOOKS_PER_S - 1e-3:
            last_s = time_s
            yield time_s, finder.find(image, f"{name} at {time_s:.1f} s")


def _found(looks: Iterable[BoardView | None]) -> Found:
    looked_at = list(looks)
    return Found(tuple(view for view in looked_at if view is not None), len(looked_at))


def _motion(view: BoardView, other: BoardView) -> float:
    """Largest move of a common corner by the image's width; infinite without common corners or for other boards."""
    both, here, there = np.intersect1d(view.corner_ids, other.corner_ids, return_indices=True)
    if not len(both) or view.first_id != other.first_id or view.size != other.size:
        return float("inf")
    return float(np.linalg.norm(view.points[here] - other.points[there], axis=1).max()) / view.size[0]


def file_source(path: Path) -> FolderImages | VideoImages:
    """The images of a folder or of a video file. Raises InputError if there is neither."""
    if path.is_dir():
        return FolderImages(path)
    if not path.exists():
        raise InputError(
            f"there is nothing at {path}: a folder with images, a video file or a camera's number expected",
            missing=True,
        )
    return VideoImages(path)


def _video(path: Path) -> Iterator[tuple[float, Image]]:
    """Time, s, and image of each frame. Raises SourceError if there is no video, or one with wrong times."""
    video = VideoFile(path)
    try:
        while (frame := video.read()) is not None:
            yield frame.time_s, frame.image_bgr
    except FrameError as error:
        raise SourceError(str(error)) from error
    finally:
        video.close()
