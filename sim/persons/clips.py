"""Rendered performances in files: the input of a tracker and, in separate files, the ground truth.

A folder of clips has one folder per clip with `seen.npz` (images, times, measured sizes), `cameras.yaml` (calibrated,
with small errors), `truth.npz`, `true_cameras.yaml` and `code.txt` (the digest of the code that rendered it: the clips
of other code are not read); and `manifest.yaml`. Only `Clip.truth` reads what is true.

Images are stored without loss and without the noise of the sensor: each as the PNG of its difference to the one before,
modulo 256. The noise is added when they are read, always the same for the same clip, view and frame.
"""

from __future__ import annotations

import hashlib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, fields
from functools import cached_property
from itertools import pairwise
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray
from platformdirs import user_cache_path
from ruamel.yaml import YAML

from paramove.cameras import CalibratedCamera, read_cameras, write_cameras
from paramove.documents import Floats, Image, InputError, Ints, decoded, read_arrays, replacing
from paramove.observation import ArmSizes
from paramove.source_code import code_digest
from sim.persons.performances import KINDS, Act, Split, split_of

FORMAT_VERSION, NOISE_SEED = 1, 1
TABLE = ((-0.085, -0.66), (0.72, -0.66), (0.72, 0.72), (-0.085, 0.72))
"""Corners (x, y) of the table in all clips, m, as one measures them with a ruler."""
NOISE_IMAGES = 4
MAX_PLACES = 2
SEEN, CAMERAS, TRUTH, TRUE_CAMERAS, CODE, MANIFEST = (
    "seen.npz", "cameras.yaml", "truth.npz", "true_cameras.yaml", "code.txt", "manifest.yaml",
)  # fmt: skip


@dataclass(frozen=True)
class Truth:
    """What is true in each frame of a clip; world frame, m.

    Attributes:
        poses: shoulder, elbow, tip of the index finger, (T, 9).
        wrist: (T, 3).
        labels: primitive action, or "rest", (T,).
        acts: what is performed.
        sizes, shoulder: of the person, without errors of measuring.
        cameras: without errors of calibration.
    """

    poses: Floats
    wrist: Floats
    labels: NDArray[np.str_]
    acts: tuple[Act, ...]
    sizes: ArmSizes
    shoulder: Floats
    cameras: tuple[CalibratedCamera, ...]


@dataclass(frozen=True)
class Clip:
    """One clip as a tracker may see it.

    Attributes:
        folder: of the clip.
        name, kind, number: which one.
        times_s: of the frames, (T,).
        views: numbers of the cameras that have images, from 0.
        cameras: all four as calibrated; errors about 0.3 px and 1 mm.
        sizes, shoulder: of the person as measured; errors up to 3 % and 5 mm per axis.
    """

    folder: Path
    name: str
    kind: str
    number: int
    times_s: Floats
    views: tuple[int, ...]
    cameras: tuple[CalibratedCamera, ...]
    sizes: ArmSizes
    shoulder: Floats
    noise: float

    @property
    def split(self) -> Split:
        """Whether the clip may be used for tuning, or is held out."""
        return split_of(self.number)

    @property
    def rate_hz(self) -> float:
        """Frames per second."""
        return float(1.0 / np.median(np.diff(self.times_s)))

    def images(self, view: int) -> Iterator[Image]:
        """The images of a view, RGB [H, W, 3], one per time. Raises InputError for a view without images."""
        if view not in self.views:
            raise InputError(f"clip {self.name}: view {view} has no images; views with images are {self.views}")
        names = (f"view_{view}", f"offsets_{view}")
        arrays = read_arrays(self.folder / SEEN, "clip", only=names)
        return self._noisy(unpacked(*(arrays[name] for name in names)), view)

    def frames(self, views: Sequence[int] | None = None) -> Iterator[tuple[Image | None, ...]]:
        """For each time the images of all four views; None for a view that has none or is not requested."""
        requested = [view for view in self.views if views is None or view in views]
        streams = {view: self.images(view) for view in requested}
        for _ in self.times_s:
            yield tuple(next(streams[view]) if view in streams else None for view in range(len(self.cameras)))

    def _noisy(self, clean: Iterator[Image], view: int) -> Iterator[Image]:
        draw = np.random.default_rng([NOISE_SEED, view, *self.name.encode()])
        for number, image in enumerate(clean):
            if number == 0:
                noise = draw.normal(0.0, self.noise, (NOISE_IMAGES, image.size)).round().astype(np.int8)
                noise = np.concatenate([noise, noise], axis=1)
            which, start = int(draw.integers(NOISE_IMAGES)), int(draw.integers(image.size))
            values = noise[which, start : start + image.size].reshape(image.shape)
            yield np.asarray(cv2.add(image, values, dtype=cv2.CV_8U), dtype=np.uint8)

    @cached_property
    def truth(self) -> Truth:
        """What is true: for evaluators, never for a tracker."""
        arrays = read_arrays(self.folder / TRUTH, "clip's truth")
        return Truth(
            arrays["poses"],
            arrays["wrist"],
            arrays["labels"],
            tuple(_act(arrays, number) for number in range(len(arrays["act_action"]))),
            _sizes(arrays["sizes"]),
            arrays["shoulder"],
            read_cameras(self.folder / TRUE_CAMERAS),
        )


