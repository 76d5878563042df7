"""Simulator: stands where the hardware stands. It gives the cameras' images and moves the robot's motors.

Subscribes  wire/hoap3/stream   StreamBatch         events  joint units
            speech              Speech              events
Publishes   clock               Clock               15 Hz
            camera/image_raw    foxglove.RawImage   15 Hz   camera_optical
            camera_1/image_raw, camera_2/image_raw,
            camera_3/image_raw, camera_4/image_raw   foxglove.RawImage   15 Hz, or a part of it   camera_1 … camera_4
            wire/hoap3/state    Hoap3State          15 Hz   joint units
            truth/layout        TruthLayout         once, latched   world; only for evaluators
            truth/state         TruthState          15 Hz   world; only for evaluators
            truth/arm           TruthArm            15 Hz   table; only for evaluators
            truth/view          foxglove.RawImage   15 Hz   for people, on request; only for evaluators

The scene decides which of these there are. Where people would measure something beforehand, it is written into the run
folder: `cameras.yaml` and `person.yaml`.
"""

from __future__ import annotations

import contextlib
import logging
import time
from collections.abc import Mapping
from pathlib import Path
from typing import Literal, get_args

from pydantic import Field, model_validator

from paramove.bus import Bus, LockstepBarrier, NodeConfig, main, topics
from paramove.robots import RobotFolder
from sim.mishaps import Mishap
from sim.scenes import build
from sim.simulation import CAMERA_HZ, Simulated
from sim.tool_box import Measures
from sim.world import log_warnings_of_mujoco

SUBSCRIBES = (topics.WIRE_HOAP3_STREAM, topics.SPEECH)
PUBLISHES = (
    topics.CLOCK,
    topics.CAMERA_IMAGE_RAW,
    *topics.CAMERA_IMAGES_RAW,
    topics.WIRE_HOAP3_STATE,
    topics.TRUTH_LAYOUT,
    topics.TRUTH_STATE,
    topics.TRUTH_ARM,
    topics.TRUTH_VIEW,
)

REPORT_S = 5
CONNECTION_S = 0.5
"""Without lockstep: for those who wait for this process's topics, to connect; they try again every 0.2 s."""
FIRMWARE_LOG = "firmware_frames.int16"

_log = logging.getLogger(__name__)


Scene = Literal["rule_learning", "rule_learning_whole_arm", "relocate_by_pointing", "pointing", "servo_arm"]
Marker = Literal["shoulder", "elbow", "wrist", "index"]
OF_SCENES: Mapping[frozenset[str], frozenset[str]] = {
    frozenset({"targets", "views", "markers"}): frozenset({"pointing"}),
    frozenset({"robot"}): frozenset(get_args(Scene)) - {"pointing"},
    frozenset({"camera", "video", "measures"}): frozenset(get_args(Scene)) - {"pointing", "servo_arm"},
    frozenset({"robots"}): frozenset({"servo_arm"}),
    frozenset({"camera_socket"}): frozenset({"rule_learning"}),
    frozenset({"mishaps"}): frozenset({"rule_learning", "rule_learning_whole_arm"}),
    frozenset({"port"}): frozenset(get_args(Scene)) - {"pointing"},
    frozenset({"arm_image_every"}): frozenset({"rule_learning_whole_arm", "relocate_by_pointing"}),
}
"""Parameters that not every scene has."""


