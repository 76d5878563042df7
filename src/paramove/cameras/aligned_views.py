"""Images of several cameras synchronized by their capture times, so that a set shows one instant."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Generic, TypeVar

Item = TypeVar("Item")

TIMEOUT_PERIODS = 3.0
"""A camera without images for this many of its periods is gone and is not waited for."""


@dataclass(frozen=True)
class Views(Generic[Item]):
    """The images of the cameras at one instant, or what else comes of each camera.

    Attributes:
        captured_ns: Capture time of the set: the latest of its images.
        images: One for each camera in their order; None where that camera has no image of this instant.
    """

    captured_ns: int
    images: tuple[Item | None, ...]


class AlignedViews(Generic[Item]):
    """Collects images into synchronized sets.

    A set is complete when each camera has an image within half a period of the latest. A camera without images
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
        self._waiting: list[tuple[int, Item] | None] = [None] * len(names)
        self._received_ns: list[int | None] = [None] * len(names)
        self._started_ns: int | None = None
        self._set_ns: int | None = None

    def add(self, name: str, captured_ns: int, image: Item) -> Iterator[Views[Item]]:
        """The sets, at most two, that this image completes. A delayed one, no newer than the last set, is left out."""
        if self._set_ns is not None and captured_ns <= self._set_ns - self._period_ns // 2:
            return
        self._started_ns = captured_ns if self._started_ns is None else self._started_ns
        index = self._names.index(name)
        held = self._waiting[index]
        if held is not None and captured_ns > held[0]:  # a second one before the others came: the first set is complete
            yield from self._set_at(held[0])
        self._waiting[index] = (captured_ns, image)
        self._received_ns[index] = captured_ns
        if all(self._is_ready(other, captured_ns) for other in range(len(self._names))):
            yield from self._set_at(captured_ns)

    def _is_ready(self, index: int, now_ns: int) -> bool:
        """Whether this camera need not be waited for: it has a current image, or it is gone."""
        held = self._waiting[index]
        return (held is not None and held[0] >= now_ns - self._period_ns // 2) or self._is_gone(index, now_ns)

    def _is_gone(self, index: int, now_ns: int) -> bool:
        received_ns = self._received_ns[index]
        since_ns = self._started_ns if received_ns is None else received_ns
        return since_ns is not None and now_ns - since_ns > TIMEOUT_PERIODS * self._period_ns

    def _set_at(self, instant_ns: int) -> Iterator[Views[Item]]:
        """The set of images within half a period of an instant; later ones wait, earlier ones are discarded."""
        near, images = self._period_ns // 2, list[Item | None]()
        latest_ns = instant_ns
        for index, held in enumerate(self._waiting):
            if held is None or held[0] > instant_ns + near:
                images.append(None)
                continue
            self._waiting[index] = None
            images.append(held[1] if held[0] >= instant_ns - near else None)
            latest_ns = max(latest_ns, held[0])
        if self._set_ns is None or latest_ns > self._set_ns:
            self._set_ns = latest_ns
            yield Views(latest_ns, tuple(images))
