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
        self._period_ns = round(period_s * 1e9)
        self._waiting: dict[str, tuple[int, Item] | None] = dict.fromkeys(names)
        self._received_ns: dict[str, int] = {}
        self._set_ns: int | None = None

    def add(self, name: str, captured_ns: int, image: Item) -> Iterator[Views[Item]]:
        """The sets, at most two, that this image completes. A delayed one, no newer than the last set, is left out."""
        if self._set_ns is not None and captured_ns <= self._set_ns - self._period_ns // 2:
            return
        for other in self._waiting:  # from the first image on
            self._received_ns.setdefault(other, captured_ns)
        held = self._waiting[name]
        if held is not None and captured_ns > held[0]:  # a second one before the others came: the first set is complete
            yield from self._set_at(held[0])
        self._waiting[name] = (captured_ns, image)
        self._received_ns[name] = captured_ns
        if all(self._is_ready(other, captured_ns) for other in self._waiting):
            yield from self._set_at(captured_ns)

    def _is_ready(self, name: str, now_ns: int) -> bool:
        """Whether this camera need not be waited for: it has a current image, or it is gone."""
        held = self._waiting[name]
        if held is not None and held[0] >= now_ns - self._period_ns // 2:
            return True
        return now_ns - self._received_ns[name] > TIMEOUT_PERIODS * self._period_ns

    def _set_at(self, instant_ns: int) -> Iterator[Views[Item]]:
        """The set of images within half a period of an instant; later ones wait, earlier ones are discarded."""
        near, images = self._period_ns // 2, list[Item | None]()
        latest_ns = instant_ns
        for name, held in self._waiting.items():
            if held is None or held[0] > instant_ns + near:
                images.append(None)
                continue
            self._waiting[name] = None
            images.append(held[1] if held[0] >= instant_ns - near else None)
            latest_ns = max(latest_ns, held[0])
        if self._set_ns is None or latest_ns > self._set_ns:
            self._set_ns = latest_ns
            yield Views(latest_ns, tuple(images))
