"""Simulator: stands where the hardware stands. It gives the camera's images and moves the robot's motors.

Subscribes  wire/hoap3/stream   StreamBatch         events  joint units
            speech              Speech              events
Publishes   clock               Clock               15 Hz
            camera/image_raw    foxglove.RawImage   15 Hz   camera_optical
            wire/hoap3/state    Hoap3State          15 Hz   joint units
            truth/layout        TruthLayout         once, latched   world; only for evaluators
            truth/state         TruthState          15 Hz   world; only for evaluators
            truth/view          foxglove.RawImage   15 Hz   for people, on request; only for evaluators
"""

from __future__ import annotations

import contextlib
import logging
import time
from collections.abc import Callable
from pathlib import Path

from pydantic import Field

from paramove.bus import Bus, LockstepBarrier, NodeConfig, main, topics
from paramove.robots import RobotDescription
from sim import truth
from sim.simulation import CAMERA_HZ, Simulation
from sim.tool_box import NOMINAL, Measures
from sim.world import log_warnings_of_mujoco

SUBSCRIBES = (topics.WIRE_HOAP3_STREAM, topics.SPEECH)
PUBLISHES = (
    topics.CLOCK,
    topics.CAMERA_IMAGE_RAW,
    topics.WIRE_HOAP3_STATE,
    topics.TRUTH_LAYOUT,
    topics.TRUTH_STATE,
    topics.TRUTH_VIEW,
)

REPORT_S = 5
CONNECTION_S = 0.5
"""Without lockstep: for those who wait for this process's topics, to connect; they try again every 0.2 s."""
FIRMWARE_LOG = "firmware_frames.int16"

_log = logging.getLogger(__name__)


class Config(NodeConfig):
    """Parameters of the simulator.

    Attributes:
        seed: Of everything random in the world.
        robot: Folder of the robot's description.
        camera: Whether the camera's images are rendered; without, no graphics library is needed.
        video: Whether a view for people is rendered too.
        max_duration_s: Simulated time after which the run ends.
        measures: Of the tool box and of the nominal camera.
        firmware_log: Whether every frame that the firmware plays is written to the run folder (56 kB/s), for those who
            judge afterwards whether the arm ever jumped.
        pace: Simulated seconds per second when nobody waits for anybody (not in lockstep).
    """

    seed: int = Field(default=0, ge=0)
    robot: Path = Path("robot_description/hoap3")
    camera: bool = True
    video: bool = False
    max_duration_s: float = Field(default=600.0, gt=0)
    pace: float = Field(default=1.0, gt=0)
    firmware_log: bool = False
    measures: Measures = NOMINAL


def run(
    bus: Bus,
    config: Config,
    kind: type[Simulation] = Simulation,
    say_more: Callable[[Bus, Simulation], None] = lambda bus, simulation: None,
) -> None:
    """Loop until the bus closes or the simulated time is up. What `say_more` publishes belongs to the tick."""
    log_warnings_of_mujoco()
    with contextlib.ExitStack() as open_files:
        log = None
        if config.firmware_log:  # without a buffer: nothing is lost when the process is killed
            log = open_files.enter_context((bus.run_folder / FIRMWARE_LOG).open("xb", buffering=0))
        description = RobotDescription.load(config.robot)
        simulation = kind(config.seed, description, config.camera, config.video, log, config.measures)
        open_files.callback(simulation.close)
        simulation.write_measures(bus.run_folder)
        _loop(bus, config, simulation, say_more)


def _loop(bus: Bus, config: Config, simulation: Simulation, say_more: Callable[[Bus, Simulation], None]) -> None:
    barrier = LockstepBarrier(bus)
    bus.publish(topics.TRUTH_LAYOUT, truth.layout(simulation))
    bus.ready("waits for the members of the lockstep" if bus.settings.lockstep else "runs in real time")
    if not barrier.wait_for_members():
        return
    if not bus.settings.lockstep:
        bus.idle(CONNECTION_S)
    started_s = due_s = time.perf_counter()
    while not bus.stopped and simulation.world.time_s < config.max_duration_s:
        _say(bus, simulation)
        say_more(bus, simulation)
        for received in barrier.advance(simulation.now_ns):
            simulation.handle(received)
        if bus.stopped:
            break
        simulation.run_to_tick(barrier.tick)
        wall_s = time.perf_counter() - started_s
        if not bus.settings.lockstep:
            due_s = _keep_pace(bus, due_s + 1 / (CAMERA_HZ * config.pace))
        if barrier.tick % (REPORT_S * CAMERA_HZ) == 0:
            bus.ready(_detail(simulation, wall_s))
    wall_s = time.perf_counter() - started_s
    barrier.close()
    _log.info("%s", _detail(simulation, wall_s))
    pairs = simulation.world.contacts.unwanted_pairs
    if pairs:
        _log.warning("unwanted contacts: %s", ", ".join(f"{name} ({count})" for name, count in sorted(pairs.items())))


def _keep_pace(bus: Bus, due_s: float) -> float:
    """Waits until `due_s`; returns when the tick really came.

    A world that is late stays late: in a hurry it would outrun the nodes that the same lack of time has slowed.
    """
    bus.idle(due_s - time.perf_counter())
    return max(due_s, time.perf_counter())


def _say(bus: Bus, simulation: Simulation) -> None:
    """Everything that the world shows now. A state that is not finite never gets here: the step raises."""
    image_raw, view = simulation.image_raw(), simulation.view()
    if image_raw is not None:
        bus.publish(topics.CAMERA_IMAGE_RAW, image_raw)
    if view is not None:
        bus.publish(topics.TRUTH_VIEW, view)
    bus.publish(topics.WIRE_HOAP3_STATE, simulation.robot_state())
    bus.publish(topics.TRUTH_STATE, truth.state(simulation))


def _detail(simulation: Simulation, wall_s: float) -> str:
    time_s = max(simulation.world.time_s, 1e-9)
    percent = 100 / max(wall_s, 1e-9)
    return (
        f"{time_s:.0f} s simulated, {time_s / max(wall_s, 1e-9):.2f} times real time "
        f"(physics {simulation.physics_s * percent:.0f} %, rendering {simulation.rendering_s * percent:.0f} %); "
        f"instructor {simulation.instructor.doing}"
    )


if __name__ == "__main__":
    main(run, SUBSCRIBES, PUBLISHES, Config)
