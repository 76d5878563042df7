"""Synthesised movements written to files that the importers and the readers of recordings can read."""

from __future__ import annotations

import io
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from paramove.demonstrations import BILLION, PoseRecording, write_poses
from paramove.documents import Floats, replacing
from paramove.phmm import ParametricHMM
from paramove.training.drawing import description_of, point_names

ENDINGS = (".csv", ".npz", ".mcap")
LIBRARY = "paramove synthesize"


@dataclass(frozen=True)
class Made:
    """A synthesised movement.

    Attributes:
        time: shape (T,), s.
        frames: stacked positions, shape (T, D), m.
        point_names: of the D / 3 points.
        frame: coordinate frame.
        theta: of the synthesis, shape (P,).
    """

    time: Floats
    frames: Floats
    point_names: tuple[str, ...]
    frame: str
    theta: Floats

    @classmethod
    def by(cls, model: ParametricHMM, theta: Floats, time: Floats) -> Made:
        """The synthesis of a model for theta (P,) at the times (T,), s. Raises InputError if it has no body points."""
        return cls(time, model.synthesize(theta, len(time)), point_names(model), description_of(model).frame, theta)


def as_csv(made: Made) -> str:
    """Lines of `time` and `<point>_x`, `<point>_y`, `<point>_z`, m, after a header."""
    text = io.StringIO()
    text.write(",".join(["time", *(f"{name}_{axis}" for name in made.point_names for axis in "xyz")]) + "\n")
    for time_s, row in zip(made.time.tolist(), made.frames.tolist(), strict=True):
        text.write(",".join([f"{time_s:.6f}", *(f"{value:.6f}" for value in row)]) + "\n")
    return text.getvalue()


def write_movement(made: Made, path: Path) -> None:
    """Write CSV or NPZ as `paramove demos import` reads it, or a recording.

    Raises RecordingExistsError for a recording that exists already.
    """
    if path.suffix == ".csv":
        with replacing(path) as unfinished:
            unfinished.write_text(as_csv(made), encoding="utf-8")
        return
    positions = made.frames.reshape(len(made.frames), -1, 3)
    if path.suffix == ".npz":
        with replacing(path) as unfinished, unfinished.open("wb") as file:
            np.savez_compressed(
                file, time=made.time, positions=positions, points=np.array(made.point_names), unit="m", axes="z_up",
                frame=made.frame, theta=made.theta,
            )  # fmt: skip
        return
    time_ns = np.rint(made.time * BILLION).astype(np.int64)
    write_poses(path, PoseRecording(time_ns, positions, made.point_names, made.frame), LIBRARY)
