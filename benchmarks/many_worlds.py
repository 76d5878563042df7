"""Many worlds without their stories: what the camera sees in them, and whether every relocation can be planned.

    python -m benchmarks.many_worlds [--seeds 0-99] [--placing-error-mm 1.5] [--json FILE]

For each seed: a cylinder at the four corners gives the homography, its places off by the placing error; then three
cylinders stand as the seed's instructor would stand them, are seen and located, and the robot plans to put each away,
the others standing, in an order drawn at random. One that others stand in the way of comes later; it is a fault if
none of those that are left can be put away, for then a person has to help. Nothing moves: a world takes seconds
instead of minutes, so rare lights, cameras and layouts are found that a few whole runs do not show.
"""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
from rich.console import Console
from rich.progress import track

from paramove.evaluation.batch import seeds_of
from paramove.imitation.clear_plans import ClearPlans, NoClearPlanError
from paramove.imitation.setup import MovementSource, SurfaceParameters, plans_for
from paramove.msgs.tracked_objects_pb2 import TrackedObject
from paramove.robots.description import RobotDescription
from paramove.vision.colour_tracker import ColourTracker
from paramove.vision.frames import Frame, decode, encode
from paramove.vision.homography import PlaneHomography
from sim import looks, places, scene, tool_box
from sim.camera import Eye, Sensor
from sim.looks import Looks
from sim.world import OPENINGS_UP, World

CORNERS = ((0.135, -0.10), (0.135, 0.076), (0.19, 0.076), (0.19, -0.10))
GRASP_Z = -0.098


class View:
    """The camera of one world and the tracker behind it."""

    def __init__(self, seed: int, description: RobotDescription) -> None:
        self.looks = Looks.draw(seed)
        self.draws = looks.streams(seed)
        self.world = World(self.looks, description)
        self._eye = Eye(self.world.model, *scene.RENDERED_PX)
        self._sensor = Sensor(self.looks.camera, self.looks.pixel_noise, self.draws["noise"])
        self._tracker = ColourTracker()

    def see(self) -> dict[str, TrackedObject]:
        """What is tracked in an image taken now, by name."""
        mujoco.mj_forward(self.world.model, self.world.data)
        image = self._sensor.expose(self._eye.look(self.world.data, "camera"))
        frame = Frame(np.ascontiguousarray(image[:, :, ::-1]), 0, 0)
        return {found.name: found for found in self._tracker.update(decode(encode(frame))).objects}

    def stand(self, name: str, place: np.ndarray[Any, Any] | tuple[float, float]) -> None:
        """Stand a cylinder at a place of the working plane."""
        self.world.place(name, tool_box.standing_centre(*place))

    def park(self) -> None:
        """All cylinders out of sight."""
        for colour, place in zip(tool_box.COLOURS, places.PARKED, strict=True):
            self.world.place(colour, place)

    def close(self) -> None:
        """Gives the graphics context back."""
        self._eye.close()


def examine(seed: int, description: RobotDescription, plans: ClearPlans, placing_error: float) -> dict[str, Any]:
    """Faults of one world, and how far off the located cylinders are."""
    view = View(seed, description)
    try:
        return _examine(seed, view, plans, placing_error)
    finally:
        view.close()


def _examine(seed: int, view: View, plans: ClearPlans, placing_error: float) -> dict[str, Any]:
    draw = np.random.default_rng((seed, 7))
    faults: list[str] = []
    image = []
    for corner in CORNERS:
        view.park()
        view.stand("blue", np.array(corner) + draw.normal(0.0, placing_error, 2))
        seen = view.see()
        if sorted(seen) != ["blue"]:
            faults.append(f"corner {corner}: saw {sorted(seen)}")
        if "blue" not in seen:
            return {"seed": seed, "faults": faults, "errors_mm": []}
        image.append((seen["blue"].u_px, seen["blue"].v_px))
    homography = PlaneHomography.fit(image, CORNERS, GRASP_Z)
    view.park()
    view.world.move_box(np.zeros(3), OPENINGS_UP)
    layout, _ = places.draw_layout(view.draws["places"])
    for colour, place in zip(tool_box.COLOURS, layout, strict=True):
        view.stand(colour, place)
    seen = view.see()
    if sorted(seen) != sorted(tool_box.COLOURS):
        faults.append(f"three cylinders: saw {sorted(seen)}")
    located = {n: np.array(homography.plane_from_image(f.u_px, f.v_px)) for n, f in seen.items() if n != "magenta"}
    errors = [
        1e3 * float(np.linalg.norm(located[colour] - place))
        for colour, place in zip(tool_box.COLOURS, layout, strict=True)
        if colour in located
    ]
    later, stuck = _plan_all(view.looks, located, plans, draw)
    result = {"seed": seed, "faults": faults + stuck, "errors_mm": errors, "put_away_later": later}
    return result | {"brightness": view.looks.brightness}


def _plan_all(
    world: Looks, located: dict[str, Any], plans: ClearPlans, draw: np.random.Generator
) -> tuple[int, list[str]]:
    """How often an object had to wait for another one, and why there is no way on, if there is none."""
    openings = {item.name: item for item in tool_box.OPENINGS}
    targets = {name: openings[world.rules[name]].centre[:2] + draw.normal(0.0, 0.001, 2) for name in sorted(located)}
    waiting = [str(name) for name in draw.permutation(sorted(located))]
    later, stuck = 0, []
    while waiting and len(stuck) < len(waiting):
        name = waiting.pop(0)
        others = np.array([located[other] for other in waiting]).reshape(-1, 2)
        try:
            fetch = plans.fetch(np.array([*located[name], GRASP_Z]), others)
            plans.deliver(fetch.gripper[-1], np.array([*targets[name], GRASP_Z]), others)
            stuck = []
        except NoClearPlanError as error:
            waiting.append(name)
            where = f"{np.round(located[name] * 100, 1)} to {np.round(targets[name] * 100, 1)} cm"
            stuck.append(f"{name} from {where}: {error}")
            later += 1
    return later, stuck


def main() -> int:
    """Prints the faults; exit code 3 if there are any."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", default="0-99")
    parser.add_argument("--placing-error-mm", type=float, default=1.5)
    parser.add_argument("--json", type=Path)
    arguments = parser.parse_args()
    robot = Path("robot_description/hoap3")
    description = RobotDescription.load(robot)
    plans = plans_for(robot, "right", MovementSource(), SurfaceParameters())
    console = Console(highlight=False)
    results = []
    for seed in track(seeds_of(arguments.seeds), "worlds", console=Console(stderr=True)):
        results.append(examine(seed, description, plans, 1e-3 * arguments.placing_error_mm))
        for fault in results[-1]["faults"]:
            console.print(f"seed {seed}: {fault}", soft_wrap=True)
    errors = np.concatenate([result["errors_mm"] for result in results])
    faulty = [result["seed"] for result in results if result["faults"]]
    waited = sum(result.get("put_away_later", 0) > 0 for result in results)
    console.print(
        f"{len(results)} worlds, {len(faulty)} with faults {faulty}; in {waited} an object has to wait for another; "
        f"located to {np.median(errors):.2f} mm (median), {np.percentile(errors, 99):.2f} mm (99 %), "
        f"{errors.max():.2f} mm (worst)"
    )
    if arguments.json:
        arguments.json.write_text(json.dumps(results, indent=1), encoding="utf-8")
    return 3 if faulty else 0


if __name__ == "__main__":
    sys.exit(main())