_ABOUT = ("version", "name", "kind", "number", "times_s", "views", "sizes", "shoulder", "noise")


def clips_folder() -> Path:
    """Default folder of clips: the user's cache."""
    return user_cache_path("paramove") / "chapter6" / "clips"


def clips_code() -> str:
    """Digest of the code that renders clips, which is part of the clone: `sim`."""
    return code_digest("sim.performances")


def read_clip(folder: Path) -> Clip:
    """The clip of a folder. Raises InputError where it is missing, half written or rendered by other code."""
    if not (folder / SEEN).is_file():
        raise InputError(f"{folder}: no clip there; `python -m sim.performances` renders them", missing=True)
    rendered_by = (folder / CODE).read_text(encoding="utf-8") if (folder / CODE).is_file() else "unknown code"
    if rendered_by != clips_code():
        raise InputError(
            f"{folder}: a clip of code {rendered_by} found, {clips_code()} expected; `python -m sim.performances` "
            "renders it again, in the clone"
        )
    arrays = read_arrays(folder / SEEN, "clip", only=_ABOUT)
    return Clip(
        folder,
        str(arrays["name"]),
        str(arrays["kind"]),
        int(arrays["number"]),
        arrays["times_s"],
        tuple(int(view) for view in arrays["views"]),
        read_cameras(folder / CAMERAS),
        _sizes(arrays["sizes"]),
        arrays["shoulder"],
        float(arrays["noise"]),
    )


def read_clips(folder: Path | None = None, kind: str | None = None, split: Split | None = None) -> tuple[Clip, ...]:
    """The clips of a folder, all or those of one kind or one split, in order.

    Raises InputError for an unknown kind and where there is none.
    """
    root = folder if folder is not None else clips_folder()
    names = [one.name for one in KINDS]
    if kind is not None and kind not in names:
        raise InputError(f"kinds of clips are {', '.join(names)}; found {kind!r}")
    clips = [read_clip(path.parent) for path in root.glob(f"*/{SEEN}")]
    chosen = [clip for clip in clips if kind in (None, clip.kind) and split in (None, clip.split)]
    if not chosen:
        raise InputError(
            f"{root}: no clip of kind {kind or 'any'} and split {split or 'any'}; `python -m sim.performances` "
            "renders them", missing=True,
        )  # fmt: skip
    return tuple(sorted(chosen, key=lambda clip: (names.index(clip.kind), clip.number)))


