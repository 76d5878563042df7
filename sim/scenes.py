"""The scenes that can be simulated, each composed of a world, a robot, a person and cameras."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import BinaryIO, Literal, get_args

from pydantic import Field, model_validator

from paramove.bus import NodeConfig
from paramove.robots import RobotDescription
from sim import looks, tool_box
from sim.camera import ImageSource, RobotCamera, ViewForPeople
from sim.hoap3 import Hoap3
from sim.instructor import Instructor
from sim.looks import Looks
from sim.person import Person
from sim.place_instructor import OBJECT, START, PlaceInstructor
from sim.pointing_world import PointingWorld
from sim.simulation import Simulated, Simulation
from sim.tool_box import NOMINAL, Measures
from sim.tracked_person import TrackedPerson, world_from_table
from sim.world import World

Scene = Literal["rule_learning", "rule_learning_whole_arm", "relocate_by_pointing", "pointing"]
Marker = Literal["shoulder", "elbow", "wrist", "index"]


class SceneOptions(NodeConfig):
    """What a scene is made of.

    Attributes:
        scene: `rule_learning`: HOAP-3 at its tool box, and an instructor of whom one sees a hand.
            `rule_learning_whole_arm`: the instructor is a whole arm, which two calibrated cameras see.
            `relocate_by_pointing`: HOAP-3 with one object, and a person who points at free places.
            `pointing`: a person alone at a table, who points.
        seed: Of everything random in the world.
        robot: Folder of the robot's description.
        camera: Whether cameras' images are rendered; without, no graphics library is needed.
        video: Whether a view for people is rendered too.
        measures: Of the tool box and of the nominal camera.
        arm_image_every: Cameras that look at an arm give an image in every so many ticks of 1/15 s; rendering and
            tracking take most of the time of a run.
        targets: Of `pointing`: how often the person points.
        views: Of `pointing`: which cameras look, from 1.
        markers: Of `pointing`: points of the arm at which the person wears coloured balls.
    """

    scene: Scene = "rule_learning"
    seed: int = Field(default=0, ge=0)
    robot: Path = Path("robot_description/hoap3")
    camera: bool = True
    video: bool = False
    measures: Measures = NOMINAL
    arm_image_every: int = Field(default=1, ge=1, le=4)
    targets: int = Field(default=5, ge=1, le=100)
    views: tuple[int, ...] = Field(default=(1, 2), min_length=1, max_length=4)
    markers: tuple[Marker, ...] = ()

    @model_validator(mode="after")
    def _has_no_parameter_of_another_scene(self) -> SceneOptions:
        for names, scenes in OF_SCENES.items():
            unused = sorted(names & self.model_fields_set)
            if unused and self.scene not in scenes:
                raise ValueError(f"scene {self.scene} has no {', '.join(unused)}; {', '.join(sorted(scenes))} has")
        return self


OF_SCENES: Mapping[frozenset[str], frozenset[str]] = {
    frozenset({"targets", "views", "markers"}): frozenset({"pointing"}),
    frozenset({"robot", "camera", "video", "measures"}): frozenset(get_args(Scene)) - {"pointing"},
    frozenset({"arm_image_every"}): frozenset({"rule_learning_whole_arm", "relocate_by_pointing"}),
}


def build(options: SceneOptions, firmware_log: BinaryIO | None = None) -> Simulated:
    """The scene that the options name.

    Args:
        options: See `SceneOptions`.
        firmware_log: Gets every frame that the robot's firmware plays, 28 little-endian int16 a millisecond.
    """
    if options.scene == "pointing":
        return PointingWorld(options.seed, options.targets, options.views, options.markers)
    return at_the_tool_box(options, firmware_log)


def at_the_tool_box(options: SceneOptions, firmware_log: BinaryIO | None = None) -> Simulation:
    """A scene of HOAP-3 at its tool box."""
    draws, world_looks = looks.streams(options.seed), Looks.draw(options.seed, options.measures)
    robot = Hoap3(RobotDescription.load(options.robot), firmware_log)
    tracked = None if options.scene == "rule_learning" else TrackedPerson(options.seed)
    world = World(world_looks, robot.description, None if tracked is None else tracked.furnish)
    cameras: list[ImageSource] = [ViewForPeople(world.model)] if options.video else []
    if options.camera and options.scene != "relocate_by_pointing":
        cameras.append(RobotCamera(world.model, world_looks, draws["noise"]))
    if tracked is None:
        return Simulation(world_looks, world, robot, Instructor(world, world_looks.rules, draws), cameras)
    if options.camera:
        cameras.append(tracked.images(world, options.arm_image_every))
    person: Person
    if options.scene == "relocate_by_pointing":
        world.place(OBJECT, tool_box.standing_centre(*START))
        person = PlaceInstructor(world, draws, tracked.body, tracked.pointing)
    else:
        person = Instructor(world, world_looks.rules, draws, tracked.body, tracked.pointing)
    return Simulation(world_looks, world, robot, person, cameras, world_from_table(world), tracked.write_measures)
