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
from foxglove_schemas_protobuf.RawImage_pb2 import RawImage

from paramove.bus import topics
from paramove.documents import Image
from paramove.msgs.rule_pb2 import Speech
from sim.scenes import at_the_tool_box
from sim.simulation import Simulation
from sim.simulator import Config


def stages(simulation: Simulation) -> Iterator[str]:
    """Lets the story run and stops at each time worth a picture."""
    person, world = simulation.person, simulation.world

    def run(until: Callable[[], bool], longest_s: float = 200.0) -> None:
        end_s = world.time_s + longest_s
        while not until() and world.time_s < end_s:
            simulation.run_to_tick(simulation.tick + 1)

    yield "start"
    person.handle(Speech.REQUEST_HAND_ME_AN_OBJECT)
    run(lambda: person.doing.startswith("holds"))
    run(lambda: False, 1.2)
    yield "hand over"
    person.handle(Speech.REQUEST_SHOW_RULES)
    run(lambda: person.doing == "turns the box")
    run(lambda: False, 3.0)
    yield "turn the box"
    run(lambda: person.doing.startswith("puts"))
    run(lambda: world.held_by_instructor is not None)
    yield "show"
    run(lambda: False, 2.6)
    yield "carry"
    run(lambda: world.held_by_instructor is None)
    yield "in its opening"
    person.handle(Speech.REQUEST_POINT_AT_OBJECT)
    run(lambda: person.doing.startswith("points"))
    yield "before pointing"
    run(lambda: False, 4.5)
    yield "points"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--out", type=Path, default=Path("preview.png"))
    arguments = parser.parse_args()
    simulation = at_the_tool_box(Config(seed=arguments.seed, video=True))
    pairs = []
    for title in stages(simulation):
        shown = simulation.shown()
        pair = np.concatenate(
            [_picture(shown[topic]) for topic in (topics.CAMERA_IMAGE_RAW, topics.TRUTH_VIEW)], axis=1
        )
        pairs.append(_titled(pair, f"{title} {simulation.world.time_s:.1f} s"))
    rows = [np.concatenate(pairs[first : first + 2], axis=1) for first in range(0, len(pairs) - 1, 2)]
    cv2.imwrite(str(arguments.out), cv2.cvtColor(np.concatenate(rows), cv2.COLOR_RGB2BGR))
    simulation.close()


def _picture(image_raw: RawImage) -> Image:
    return np.frombuffer(image_raw.data, np.uint8).reshape(image_raw.height, image_raw.width, 3)


def _titled(picture: Image, title: str) -> Image:
    titled = picture.copy()
    cv2.putText(titled, title, (8, 18), cv2.FONT_HERSHEY_SIMPLEX, 0.5, (250, 60, 40), 1, cv2.LINE_AA)
    return titled


if __name__ == "__main__":
    main()
