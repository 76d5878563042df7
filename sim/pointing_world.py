"""A person at a table who points at one target after the other, in the images of calibrated cameras."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from foxglove_schemas_protobuf.RawImage_pb2 import RawImage

from paramove.action_space import Person, write_person
from paramove.bus import Received, Topic, topics
from paramove.cameras import write_cameras
from paramove.demonstrations import table_place
from paramove.msgs.truth_pb2 import TruthArm
from sim.camera import raw_image, with_noise
from sim.performances import Studio
from sim.persons.performances import Performance, assembled, kind_named, pointed_once
from sim.persons.performers import draw_performer
from sim.simulation import CAMERA_HZ

SEED_SPACE = 1000
"""Numbers of performances from here on are runs; those below are the clips of chapter 6."""
REST_S = (1.0, 1.8)
POINTS = {"shoulder": 0, "elbow": 3, "hand": 6}


def pointing_performance(seed: int, targets: int) -> Performance:
    """A person of this seed points at so many places of the table. Everything follows from the seed."""
    rng = np.random.default_rng((SEED_SPACE, seed))
    person = draw_performer(rng)
    planned = []
    for _ in range(targets):
        theta = rng.uniform(0.0, 1.0, (1, 2))
        target = table_place(theta)
        planned.append(("pointing", theta, target, pointed_once(person, person.placement.in_model(target[0]), rng)))
    rests = [float(rng.uniform(*REST_S)) for _ in range(targets + 1)]
    kind = kind_named("pointing")
    return assembled(kind, SEED_SPACE + seed, person, planned, rests, np.full(3, np.nan), rng)


class PointingWorld:
    """One run. Holds a graphics context: use it in one thread and `close` it.

    Args:
        seed: Of person, room, cameras and noise.
        targets: How often the person points.
        views: Numbers of the cameras that look, from 1.
        markers: Points of the arm at which the person wears coloured balls.
    """

    def __init__(self, seed: int, targets: int, views: tuple[int, ...], markers: tuple[str, ...] = ()) -> None:
        self._studio = Studio(pointing_performance(seed, targets), markers)
        self._views = views
        self._noise = np.random.default_rng((SEED_SPACE, seed, 1))
        self.duration_s = float(self._studio.times_s[-1])
        self._tick = 0

    @property
    def now_s(self) -> float:
        """Simulated time since the start."""
        return self._tick / CAMERA_HZ

    @property
    def now_ns(self) -> int:
        """Simulated time since the start."""
        return round(self.now_s * 1e9)

    @property
    def finished(self) -> bool:
        """Whether the person has pointed at everything."""
        return self.now_s > self.duration_s

    def write_measures(self, folder: Path) -> None:
        """What people measure beforehand: `cameras.yaml`, with the errors of a calibration, and `person.yaml`."""
        write_cameras(folder / "cameras.yaml", [self._studio.calibrated[view - 1] for view in self._views])
        person = self._studio.performance.person
        sizes = {name: getattr(person.measured, name) for name in ("upper_arm", "forearm", "hand")}
        write_person(folder / "person.yaml", Person(shoulder=tuple(person.measured_shoulder), **sizes))

    def layout(self) -> None:
        """None: what does not change is in the measures."""

    def handle(self, received: Received) -> None:
        """Nobody asks this person for anything."""

    def run_to_tick(self, tick: int) -> None:
        """Let time pass up to a tick of 1/15 s."""
        self._tick = tick

    def messages(self) -> Iterator[tuple[Topic, Any]]:
        """See `sim.simulation.Simulated.messages`."""
        yield from zip(topics.CAMERA_IMAGES_RAW, self.images_raw(self.now_s), strict=False)
        yield topics.TRUTH_ARM, self.truth(self.now_s)

    def detail(self, wall_s: float) -> str:
        """What the person does."""
        return f"{self.now_s:.0f} s: the person {'points' if self.truth(self.now_s).action else 'rests'}"

    def images_raw(self, time_s: float) -> list[RawImage]:
        """The image of each camera, in the order of the views."""
        images = []
        for view in self._views:
            exposed = with_noise(self._studio.film(time_s, view - 1), self._studio.room.noise, self._noise)
            images.append(raw_image(exposed, f"camera_{view}", round(time_s * 1e9)))
        return images

    def truth(self, time_s: float) -> TruthArm:
        """How the arm really is, and where it points."""
        pose = self._studio.at(time_s).pose
        message = TruthArm(time_ns=round(time_s * 1e9))
        for name, first in POINTS.items():
            x, y, z = pose[first : first + 3]
            message.points.add(name=name, x=x, y=y, z=z)
        for number, act in enumerate(self._studio.performance.acts, start=1):
            if act.start_s <= time_s <= act.end_s:
                message.action, message.performance = act.action, number
                message.target.x, message.target.y, message.target.z = act.targets[0]
                message.at_target = bool(act.arrives_s[0] <= time_s <= act.leaves_s[0])
        return message

    def close(self) -> None:
        """Gives the graphics context back."""
        self._studio.close()