def write_clip(clip: Clip, truth: Truth, images: Mapping[int, Sequence[Image]]) -> None:
    """Writes a clip with its images, by view; `seen.npz` last, so that a clip that has it is whole."""
    clip.folder.mkdir(parents=True, exist_ok=True)
    (clip.folder / SEEN).unlink(missing_ok=True)
    write_cameras(clip.folder / CAMERAS, clip.cameras)
    write_cameras(clip.folder / TRUE_CAMERAS, truth.cameras)
    np.savez_compressed(clip.folder / TRUTH, **_truth_arrays(truth))
    packed: dict[str, Any] = {}
    for view, pictures in images.items():
        packed[f"view_{view}"], packed[f"offsets_{view}"] = pack(pictures)
    (clip.folder / CODE).write_text(clips_code(), encoding="utf-8")
    with replacing(clip.folder / SEEN) as unfinished, unfinished.open("wb") as file:
        np.savez(
            file,
            version=np.array(FORMAT_VERSION),
            name=np.array(clip.name),
            kind=np.array(clip.kind),
            number=np.array(clip.number),
            times_s=clip.times_s,
            views=np.array(clip.views),
            sizes=_numbers(clip.sizes),
            shoulder=clip.shoulder,
            noise=np.array(clip.noise),
            **packed,
        )


def write_manifest(folder: Path) -> Path:
    """Lists all clips of a folder with kind, split, frames and SHA-256 of images and truth. Returns the file."""
    listed = []
    for clip in read_clips(folder):
        digests = {name: hashlib.sha256((clip.folder / name).read_bytes()).hexdigest() for name in (SEEN, TRUTH)}
        listed.append(
            {"name": clip.name, "kind": clip.kind, "split": clip.split, "frames": len(clip.times_s),
             "views": list(clip.views), **digests}
        )  # fmt: skip
    path = folder / MANIFEST
    with path.open("w", encoding="utf-8") as file:
        YAML().dump({"version": FORMAT_VERSION, "clips": listed}, file)
    return path


def pack(images: Sequence[Image]) -> tuple[NDArray[np.uint8], Ints]:
    """PNG files of the differences from image to image, joined, and where each begins and the last ends."""
    before = np.zeros_like(images[0])
    files = []
    for image in images:
        written, file = cv2.imencode(".png", image - before, (cv2.IMWRITE_PNG_COMPRESSION, 3))
        if not written:
            raise ValueError(f"an image of shape {image.shape} and type {image.dtype} cannot be written as PNG")
        files.append(file.ravel())
        before = image
    return np.concatenate(files), np.cumsum([0, *(len(file) for file in files)])


def unpacked(packed: NDArray[np.uint8], offsets: Ints) -> Iterator[Image]:
    """The images again."""
    image: Image | None = None
    for begin, end in pairwise(offsets):
        step = decoded(packed[begin:end].tobytes())
        image = step if image is None else image + step
        yield image


def _numbers(sizes: ArmSizes) -> Floats:
    return np.array([getattr(sizes, field.name) for field in fields(ArmSizes)])


def _sizes(numbers: Floats) -> ArmSizes:
    return ArmSizes(*(float(number) for number in numbers))


def _truth_arrays(truth: Truth) -> dict[str, Any]:
    places = np.full((len(truth.acts), MAX_PLACES, 7), np.nan)
    for number, act in enumerate(truth.acts):
        columns = (act.theta, act.targets, act.arrives_s[:, None], act.leaves_s[:, None])
        places[number, : len(act.theta)] = np.concatenate(columns, axis=1)
    return {
        "poses": truth.poses,
        "wrist": truth.wrist,
        "labels": truth.labels,
        "sizes": _numbers(truth.sizes),
        "shoulder": truth.shoulder,
        "act_action": np.array([act.action for act in truth.acts]),
        "act_times_s": np.array([(act.start_s, act.end_s, act.grasp_s) for act in truth.acts]),
        "act_places": places,
    }


def _act(arrays: Mapping[str, Any], number: int) -> Act:
    start, end, grasp = (float(time) for time in arrays["act_times_s"][number])
    places = arrays["act_places"][number]
    places = places[np.isfinite(places[:, 0])]
    action = str(arrays["act_action"][number])
    return Act(action, start, end, places[:, :2], places[:, 2:5], places[:, 5], places[:, 6], grasp)