class Config(NodeConfig):
    """The scene, and how it runs.

    Attributes:
        scene: `rule_learning`: HOAP-3 at its tool box, and an instructor of whom one sees a hand.
            `rule_learning_whole_arm`: the instructor is a whole arm, which two calibrated cameras see.
            `relocate_by_pointing`: HOAP-3 with one object, and a person who points at free places.
            `pointing`: a person alone at a table, who points.
            `servo_arm`: emulated servos that move an arm in the scene next to its model; only in lockstep.
        seed: Of everything random in the world.
        robot: Folder of the robot's description.
        robots: Of `servo_arm`, instead of one robot: namespace -> folder of the description of the arm in it.
        camera: Whether cameras' images are rendered; without, no graphics library is needed.
        video: Whether a view for people is rendered too.
        measures: Of the tool box and of the nominal camera; None: those for the robot's objects.
        arm_image_every: Cameras that look at an arm give an image in every so many ticks of 1/15 s; rendering and
            tracking take most of the time of a run.
        targets: Of `pointing`: how often the person points.
        views: Of `pointing`: which cameras look, from 1.
        markers: Of `pointing`: points of the arm at which the person wears coloured balls.
        port: Of a servo arm: link to the serial port, relative to the run's folder or to that of the arm's namespace.
        camera_socket: Where the robot's camera offers its images instead of publishing them, relative to the run's
            folder: as a webcam does behind its device.
        mishaps: What goes wrong before each object is pointed at, in order; see `sim.mishaps`.
        max_duration_s: Simulated time after which the run ends.
        pace: Simulated seconds per second when nobody waits for anybody (not in lockstep).
        firmware_log: Whether every frame that the firmware plays is written to the run folder (56 kB/s), for those who
            judge afterwards whether the arm ever jumped.
    """

    scene: Scene = "rule_learning"
    seed: int = Field(default=0, ge=0)
    robot: RobotFolder = Path("robot_description/hoap3")
    robots: dict[str, RobotFolder] = Field(default_factory=dict)
    camera: bool = True
    video: bool = False
    measures: Measures | None = None
    arm_image_every: int = Field(default=1, ge=1, le=4)
    targets: int = Field(default=5, ge=1, le=100)
    views: tuple[int, ...] = Field(default=(1, 2), min_length=1, max_length=4)
    markers: tuple[Marker, ...] = ()
    port: Path = Path("by-id/usb-paramove_emulated_servos-if00-port0")
    camera_socket: Path | None = None
    mishaps: tuple[Mishap, ...] = ()
    max_duration_s: float = Field(default=600.0, gt=0)
    pace: float = Field(default=1.0, gt=0)
    firmware_log: bool = False

    @model_validator(mode="after")
    def _has_no_parameter_of_another_scene(self) -> Config:
        for names, scenes in OF_SCENES.items():
            unused = sorted(names & self.model_fields_set)
            if unused and self.scene not in scenes:
                raise ValueError(f"scene {self.scene} has no {', '.join(unused)}; {', '.join(sorted(scenes))} has")
        return self


def run(bus: Bus, config: Config) -> None:
    """Loop until the bus closes, the scene is finished or the simulated time is up."""
    log_warnings_of_mujoco()
    bus.settings.check_namespaces(config.robots)
    with contextlib.ExitStack() as open_files:
        log = None
        if config.firmware_log:  # without a buffer: nothing is lost when the process is killed
            log = open_files.enter_context((bus.run_folder / FIRMWARE_LOG).open("xb", buffering=0))
        simulation = build(config, bus.run_folder, bus.settings.folder, log, bus.settings.lockstep)
        open_files.callback(simulation.close)
        simulation.write_measures(bus.run_folder)
        _loop(bus, config, simulation)


def _loop(bus: Bus, config: Config, simulation: Simulated) -> None:
    barrier = LockstepBarrier(bus)
    layout = simulation.layout()
    if layout is not None:
        bus.publish(topics.TRUTH_LAYOUT, layout)
    bus.ready("waits for the members of the lockstep" if bus.settings.lockstep else "runs in real time")
    if not barrier.wait_for_members():
        return
    if not bus.settings.lockstep:
        bus.idle(CONNECTION_S)
    started_s = due_s = time.perf_counter()
    end_ns = simulation.now_ns + round(1e9 * config.max_duration_s)
    while not bus.stopped and not simulation.finished and simulation.now_ns < end_ns:
        for topic, message in simulation.messages():
            bus.publish(topic, message, simulation.now_ns)
        for received in barrier.advance(simulation.now_ns):
            simulation.handle(received)
        if bus.stopped:
            break
        simulation.run_to_tick(barrier.tick)
        if not bus.settings.lockstep:
            due_s = _keep_pace(bus, due_s + 1 / (CAMERA_HZ * config.pace))
        if barrier.tick % (REPORT_S * CAMERA_HZ) == 0:
            bus.ready(simulation.detail(time.perf_counter() - started_s))
    barrier.close()
    _log.info("%s", simulation.detail(time.perf_counter() - started_s))


def _keep_pace(bus: Bus, due_s: float) -> float:
    """Waits until `due_s`; returns when the tick really came.

    A world that is late stays late: in a hurry it would outrun the nodes that the same lack of time has slowed.
    """
    bus.idle(due_s - time.perf_counter())
    return max(due_s, time.perf_counter())


if __name__ == "__main__":
    main(run, SUBSCRIBES, PUBLISHES, Config, every_namespace=True)
