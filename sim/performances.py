"""Renders the clips of chapter 6: persons who point, pour and carry, in four cameras.

    python -m sim.performances                     all that are missing, into the user's cache
    python -m sim.performances --kind pouring --contact-sheet sheet.png

Every clip follows from its kind and number alone. Only missing clips are rendered: interrupt it at any time.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import cv2
import mujoco
import numpy as np
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

from paramove.cameras import CalibratedCamera
from paramove.demonstrations import RESTING_STERNUM, SAMPLE_RATE_HZ, RecordingsError
from paramove.diagnosis import Eye
from paramove.documents import Floats, Image, InputError
from sim.body_markers import place_markers
from sim.human import place_arm, place_torso
from sim.performances_scene import MARGIN_PX, Room, as_calibrated, build, draw_cameras, rendered_px
from sim.persons.clips import (
    Clip,
    Truth,
    clips_folder,
    read_clip,
    read_clips,
    write_clip,
    write_manifest,
)
from sim.persons.performances import KINDS, Kind, Performance, kind_named, perform, stream
from sim.persons.performers import WRIST

SHEET_COLUMNS = 8


class ShadowEye(Eye):
    """An eye that sees cast shadows."""

    def __init__(self, model: mujoco.MjModel, width_px: int, height_px: int) -> None:
        super().__init__(model, width_px, height_px)
        self._scene.flags[mujoco.mjtRndFlag.mjRND_SHADOW] = 1


class Lens:
    """Turns what is rendered for a camera into its image: averages over pixels, then bends."""

    def __init__(self, camera: CalibratedCamera) -> None:
        width, height = camera.width_px, camera.height_px
        grid = np.stack(np.meshgrid(np.arange(width), np.arange(height)), axis=-1).reshape(-1, 1, 2).astype(np.float64)
        ideal = cv2.undistortPointsIter(  # type: ignore[call-overload]  # R and P may be None
            grid,
            camera.matrix,
            camera.distortion,
            None,
            None,
            (cv2.TERM_CRITERIA_COUNT | cv2.TERM_CRITERIA_EPS, 40, 1e-9),
        )
        self._size = (width + 2 * MARGIN_PX, height + 2 * MARGIN_PX)
        middle = np.array([(width - 1) / 2 + MARGIN_PX, (height - 1) / 2 + MARGIN_PX])
        places = (ideal.reshape(height, width, 2) * camera.matrix[0, 0] + middle).astype(np.float32)
        self._maps = cv2.convertMaps(places[..., 0], places[..., 1], cv2.CV_16SC2)

    def image(self, picture: Image) -> Image:
        """The image RGB [240, 320, 3] of a picture of `rendered_px()`."""
        smaller = cv2.resize(picture, self._size, interpolation=cv2.INTER_AREA)
        whole, parts = self._maps
        return np.asarray(cv2.remap(smaller, whole, parts, cv2.INTER_LINEAR), dtype=np.uint8)


@dataclass(frozen=True)
class Frame:
    """The body at one time: pose (9,), wrist (3,), displacement of the torso (3,), objects (acts, 3); m."""

    pose: Floats
    wrist: Floats
    shift: Floats
    objects: Floats


class Studio:
    """Films one performance. Holds a graphics context: use it in one thread and `close` it.

    Args:
        performance: What happens.
        markers: Points of the arm at which the person wears coloured balls.
    """

    def __init__(self, performance: Performance, markers: tuple[str, ...] = ()) -> None:
        kind, number = performance.kind, performance.number
        self.performance = performance
        self.room = Room.draw(stream(kind, number, 1))
        draw = stream(kind, number, 2)
        self.cameras = draw_cameras(draw)
        self.calibrated = tuple(as_calibrated(camera, draw) for camera in self.cameras)
        self._model = build(performance, self.room, self.cameras, markers)
        self._data = mujoco.MjData(self._model)
        self._eye = ShadowEye(self._model, *rendered_px())
        self._lenses = [Lens(camera) for camera in self.cameras]

    @property
    def times_s(self) -> Floats:
        """Of the frames, (T,)."""
        last = (len(self.performance.motion.points) - 1) / SAMPLE_RATE_HZ
        rate = self.performance.kind.rate_hz
        return np.arange(int(last * rate) + 1) / rate

    @property
    def views(self) -> tuple[int, ...]:
        """Numbers of the cameras that film."""
        return (self.performance.number % 4,) if self.performance.kind.one_view else (0, 1, 2, 3)

    def at(self, time_s: float) -> Frame:
        """The body at a time, between the 60 Hz frames by straight lines."""
        motion, person = self.performance.motion, self.performance.person
        position = time_s * SAMPLE_RATE_HZ
        first = min(int(position), len(motion.points) - 2)
        fraction = position - first

        def between(track: Floats) -> Floats:
            return np.asarray((1.0 - fraction) * track[first] + fraction * track[first + 1])

        points = between(motion.points)
        shift = points[0] - person.placement.in_world(RESTING_STERNUM)
        objects = np.array([between(track) for track in self.performance.objects])
        return Frame(between(motion.poses), points[WRIST], shift, objects)

    def film(self, time_s: float, view: int) -> Image:
        """The image of a view, RGB [240, 320, 3], without the sensor's noise."""
        self._place(time_s)
        return self._lenses[view].image(self._eye.look(self._data, self.cameras[view].name))

    def film_all(self, time_s: float) -> list[Image]:
        """The images of all views that film."""
        self._place(time_s)
        return [self._lenses[view].image(self._eye.look(self._data, self.cameras[view].name)) for view in self.views]

    def truth(self) -> Truth:
        """What is true in the frames."""
        frames = [self.at(time) for time in self.times_s]
        nearest = np.minimum((self.times_s * SAMPLE_RATE_HZ).round().astype(int), len(self.performance.labels) - 1)
        return Truth(
            np.array([frame.pose for frame in frames]),
            np.array([frame.wrist for frame in frames]),
            self.performance.labels[nearest],
            self.performance.acts,
            self.performance.person.sizes,
            self.performance.person.shoulder,
            self.cameras,
        )

    def clip(self, root: Path) -> Clip:
        """The clip that a tracker sees, in a folder below `root`; its files are not written."""
        one, person = self.performance, self.performance.person
        return Clip(
            root / one.name,
            one.name,
            one.kind.name,
            one.number,
            self.times_s,
            self.views,
            self.calibrated,
            person.measured,
            person.measured_shoulder,
            self.room.noise,
        )

    def close(self) -> None:
        """Gives the graphics context back."""
        self._eye.close()

    def _place(self, time_s: float) -> None:
        frame = self.at(time_s)
        place_arm(self._model, self._data, frame.pose, frame.wrist)
        place_torso(self._model, self._data, frame.shift)
        place_markers(self._model, self._data, frame.pose, frame.wrist)
        for number, place in enumerate(frame.objects):
            if np.isfinite(place).all():
                self._data.mocap_pos[self._model.body(f"object_{number}").mocapid[0]] = place - (0.0, 0.0, 0.02)
        mujoco.mj_kinematics(self._model, self._data)
        mujoco.mj_camlight(self._model, self._data)


