"""The world whose instructor is a whole arm: what cameras see of it, and that a tracker finds where it points."""

from __future__ import annotations

import tempfile
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose

from paramove.action_space.messages import TablePose, estimate_message
from paramove.action_space.setup import TrackingSetup
from paramove.bus import topics
from paramove.bus.bus import Bus
from paramove.bus.settings import BusSettings
from paramove.cameras.calibrated import read_cameras
from paramove.msgs.rule_pb2 import Speech
from paramove.objects.colour_tracker import ColourTracker
from paramove.pointing.events import PointingEventOptions, PointingEvents
from paramove.supervision.launch_file import load
from paramove.workspace import Workspace
from sim import looks, simulator, tool_box, truth
from sim.arm import TIP, Arm
from sim.instructor import SEATED_S, Instructor
from sim.simulation import CAMERA_HZ, Simulation
from sim.simulator import Scene
from sim.small_person import SmallPerson, shoulder_from_table, turn_of_table
from sim.tracked_person import TrackedPerson
from sim.world import OPENINGS_UP
from tests.sim.conftest import ROBOT, simulated

LAUNCH = ROBOT.parents[1] / "launch"
PLACES = {"yellow": (0.170, 0.045), "green": (0.180, -0.075), "blue": (0.172, -0.015)}


@pytest.fixture(scope="module")
def seeing() -> Iterator[Simulation]:
    simulation = simulated("rule_learning_whole_arm", 3, camera=True)
    yield simulation
    simulation.close()


def lay_table(simulation: Simulation) -> None:
    simulation.world.move_box(np.zeros(3), OPENINGS_UP)
    for name, place in PLACES.items():
        simulation.world.place(name, tool_box.standing_centre(*place))
    assert isinstance(simulation.person, Instructor)
    simulation.person.arranged = True


def arm_of(simulation: Simulation) -> Arm:
    assert simulation.person.arm is not None
    return simulation.person.arm


def picture(image_raw) -> np.ndarray:
    return np.frombuffer(image_raw.data, np.uint8).reshape(image_raw.height, image_raw.width, 3)


def test_everything_but_the_arm_is_as_without_it() -> None:
    found = []
    scenes: tuple[Scene, ...] = ("rule_learning", "rule_learning_whole_arm")
    for scene in scenes:
        simulation = simulated(scene, 5)
        simulation.run_to_tick(5)
        message = truth.state(simulation.now_ns, simulation.world, simulation.robot, simulation.person)
        message.ClearField("hand")
        message.ClearField("instructor")
        found.append((simulation.looks, message.SerializeToString()))
        assert (simulation.world_from_table is None) == (scene == "rule_learning")
    assert found[0][0].rules == found[1][0].rules
    assert_allclose(found[0][0].camera.position, found[1][0].camera.position, rtol=0, atol=0)
    assert found[0][1] == found[1][1]


def test_the_hand_is_seen_where_the_instructor_holds_it(seeing: Simulation) -> None:
    seeing.run_to_tick(3)
    shown = seeing.shown()
    images_raw = [shown[topic] for topic in topics.STEREO_IMAGES_RAW]
    assert [image_raw.frame_id for image_raw in images_raw] == ["camera_1", "camera_2"]
    posture = arm_of(seeing).posture
    assert seeing.world_from_table is not None
    hand = np.linalg.inv(seeing.world_from_table) @ [*(posture[TIP] + seeing.world.world_from_shoulder), 1.0]
    for image_raw, camera in zip(images_raw, TrackedPerson(3).cameras, strict=True):
        u, v = camera.project(hand[:3]).round().astype(int)
        red, green, blue = picture(image_raw)[v - 12 : v + 13, u - 12 : u + 13].reshape(-1, 3).astype(int).T
        magenta = (red > green + 40) & (blue > green + 20)
        assert magenta.sum() > 15


def test_the_robots_own_camera_sees_the_same_hand_and_no_object_in_the_sleeve(seeing: Simulation) -> None:
    tracker = ColourTracker()
    seeing.run_to_tick(4)
    found = tracker.update(picture(seeing.shown()[topics.CAMERA_IMAGE_RAW])[:, :, ::-1], 0)
    assert {seen.name for seen in found.objects} <= {"magenta", "hand"}


