"""The scenes that can be simulated, each composed of a world, a robot, a person and cameras."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, BinaryIO

from paramove.motion import check_model
from paramove.robots import RobotDescription
from paramove.robots.dynamixel import pacing_socket
from sim import looks, tool_box
from sim.camera import ImageSource, RobotCamera, ViewForPeople
from sim.drawn_person import DrawnPerson
from sim.hoap3 import Hoap3
from sim.instructor import Instructor
from sim.looks import Looks
from sim.mishaps import Mishaps, add_card
from sim.offered_camera import OfferedCamera
from sim.person import Person
from sim.place_instructor import OBJECT, PlaceInstructor
from sim.places import START
from sim.pointing_world import PointingWorld
from sim.servo_arm import ServoArm
from sim.servo_arm_world import ServoArmWorld, ServoArmWorlds
from sim.simulation import Simulated, SimulatedRobot, Simulation
from sim.tracked_person import TrackedPerson, world_from_table
from sim.world import World

if TYPE_CHECKING:
    from sim.simulator import Config


def build(
    options: Config, run_folder: Path, bus_folder: Path, firmware_log: BinaryIO | None = None, lockstep: bool = True
) -> Simulated:
    """The scene that the options name.

    Args:
        options: See `sim.simulator.Config`.
        run_folder: That the name of a port starts from.
        bus_folder: Of the socket by which a servo arm's driver paces the world.
        firmware_log: Gets every frame that the robot's firmware plays, 28 little-endian int16 a millisecond.
        lockstep: Whether the run is in lockstep.
    """
    if options.scene == "pointing":
        return PointingWorld(options.seed, options.targets, options.views, options.markers)
    if options.robots:
        return ServoArmWorlds(
            {
                namespace: _arm_alone(folder, options, run_folder / namespace, pacing_socket(bus_folder, namespace))
                for namespace, folder in options.robots.items()
            }
        )
    if options.scene == "servo_arm":
        return _arm_alone(options.robot, options, run_folder, pacing_socket(bus_folder))
    return at_the_tool_box(options, run_folder, bus_folder, firmware_log, lockstep)


def _arm_alone(folder: Path, options: Config, files: Path, pacing: Path) -> ServoArmWorld:
    """An arm in the scene next to its model.

    Args:
        folder: Of the robot's description.
        options: With the seed, and the name of the port.
        files: Folder that the name of the port starts from.
        pacing: Control socket, by which the arm's driver paces the world.
    """
    robot = RobotDescription.load(folder)
    check_model(robot)
    return ServoArmWorld(robot, files / options.port, pacing, options.seed)


def at_the_tool_box(
    options: Config,
    run_folder: Path = Path(),
    bus_folder: Path = Path(),
    firmware_log: BinaryIO | None = None,
    lockstep: bool = True,
) -> Simulation:
    """A scene of a robot at the tool box."""
    description = RobotDescription.load(options.robot)
    measures = options.measures or (tool_box.NOMINAL if description.chain is None else tool_box.WIDE)
    draws, world_looks = looks.streams(options.seed), Looks.draw(options.seed, measures)
    robot: SimulatedRobot
    if description.chain is None:
        robot = Hoap3(description, firmware_log)
    else:
        robot = ServoArm(description, run_folder / options.port, pacing_socket(bus_folder), options.seed, lockstep)
    tracked = None if options.scene == "rule_learning" else TrackedPerson(options.seed)
    furnishings = [] if tracked is None else [tracked.furnish]
    if "covered_opening" in options.mishaps:
        furnishings.append(add_card)
    world = World(world_looks, description, furnishings)
    drawn = DrawnPerson(world.world_from_shoulder) if tracked is None else None
    cameras: list[ImageSource] = [ViewForPeople(world.model, drawn)] if options.video else []
    if options.camera and options.scene != "relocate_by_pointing":
        camera: ImageSource = RobotCamera(world.model, world_looks, draws["noise"])
        socket = options.camera_socket
        cameras.append(camera if socket is None else OfferedCamera(camera, run_folder / socket))
    mishaps = Mishaps(world, options.mishaps, world_looks.rules)
    if tracked is None:
        return Simulation(
            world_looks, world, robot, Instructor(world, world_looks.rules, draws, mishaps=mishaps), cameras
        )
    if options.camera:
        cameras.append(tracked.images(world, options.arm_image_every))
    person: Person
    if options.scene == "relocate_by_pointing":
        world.place(OBJECT, tool_box.standing_centre(*START, world.shapes[OBJECT].half_height))
        person = PlaceInstructor(world, draws, tracked.body, tracked.pointing)
    else:
        person = Instructor(world, world_looks.rules, draws, tracked.body, tracked.pointing, mishaps)
    return Simulation(world_looks, world, robot, person, cameras, world_from_table(world), tracked.write_measures)
