"""Images of several cameras brought together by their capture times, so that a set shows one moment."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from paramove.documents import Image

TIMEOUT_PERIODS = 3.0
"""A camera that is silent for so many of its periods is gone: nobody waits for it any longer."""


@dataclass(frozen=True)
class Views:
    """What the cameras showed at one moment.

    Attributes:
        captured_ns: Capture time of the set: the latest of its images.
        images: One [H, W, 3] for each camera in their order; None where that camera told nothing of this moment.
        silent: Names of the cameras that are gone.
    """

    captured_ns: int
    images: tuple[Image | None, ...]
    silent: tuple[str, ...]


class AlignedViews:
    """Collects images and gives sets of them.

    A set is complete when each camera has an image within half a period of the latest. A camera that has been silent
    for `TIMEOUT_PERIODS` is not waited for; from its next image on it is part of the sets again.

    Args:
        names: Of the cameras.
        period_s: Time between two images of a camera, s.
    """

    def __init__(self, names: Sequence[str], period_s: float) -> None:
        if not names or len(set(names)) != len(names):
            raise ValueError(f"cameras: at least one, each with a name of its own expected, found {list(names)}")
        if not period_s > 0.0:
            raise ValueError(f"time between images: more than 0 s expected, found {period_s}")
        self._names = tuple(names)
        self._period_ns = round(period_s * 1e9)
        self._waiting: list[tuple[int, Image] | None] = [None] * len(names)
        self._heard_ns: list[int | None] = [None] * len(names)
        self._started_ns: int | None = None
        self._said_ns: int | None = None

    def add(self, name: str, captured_ns: int, image: Image) -> Iterator[Views]:
        """The sets, at most two, that this image completes. An image no newer than the last set is left out (late).

        Raises ValueError for an unknown camera.
        """
        if name not in self._names:
            raise ValueError(f"camera {name!r}: one of {', '.join(self._names)} expected")
        if self._said_ns is not None and captured_ns <= self._said_ns - self._period_ns // 2:
            return
        self._started_ns = captured_ns if self._started_ns is None else self._started_ns
        place = self._names.index(name)
        held = self._waiting[place]
        if held is not None and captured_ns > held[0]:  # a second one before the others came: the first moment is over
            yield from self._said(held[0])
        self._waiting[place] = (captured_ns, image)
        self._heard_ns[place] = captured_ns
        if all(self._is_there(other, captured_ns) for other in range(len(self._names))):
            yield from self._said(captured_ns)

    def _is_there(self, place: int, now_ns: int) -> bool:
        """Whether this camera need not be waited for: it has an image of now, or it is gone."""
        held = self._waiting[place]
        return (held is not None and held[0] >= now_ns - self._period_ns // 2) or self._is_gone(place, now_ns)

    def _is_gone(self, place: int, now_ns: int) -> bool:
        heard_ns = self._heard_ns[place]
        since_ns = self._started_ns if heard_ns is None else heard_ns
        return since_ns is not None and now_ns - since_ns > TIMEOUT_PERIODS * self._period_ns

    def _said(self, moment_ns: int) -> Iterator[Views]:
        """The images within half a period of the moment; newer ones wait on, older ones are forgotten."""
        near, images = self._period_ns // 2, list[Image | None]()
        latest_ns = moment_ns
        for place, held in enumerate(self._waiting):
            if held is None or held[0] > moment_ns + near:
                images.append(None)
                continue
            self._waiting[place] = None
            images.append(held[1] if held[0] >= moment_ns - near else None)
            latest_ns = max(latest_ns, held[0])
        if self._said_ns is None or latest_ns > self._said_ns:
            self._said_ns = latest_ns
            gone = (name for place, name in enumerate(self._names) if self._is_gone(place, latest_ns))
            yield Views(latest_ns, tuple(images), tuple(gone))