def test_the_person_sits_at_first_and_then_withdraws() -> None:
    simulation = simulated("rule_learning_whole_arm", 7)
    arm = arm_of(simulation)
    simulation.run_to_tick(round(0.5 * SEATED_S * CAMERA_HZ))
    seated = arm.posture
    assert_allclose(seated[0], arm.body.seat, rtol=0, atol=0.02)
    assert seated[TIP, 2] < arm.body.seat[2] - 0.2
    simulation.run_to_tick(round((SEATED_S + 3.0) * CAMERA_HZ))
    moved = arm.posture
    assert looks.sees_enough(simulation.looks.camera)
    assert np.linalg.norm(moved[TIP] - seated[TIP]) > 0.3


def test_the_overlay_knows_where_the_table_frame_is() -> None:
    launch = load(Workspace.at(LAUNCH.parent), "rule_learning", ["sim", "action_space"])
    place = TablePose.model_validate(launch.file.nodes["action_tracker"].parameters["table_place"])
    points = np.random.default_rng(1).normal(size=(4, 3))
    assert place.frame == "right_shoulder"
    assert_allclose(place.frame_from_table(points), shoulder_from_table(points), rtol=0, atol=1e-9)
    assert_allclose(place.deviations(np.array([1.0, 2.0, 3.0]))[2], 3.0, rtol=1e-12)
    assert_allclose(turn_of_table() @ turn_of_table().T, np.eye(3), rtol=0, atol=1e-12)


@pytest.mark.long
def test_a_tracker_tells_the_object_that_is_pointed_at() -> None:
    """From what people measure beforehand and from images alone."""
    simulation = simulated("rule_learning_whole_arm", 11, camera=True)
    lay_table(simulation)
    with tempfile.TemporaryDirectory() as folder:
        simulation.write_measures(Path(folder))
        assert len(read_cameras(Path(folder) / "cameras.yaml")) == 2
        launch = load(Workspace.at(LAUNCH.parent), "rule_learning", ["sim", "action_space"])
        setup = TrackingSetup.model_validate(launch.file.nodes["action_tracker"].parameters)
        tracker = setup.video_tracker(Path(folder))
    events = PointingEvents(PointingEventOptions(min_certainty=0.6))
    simulation.person.handle(Speech.REQUEST_POINT_AT_OBJECT, "blue")
    said = []
    for tick in range(0, 20 * CAMERA_HZ, 2):
        simulation.run_to_tick(tick)
        shown = simulation.shown()
        for image_raw in (shown[topic] for topic in topics.STEREO_IMAGES_RAW):
            for moment in tracker.see(image_raw.frame_id, simulation.now_ns, picture(image_raw)):
                estimate = estimate_message(moment, tracker.parameter_names, setup.particles, setup.table_place)
                gesture = events.update(estimate)
                said += [gesture] if gesture is not None else []
        if said:
            break
    simulation.close()
    assert arm_of(simulation).at_target
    assert isinstance(simulation.person, Instructor)
    assert simulation.person.pointed_at == "blue"
    (gesture,) = said
    assert gesture.frame == "right_shoulder"
    assert np.hypot(gesture.x - PLACES["blue"][0], gesture.y - PLACES["blue"][1]) < 0.020


def test_images_of_the_arm_come_as_often_as_asked_for() -> None:
    with tempfile.TemporaryDirectory(prefix="pm", dir="/tmp") as path:  # paths of sockets are short
        folder = Path(path)
        for name in ("bus", "truth"):
            (folder / name).mkdir(mode=0o700)
        settings = BusSettings(folder=folder / "bus", truth_folder=folder / "truth", clock="simulated")
        with Bus("simulator", settings, simulator.SUBSCRIBES, simulator.PUBLISHES, folder) as bus:
            config = simulator.Config(
                scene="rule_learning_whole_arm", seed=1, robot=ROBOT, max_duration_s=0.6, pace=1000.0, arm_image_every=2
            )
            simulator.run(bus, config)
            said = {name: publisher.sequence for name, publisher in bus.exchange.publishers.items()}
        assert said["camera/image_raw"] == said["truth/arm"] == said["clock"] == 9
        assert said["camera_1/image_raw"] == said["camera_2/image_raw"] == 5
        assert said[topics.TRUTH_LAYOUT.name] == 1
        assert (folder / "person.yaml").is_file()


def test_persons_differ_in_size_seat_and_speed() -> None:
    persons = [SmallPerson(np.random.default_rng(seed)) for seed in range(20)]
    lengths = [person.sizes.length for person in persons]
    assert max(lengths) / min(lengths) > 1.08
    assert 0.26 < min(lengths) < max(lengths) < 0.33
    assert np.ptp([person.seat for person in persons], axis=0).min() > 0.01
