"""Many worlds without their stories: what the camera sees in them, and whether every relocation can be planned.

    python -m benchmarks.many_worlds [--seeds 0-99] [--placing-error-mm 1.5] [--measures nominal|drawn] [--json FILE]

For each seed: a cylinder at the four corners gives the homography, its positions off by the placing error. A hand puts
each cylinder into its opening: tracker and recognizer watch, and the rule that they give must be so near to the opening
that a cylinder put there slides in. Then three cylinders stand as the seed's instructor would stand them, are seen and
located, and the robot plans to put each away, the others standing, in an order drawn at random. One that others stand
in the way of comes later; it is a fault if none of those that are left can be put away, for then a person has to help.
Without physics and robot a world takes seconds instead of minutes, so rare lights, cameras and layouts are found that a
few whole runs do not show. With measures drawn, the cameras are 35 to 65 degrees above the table, the openings 25 to
34 mm wide with chamfers of 2 to 8 mm.
"""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Callable, Iterator
from dataclasses import asdict
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
from rich.console import Console
from rich.progress import track

from paramove.cameras import Frame, decode, encode
from paramove.diagnosis import Eye
from paramove.documents import Floats
from paramove.motion import MotionPlans, MovementSource, NoPlanError, plans_for
from paramove.msgs.gesture_pb2 import Gesture
from paramove.msgs.plane_calibration_pb2 import PlaneCalibration
from paramove.msgs.tracked_objects_pb2 import TrackedObject
from paramove.objects import ColourTracker, PlaneHomography, Recognizer
from paramove.robots import RobotDescription, SurfaceParameters
from paramove.runs import seeds_of
from sim import looks, places, scene, tool_box
from sim.camera import Sensor
from sim.hand import FROM_ABOVE
from sim.hand_path import minimum_jerk
from sim.instructor import SHOWN_LIFT
from sim.looks import Looks
from sim.simulation import CAMERA_HZ
from sim.tool_box import NOMINAL, Measures
from sim.world import OPENINGS_UP, World

CORNERS = ((0.135, -0.10), (0.135, 0.076), (0.19, 0.076), (0.19, -0.10))
GRASP_Z = -0.098
RESTS = 10
"""Images after which the recognizer has detected that something rests."""