def render(kind: Kind, number: int, root: Path, recordings: Path | None = None) -> Clip:
    """Renders a clip into a folder below `root`. Raises RecordingsError where it needs recordings that are absent."""
    studio = Studio(perform(kind, number, recordings))
    try:
        clip = studio.clip(root)
        filmed = [studio.film_all(time) for time in studio.times_s]
        write_clip(clip, studio.truth(), {view: [one[i] for one in filmed] for i, view in enumerate(studio.views)})
    finally:
        studio.close()
    return clip


def contact_sheet(clips: Sequence[Clip], columns: int = SHEET_COLUMNS, all_views: bool = True) -> Image:
    """Frames of clips, RGB: per clip one row per view, `columns` times from the first to the last."""
    rows = []
    for clip in clips:
        chosen_frames = np.linspace(0, len(clip.times_s) - 1, columns).round().astype(int)
        for view in clip.views if all_views else clip.views[:1]:
            images = list(clip.images(view))
            rows.append(np.hstack([images[number] for number in chosen_frames]))
    return np.vstack(rows)


def missing(root: Path, kinds: Sequence[Kind]) -> list[tuple[Kind, int]]:
    """The clips that are not there, or rendered by other code."""
    todo = []
    for kind in kinds:
        for number in range(kind.clips):
            try:
                read_clip(root / f"{kind.name}_{number:02d}")
            except InputError:
                todo.append((kind, number))
    return todo


def main(arguments: Sequence[str] | None = None) -> int:
    parser = argparse.ArgumentParser(prog="python -m sim.performances", description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--out", type=Path, default=clips_folder(), help="folder of the clips (default: %(default)s)")
    parser.add_argument("--kind", action="append", help=f"only this kind: {', '.join(one.name for one in KINDS)}")
    parser.add_argument("--clips", type=int, help="only so many of each kind")
    parser.add_argument("--data", type=Path, help="folder of recorded people (default: shared/data beside the clone)")
    parser.add_argument("--contact-sheet", type=Path, help="write a PNG with frames of the clips")
    chosen = parser.parse_args(arguments)
    try:
        kinds = [kind_named(name) for name in chosen.kind] if chosen.kind else list(KINDS)
    except ValueError as error:
        parser.error(str(error))
    todo = [
        (kind, number) for kind, number in missing(chosen.out, kinds) if chosen.clips is None or number < chosen.clips
    ]
    skipped: str | None = None
    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn())
    try:
        with Progress(*columns, transient=True) as progress:
            task = progress.add_task("clips", total=len(todo))
            for kind, number in todo:
                progress.update(task, description=f"{kind.name} {number}")
                try:
                    render(kind, number, chosen.out, chosen.data)
                except RecordingsError as error:
                    skipped = f"clips of kind {kind.name} are left out: {error}"
                progress.advance(task)
    except KeyboardInterrupt:
        sys.stdout.write(f"interrupted; the finished clips are in {chosen.out}\n")
        return 130
    if skipped:
        sys.stdout.write(skipped + "\n")
    manifest = write_manifest(chosen.out)
    clips = [clip for kind in kinds for clip in read_clips(chosen.out) if clip.kind == kind.name]
    sys.stdout.write(f"{len(clips)} clips of {', '.join(kind.name for kind in kinds)}; listed in {manifest}\n")
    if chosen.contact_sheet:
        cv2.imwrite(str(chosen.contact_sheet), contact_sheet(clips)[:, :, ::-1])
    return 0


if __name__ == "__main__":
    sys.exit(main())
