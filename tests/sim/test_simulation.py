"""The simulated world behind the bus: ticks, what comes in, what it shows, and that a seed is a run."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest
from numpy.testing import assert_allclose

from paramove.bus import topics
from paramove.bus.subscriber import Received
from paramove.diagnosis import Eye, GraphicsError
from paramove.msgs.hoap3_wire_pb2 import Hoap3State
from paramove.msgs.rule_pb2 import Speech
from paramove.objects.colour_tracker import ColourTracker
from paramove.robots.description import RobotDescription
from paramove.robots.hoap3.wire import batch_message
from paramove.robots.streaming.stream import StreamBatch
from sim import looks, tool_box
from sim.simulation import Simulation, step_of_tick
from sim.world import OPENINGS_UP, World
from tests.sim.conftest import simulated


@pytest.fixture(scope="module")
def seeing() -> Iterator[Simulation]:
    """With a camera: opening the graphics takes longer than the tests."""
    simulation = simulated("rule_learning", 2, camera=True, video=True)
    yield simulation
    simulation.close()


def test_ticks_are_67_67_and_66_ms_and_never_drift() -> None:
    lengths = np.diff([step_of_tick(tick) for tick in range(16)])
    assert lengths.tolist() == [67, 67, 66] * 5
    assert step_of_tick(15 * 600) == 600_000


def test_the_same_seed_and_words_give_the_same_truth() -> None:
    runs = []
    for _ in range(2):
        simulation = simulated("rule_learning", 9)
        simulation.handle(_heard(topics.SPEECH, Speech(request=Speech.REQUEST_HAND_ME_AN_OBJECT)))
        for tick in range(1, 25):
            simulation.run_to_tick(tick)
        runs.append(simulation.shown()[topics.TRUTH_STATE].SerializeToString(deterministic=True))
    assert runs[0] == runs[1]


def test_robot_plays_the_stream_and_reports_it(description: RobotDescription) -> None:
    simulation = simulated("rule_learning", 0)
    wrist = description.index("right_wrist")
    rows = np.repeat(description.base_pose[None], 400, axis=0)
    share = np.clip(np.arange(400) / 300, 0, 1)
    rows[:, wrist] -= np.deg2rad(30) * share**3 * (10 - 15 * share + 6 * share**2)
    batch = StreamBatch.of(description, 7, 0, rows, 100)
    simulation.handle(_heard(topics.WIRE_HOAP3_STREAM, batch_message(batch)))
    assert not simulation.robot.stream.rejection
    simulation.run_to_tick(3)
    state = simulation.shown()[topics.WIRE_HOAP3_STATE]
    assert (state.epoch, state.next_index, state.depth) == (7, 200, 200)
    assert state.playing == Hoap3State.PLAYING_FRAMES
    simulation.run_to_tick(15)
    assert simulation.shown()[topics.WIRE_HOAP3_STATE].playing == Hoap3State.PLAYING_HELD
    angle = simulation.world.joint_positions()[wrist]
    assert_allclose(angle, description.base_pose[wrist] - np.deg2rad(30), rtol=0, atol=np.deg2rad(2.5))
    found = simulation.shown()[topics.TRUTH_STATE]
    assert_allclose(found.gripper, found.gripper_commanded, rtol=0, atol=2e-3)


def test_a_bad_batch_is_refused_and_reported(description: RobotDescription) -> None:
    simulation = simulated("rule_learning", 0)
    rows = np.repeat(description.base_pose[None], 50, axis=0)
    rows[20:, description.index("right_elbow")] += np.deg2rad(5.0)  # a jump
    rows[20:, description.index("right_elbow")] -= np.deg2rad(10.0)
    batch = StreamBatch.of(description, 7, 0, rows, 10)
    simulation.handle(_heard(topics.WIRE_HOAP3_STREAM, batch_message(batch)))
    state = simulation.shown()[topics.WIRE_HOAP3_STATE]
    assert state.rejected_batches == 1
    assert "right_elbow" in state.rejection
    simulation.run_to_tick(2)
    assert_allclose(simulation.world.joint_positions(), description.base_pose, rtol=0, atol=np.deg2rad(0.6))


def test_layout_tells_openings_rules_and_camera_in_the_world_frame() -> None:
    simulation = simulated("rule_learning", 6)
    layout = simulation.layout()
    origin = np.array(layout.world_from_shoulder)
    assert {rule.object: rule.opening for rule in layout.rules} == simulation.looks.rules
    for told, item in zip(layout.openings, tool_box.OPENINGS, strict=True):
        assert_allclose((told.x, told.y), item.centre[:2] + origin[:2], rtol=0, atol=1e-12)
    camera_from_world = np.array(layout.camera_from_world).reshape(4, 4)
    fx, fy, cx, cy, k1 = layout.camera_intrinsics
    point = tool_box.OPENINGS[2].centre
    x, y, z = (camera_from_world @ np.append(point + origin, 1.0))[:3]
    bend = 1 + k1 * ((x / z) ** 2 + (y / z) ** 2)
    expected = simulation.looks.camera.project(point[None])[0]
    assert_allclose((cx + fx * bend * x / z, cy + fy * bend * y / z), expected, rtol=0, atol=1e-9)


def test_camera_shows_each_colour_where_it_stands(seeing: Simulation) -> None:
    """Ties together model, lens, noise, colours and the true camera: the tracker finds what the projection says."""
    world = seeing.world
    world.move_box(np.zeros(3), OPENINGS_UP)
    places = {"yellow": (0.180, -0.08), "green": (0.190, -0.01), "blue": (0.178, 0.06)}
    for colour, place in places.items():
        world.place(colour, tool_box.standing_centre(*place))
    world.apply(np.zeros(world.description.n_joints))
    world.step()
    image_raw = seeing.shown()[topics.CAMERA_IMAGE_RAW]
    assert (image_raw.width, image_raw.height, image_raw.encoding) == (looks.WIDTH_PX, looks.HEIGHT_PX, "rgb8")
    image = np.frombuffer(image_raw.data, np.uint8).reshape(image_raw.height, image_raw.width, 3)
    found = {item.name: item for item in ColourTracker().update(np.ascontiguousarray(image[:, :, ::-1])).objects}
    assert set(found) == set(places)
    for colour in places:
        (u, v) = seeing.looks.camera.project(world.position(colour)[None])[0]
        assert_allclose((found[colour].u_px, found[colour].v_px), (u, v), rtol=0, atol=3.0)


def test_view_is_another_picture(seeing: Simulation) -> None:
    view = seeing.shown()[topics.TRUTH_VIEW]
    assert len(view.data) == 3 * view.width * view.height
    assert np.frombuffer(view.data, np.uint8).std() > 20


def test_missing_graphics_are_named_with_what_would_work(world: World, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("paramove.diagnosis.rendering.graphics_backend", lambda: "no_such_backend")
    with pytest.raises(GraphicsError, match=r"MUJOCO_GL=egl.*camera: false"):
        Eye(world.model, 64, 48)


def _heard(topic: topics.Topic, message: object) -> Received:
    return Received(topic, message, 0, 0, 1)