class View:
    """The camera of one world, and the tracker and the recognizer behind it.

    Attributes:
        calibration: Once set, the recognizer reports positions on the plane.
        gestures: All so far.
    """

    def __init__(self, seed: int, description: RobotDescription, measures: Measures = NOMINAL) -> None:
        self.looks = Looks.draw(seed, measures)
        self.draws = looks.streams(seed)
        self.world = World(self.looks, description)
        self._eye = Eye(self.world.model, *scene.RENDERED_PX)
        self._sensor = Sensor(self.looks.camera, self.looks.pixel_noise, self.draws["noise"])
        self._tracker, self._recognizer = ColourTracker(), Recognizer()
        self._images = 0
        self.calibration: PlaneCalibration | None = None
        self.gestures: list[Gesture] = []

    def see(self, images: int = 1) -> dict[str, TrackedObject]:
        """What is tracked in the last of some images taken now, by name."""
        mujoco.mj_forward(self.world.model, self.world.data)
        for _ in range(images):
            self._images += 1
            image = self._sensor.expose(self._eye.look(self.world.data, "camera"))
            frame = Frame(np.ascontiguousarray(image[:, :, ::-1]), 0, 0)
            tracked = self._tracker.update(decode(encode(frame)), self._images * 1_000_000_000 // CAMERA_HZ)
            self.gestures += self._recognizer.update(tracked, self.calibration)
        return {tracked_object.name: tracked_object for tracked_object in tracked.objects}

    def calibrate(self, error: Callable[[], Floats]) -> list[str]:
        """A cylinder at the corners gives the calibration, its positions off by `error`, [2], m. Returns faults."""
        faults, image = [], []
        for corner in CORNERS:
            self.park()
            self.stand("blue", corner + error())
            detected = self.see(RESTS)
            if sorted(detected) != ["blue"]:
                faults.append(f"corner {corner}: saw {sorted(detected)}")
            if "blue" not in detected:
                return faults
            image.append((detected["blue"].u_px, detected["blue"].v_px))
        self.calibration = PlaneHomography.fit(image, CORNERS, GRASP_Z, "right_shoulder", "blue").to_message()
        return faults

    def show_rule(self, name: str, start: Floats) -> Floats | None:
        """A hand takes a cylinder from `start`, [2], and lets it fall into its opening.

        Returns:
            Position [2], m, where the recognizer saw it vanish; None if it did not.
        """
        opening = next(item for item in tool_box.OPENINGS if item.name == self.looks.rules[name])
        self.stand(name, start)
        self.world.move_hand(places.IDLE_FINGERTIP, FROM_ABOVE)
        self.see(RESTS)
        lift, into = np.array((0.0, 0.0, SHOWN_LIFT)), np.array((0.0, 0.0, -0.010))
        first, last = tool_box.standing_centre(*start), tool_box.standing_centre(opening.x, opening.y)
        path = [
            *_line(first, first + lift, 8),
            *_line(first + lift, last + lift, 20),
            *_line(last + lift, last + into, 8),
        ]
        for centre in path:
            self.world.place(name, centre)
            self.world.move_hand(centre + np.array((0.0, 0.0, tool_box.CYLINDER_HALF_HEIGHT)), FROM_ABOVE)
            self.see()
        for image in range(1, 5):
            fallen = min(0.5 * 9.81 * (image / CAMERA_HZ) ** 2, tool_box.COMPARTMENT_DEPTH + into[2])
            self.world.place(name, last + into - np.array((0.0, 0.0, fallen)))
            raised = tool_box.CYLINDER_HALF_HEIGHT + 0.02 * image
            self.world.move_hand(last + np.array((0.0, 0.0, raised)), FROM_ABOVE)
            self.see()
        self.world.move_hand(places.IDLE_FINGERTIP, FROM_ABOVE)
        before = len(self.gestures)
        self.see(3 * RESTS)
        vanished = [
            g for g in self.gestures[before:] if g.kind == Gesture.KIND_VANISHED and g.object == name and g.located
        ]
        return np.array((vanished[-1].x, vanished[-1].y)) if vanished else None

    def stand(self, name: str, position: np.ndarray[Any, Any] | tuple[float, float]) -> None:
        """Stand an object at a position of the working plane."""
        self.world.place(name, tool_box.standing_centre(position[0], position[1], self.world.shapes[name].half_height))

    def park(self) -> None:
        """All cylinders out of sight."""
        for colour, place in zip(tool_box.COLOURS, places.PARKED, strict=True):
            self.world.place(colour, place)

    def close(self) -> None:
        """Gives the graphics context back."""
        self._eye.close()


def _line(start: Floats, end: Floats, images: int) -> Iterator[Floats]:
    for image in range(1, images + 1):
        yield start + minimum_jerk(image / images) * (end - start)


def tolerance(measures: Measures) -> float:
    """How far from an opening's middle a cylinder still slides over the chamfer into it, m."""
    return measures.opening_radius + measures.chamfer - tool_box.CYLINDER_RADIUS


def drawn_measures(seed: int) -> Measures:
    """Another camera and other openings."""
    draw = np.random.default_rng((seed, 8))
    return Measures(draw.uniform(35.0, 65.0), draw.uniform(0.0125, 0.017), draw.uniform(0.002, 0.008))


def examine(
    seed: int, description: RobotDescription, plans: MotionPlans, placing_error: float, measures: Measures
) -> dict[str, Any]:
    """Faults of one world, and how far off rules and located cylinders are."""
    view = View(seed, description, measures)
    try:
        return _examine(seed, view, plans, placing_error)
    finally:
        view.close()


def _examine(seed: int, view: View, plans: MotionPlans, placing_error: float) -> dict[str, Any]:
    draw = np.random.default_rng((seed, 7))
    faults = view.calibrate(lambda: draw.normal(0.0, placing_error, 2))
    if view.calibration is None:
        return {"seed": seed, "faults": faults, "errors_mm": [], "rule_errors_mm": {}}
    homography = PlaneHomography.from_message(view.calibration)
    view.park()
    view.world.move_box(np.zeros(3), OPENINGS_UP)
    view.see(RESTS)
    measures, rule_errors = view.looks.measures, {}
    openings = {item.name: item.centre[:2] for item in tool_box.OPENINGS}
    for colour in tool_box.COLOURS:
        rule = view.show_rule(colour, places.draw_place(draw, []))
        error = np.inf if rule is None else float(np.linalg.norm(rule - openings[view.looks.rules[colour]]))
        rule_errors[colour] = 1e3 * error
        if error > tolerance(measures):
            faults.append(f"rule of {colour}: {1e3 * error:.1f} mm off, {1e3 * tolerance(measures):.1f} mm tolerated")
    view.park()
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
    return result | {"rule_errors_mm": rule_errors, "measures": asdict(measures), "brightness": view.looks.brightness}


def _plan_all(
    world: Looks, located: dict[str, Any], plans: MotionPlans, draw: np.random.Generator
) -> tuple[int, list[str]]:
    """How often an object had to wait for another one, and why no plan is left, if there is none."""
    openings = {item.name: item for item in tool_box.OPENINGS}
    targets = {name: openings[world.rules[name]].centre[:2] + draw.normal(0.0, 0.001, 2) for name in sorted(located)}
    waiting = [str(name) for name in draw.permutation(sorted(located))]
    later = 0
    stuck: list[str] = []
    while waiting and len(stuck) < len(waiting):
        name = waiting.pop(0)
        others = np.array([located[other] for other in waiting]).reshape(-1, 2)
        try:
            fetch = plans.fetch(np.array([*located[name], GRASP_Z]), others)
            plans.deliver(fetch.end, np.array([*targets[name], GRASP_Z]), others)
            stuck = []
        except NoPlanError as error:
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
    parser.add_argument("--measures", choices=["nominal", "drawn"], default="nominal")
    parser.add_argument("--json", type=Path)
    arguments = parser.parse_args()
    robot = Path("robot_description/hoap3")
    description = RobotDescription.load(robot)
    plans = plans_for(robot, "right", MovementSource(), SurfaceParameters())
    console = Console(highlight=False)
    results = []
    for seed in track(seeds_of(arguments.seeds), "worlds", console=Console(stderr=True)):
        measures = drawn_measures(seed) if arguments.measures == "drawn" else NOMINAL
        results.append(examine(seed, description, plans, 1e-3 * arguments.placing_error_mm, measures))
        for fault in results[-1]["faults"]:
            console.print(f"seed {seed}: {fault}", soft_wrap=True)
    errors = np.concatenate([result["errors_mm"] for result in results])
    rules = np.array([error for result in results for error in result["rule_errors_mm"].values()])
    faulty = [result["seed"] for result in results if result["faults"]]
    waited = sum(result.get("put_away_later", 0) > 0 for result in results)
    console.print(
        f"{len(results)} worlds, {len(faulty)} with faults {faulty}; in {waited} an object has to wait for another; "
        f"located to {np.median(errors):.2f} mm (median), {np.percentile(errors, 99):.2f} mm (99 %), "
        f"{errors.max():.2f} mm (worst); rules {np.median(rules):.2f} mm (median), {rules.max():.2f} mm (worst)"
    )
    if arguments.json:
        arguments.json.write_text(json.dumps(results, indent=1), encoding="utf-8")
    return 3 if faulty else 0


if __name__ == "__main__":
    sys.exit(main())
