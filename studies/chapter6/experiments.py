"""All tracks of the report on chapter 6 as pieces of work: a clip, a set of views, a likelihood, a seed."""

from __future__ import annotations

import hashlib
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from importlib.metadata import version
from pathlib import Path
from typing import Any, Literal

import cv2

from paramove.documents import InputError
from paramove.observation import Likelihood
from paramove.source_code import code_digest
from sim.persons.clips import (
    CAMERAS,
    SEEN,
    TRUE_CAMERAS,
    TRUTH,
    clips_folder,
    read_clip,
)
from sim.persons.performances import KINDS, Kind, split_of
from studies.chapter6.tracking import tracked_clip
from studies.chapter6.vocabularies import BY_OTHERS, knowledge_of

SplitOrAll = Literal["tuning", "held_out", "all"]
Views = tuple[int, ...]

ALL_VIEWS: Views = (0, 1, 2, 3)
SINGLE_VIEWS: tuple[Views, ...] = ((0,), (1,), (2,), (3,))
TWO_VIEWS: Views = (1, 3)
TRACKED_KINDS = (*(kind.name for kind in KINDS), BY_OTHERS)
"""Kinds of tracks: of clips, and clips of recorded persons with the model of the others."""
SIMPLE_KINDS = ("pointing_50fps", "pointing", "pointing_far")
"""Kinds that are also tracked with the simple likelihood (6.21)."""

LIBRARIES = ("numpy", "scipy", "numba")


class ClipsMissingError(InputError):
    """Clips are missing or rendered by other code.

    Attributes:
        command: renders them.
    """

    def __init__(self, message: str, command: str) -> None:
        super().__init__(f"{message}; render them with: {command}", missing=True)
        self.command = command


@dataclass(frozen=True)
class Selection:
    """What is tracked.

    Attributes:
        split: of the clips. kinds: names of kinds. first: only the first clips of each kind, so many.
        quick: fewer sets of views and no simple likelihood.
    """

    split: SplitOrAll = "all"
    kinds: tuple[str, ...] = tuple(kind.name for kind in KINDS)
    first: int | None = None
    quick: bool = False

    def clips(self) -> list[tuple[Kind, int]]:
        """The chosen clips, as kind and number. Raises InputError for an unknown kind and where there is none."""
        known = [kind.name for kind in KINDS]
        unknown = [name for name in self.kinds if name not in known]
        if unknown:
            raise InputError(f"kinds of clips are {', '.join(known)}; found {', '.join(unknown)}")
        chosen = [
            (kind, number)
            for kind in KINDS
            if kind.name in self.kinds
            for number in range(kind.clips if self.first is None else min(self.first, kind.clips))
            if self.split in ("all", split_of(number))
        ]
        if not chosen:
            raise InputError(f"none of the first {self.first} clips of a kind is {self.split}; every third is held out")
        return chosen


@dataclass(frozen=True)
class Piece:
    """One track.

    Attributes:
        folder: of the clip. kind, number: which clip it is; kind is one of `TRACKED_KINDS`.
        views: numbers of cameras. likelihood, seed: of the observation and of the filter.
        data: folder of recorded people; None is the usual one.
    """

    folder: Path
    kind: str
    number: int
    views: Views
    likelihood: Likelihood = "matched"
    seed: int = 0
    data: Path | None = field(default=None, repr=False)

    @property
    def label(self) -> str:
        """Shown by the progress bar."""
        cameras = ", ".join(str(view + 1) for view in self.views)
        whose = ", model of others" if self.kind == BY_OTHERS else ""
        return f"{self.folder.name}, camera {cameras}, {self.likelihood}{whose}"

    def key(self) -> str:
        """Name of the file of its result: another one for other images, arguments, code or libraries."""
        parts = [repr((self.kind, self.number, self.views, self.likelihood, self.seed)), _clip_digest(self.folder)]
        parts.append(code_digest(tracked_clip.__module__))
        parts += [f"cv2 {cv2.__version__}", *(f"{name} {version(name)}" for name in LIBRARIES)]
        return hashlib.sha256("\n".join(parts).encode()).hexdigest()[:32]

    def run(self) -> dict[str, Any]:
        """The result as plain JSON."""
        result = tracked_clip(self.folder, self.views, self.likelihood, self.seed, self.data, self.kind)
        return {
            "clip": self.folder.name,
            "kind": self.kind,
            "number": self.number,
            "split": split_of(self.number),
            "views": list(self.views),
            "likelihood": self.likelihood,
            "seed": self.seed,
            **result,
        }


def pieces(selection: Selection, root: Path | None = None, data: Path | None = None) -> list[Piece]:
    """All tracks of the selected clips in the folder `root`. Raises ClipsMissingError where clips are missing."""
    clips = root if root is not None else clips_folder()
    chosen = selection.clips()
    _check_complete(clips, chosen, root)
    return [
        Piece(clips / f"{kind.name}_{number:02d}", known, number, views, likelihood, data=data)
        for kind, number in chosen
        for views, likelihood in tracked_cases(kind, number, quick=selection.quick)
        for known in ((kind.name, BY_OTHERS) if kind.name == "recorded" and views != TWO_VIEWS else (kind.name,))
    ]


def tracked_cases(kind: Kind, number: int, *, quick: bool = False) -> Iterator[tuple[Views, Likelihood]]:
    """With which views and which likelihood a clip is tracked."""
    singles = ((number % 4,),) if kind.one_view else SINGLE_VIEWS
    sets = singles if kind.one_view else (ALL_VIEWS, *singles, TWO_VIEWS)
    if quick:
        yield from ((views, "matched") for views in sets[:2])
        return
    yield from ((views, "matched") for views in sets)
    if kind.name in SIMPLE_KINDS:
        yield from ((views, "simple") for views in sets if views != TWO_VIEWS)


def train(selection: Selection, data: Path | None = None) -> None:
    """Trains all models that the selected clips need and that are not cached yet, so that no two workers train one."""
    for kind, number in selection.clips():
        knowledge_of(kind.name, number, data)
        if kind.name == "recorded":
            knowledge_of(BY_OTHERS, number, data)


def _check_complete(clips: Path, chosen: Sequence[tuple[Kind, int]], named: Path | None) -> None:
    absent = [(kind, number) for kind, number in chosen if not _is_there(clips / f"{kind.name}_{number:02d}")]
    if not absent:
        return
    kinds = dict.fromkeys(kind.name for kind, _ in absent)
    maximum = max(number for _, number in absent) + 1
    command = ["python -m sim.performances", *(f"--kind {name}" for name in kinds)]
    if any(number + 1 < kind.clips for kind, number in chosen if number == maximum - 1):
        command.append(f"--clips {maximum}")
    if named is not None:
        command.append(f"--out {named}")
    raise ClipsMissingError(
        f"{clips}: {len(absent)} of {len(chosen)} clips are missing or rendered by other code",
        " ".join(command),
    )


def _is_there(folder: Path) -> bool:
    try:
        read_clip(folder)
    except InputError:
        return False
    return True


@lru_cache
def _clip_digest(folder: Path) -> str:
    """Of all files of a clip."""
    digest = hashlib.blake2b()
    for name in (SEEN, CAMERAS, TRUTH, TRUE_CAMERAS):
        digest.update((folder / name).read_bytes())
    return digest.hexdigest()
