"""Pictures of a seed's world at some times of the story: the camera's image and the view for people.

    python -m sim.preview --seed 3 --out preview.png

The robot rests in its base pose.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Iterator
from pathlib import Path

import cv2
import numpy as np

from paramove.documents import Image
from paramove.msgs.rule_pb2 import Speech
from paramove.robots import RobotDescription
from paramove.robots.hoap3 import Firmware
from sim import looks, scene
from sim.camera import Eye, Sensor
from sim.instructor import Instructor
from sim.looks import Looks
from sim.world import World

ROBOT = scene.ROBOT_MODEL.parent


def stages(world: World, instructor: Instructor) -> Iterator[str]:
    """Lets the story run and stops at each time worth a picture."""
    description = world.description
    firmware, counts = Firmware(description), description.units.to_counts(description.base_pose)

    def run(until: Callable[[], bool], longest_s: float = 200.0) -> None:
        for _ in range(int(longest_s * 1000)):
            if until():
                return
            instructor.advance(0.001)
            world.step(firmware.step(counts, world.joint_positions(), world.joint_velocities()))

    yield "start"
    instructor.handle(Speech.REQUEST_HAND_ME_AN_OBJECT)
    run(lambda: instructor.doing.startswith("holds"))
    run(lambda: False, 1.2)
    yield "hand over"
    instructor.handle(Speech.REQUEST_SHOW_RULES)
    run(lambda: instructor.doing == "turns the box")
    run(lambda: False, 3.0)
    yield "turn the box"
    run(lambda: instructor.doing.startswith("puts"))
    run(lambda: world.held_by_instructor is not None)
    yield "show"
    run(lambda: False, 2.6)
    yield "carry"
    run(lambda: world.held_by_instructor is None)
    yield "in its opening"
    instructor.handle(Speech.REQUEST_POINT_AT_OBJECT)
    run(lambda: instructor.doing.startswith("points"))
    yield "before pointing"
    run(lambda: False, 4.5)
    yield "points"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--out", type=Path, default=Path("preview.png"))
    arguments = parser.parse_args()
    draws, world_looks = looks.streams(arguments.seed), Looks.draw(arguments.seed)
    world = World(world_looks, RobotDescription.load(ROBOT))
    instructor = Instructor(world, world_looks.rules, draws)
    eye, view = Eye(world.model, *scene.RENDERED_PX), Eye(world.model, *scene.VIEW_PX)
    sensor = Sensor(world_looks.camera, world_looks.pixel_noise, draws["noise"])
    pairs = []
    for title in stages(world, instructor):
        exposed = sensor.expose(eye.look(world.data, "camera"))
        pair = np.concatenate([exposed, view.look(world.data, "view")], axis=1)
        pairs.append(_titled(pair, f"{title} {world.time_s:.1f} s"))
    rows = [np.concatenate(pairs[first : first + 2], axis=1) for first in range(0, len(pairs) - 1, 2)]
    cv2.imwrite(str(arguments.out), cv2.cvtColor(np.concatenate(rows), cv2.COLOR_RGB2BGR))
    eye.close()
    view.close()


def _titled(picture: Image, title: str) -> Image:
    titled = picture.copy()
    cv2.putText(titled, title, (8, 18), cv2.FONT_HERSHEY_SIMPLEX, 0.5, (250, 60, 40), 1, cv2.LINE_AA)
    return titled


if __name__ == "__main__":
    main()
