"""No message makes a node fall over or say a number that is none, however wrong it is.

Each node gets a sound recording with, between its messages, every fault of every message that it hears. It is tried
twice: as the bus hands messages out, which leaves out those with unsound numbers, and without that protection.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from foxglove_schemas_protobuf.RawImage_pb2 import RawImage

from nodes import (
    action_tracker,
    arm_driver,
    body_tracker,
    camera,
    colour_tracker,
    operator,
    pose_detector,
    reacher,
    recognizer,
    recorder,
    relocator,
    rule_learner,
    synthesizer,
)
from paramove.bus import START_VARIABLE, topics
from paramove.bus.recorded import RecordedBus
from paramove.bus.subscriber import Received
from paramove.bus.ticks import Tick
from paramove.cameras.calibrated import write_cameras
from paramove.cameras.frames import Frame, encode
from paramove.msgs.action_estimate_pb2 import ActionEstimate
from paramove.msgs.joint_trajectory_pb2 import TrajectoryStatus
from paramove.msgs.relocation_pb2 import RelocationGoal
from paramove.msgs.safety_state_pb2 import ArmRequest, LinkState, SafetyFault, SafetyState, StopRequest
from paramove.objects.homography import PlaneHomography
from paramove.observation import BodyKeyPoints, key_points_message
from paramove.robots.hoap3.wire import state_message
from tests.action_space import drawn_arm
from tests.applications.launched import parameters
from tests.applications.pointing_story import PointingStory
from tests.applications.servo_cell import ServoCell
from tests.applications.story import Story
from tests.motion.fake_driver import Cell, goal
from tests.motion.reaching import OPENINGS, ROBOT_FOLDER, reaching_model
from tests.nodes.bad_messages import first_not_finite, variants
from tests.nodes.test_reacher import TASKS
from tests.objects.tracks import hand_with_tip, image_of, standing
from tests.observation.test_markers import EYES, with_markers
from tests.pointing.persons import performed, poses
from tests.robots.hoap3.movements import HOAP3
from tests.robots.streaming.fake_robot import FakeRobot, trajectory

PERIOD_NS = 66_666_667
Event = Received | Tick
Published = tuple[topics.Topic, Any]


class FaultyBus(RecordedBus):
    """Hands out a sound recording and, after each of its ticks, the next faulty messages.

    Attributes:
        fault: The newest one handed out or left out.
        left_out: Faults that the bus did not hand out.
    """

    def __init__(self, sound: list[Event], faulty: list[tuple[str, Published]], folder: Path, protected: bool) -> None:
        self.fault = "none"
        self.left_out: set[str] = set()
        self._faults: dict[int, str] = {}
        ticks = sum(isinstance(event, Tick) for event in sound)
        each, left, events = -(-len(faulty) // ticks), iter(faulty), list[Event]()
        for event in sound:
            events.append(event)
            if isinstance(event, Tick):
                for number, (name, (topic, message)) in enumerate(itertools.islice(left, each), start=1):
                    now_ns = event.now_ns + number * 1_000_000  # newer than all before, or it would be passed over
                    if "captured" in message.DESCRIPTOR.fields_by_name and "captured" not in name:
                        message.captured.FromNanoseconds(now_ns)
                    events.append(Received(topic, message, now_ns, now_ns, 1))
                    self._faults[id(events[-1])] = name
        self._all = events  # keeps their ids
        super().__init__(events, run_folder=folder, protected=protected)

    @property
    def goes_on(self) -> bool:
        return bool(self._waiting)

    def hands_out(self, heard: Received) -> bool:
        self.fault = self._faults.get(id(heard), self.fault)
        sound = super().hands_out(heard)
        if not sound:
            self.left_out.add(self.fault)
        return sound

    def publish(self, topic: topics.Topic, message: Any, captured_ns: int | None = None) -> None:
        super().publish(topic, message, captured_ns)
        found = first_not_finite(message)
        assert not found, f"it said {topic.name} with {found}"


def timed(messages: Iterable[Published]) -> list[Event]:
    """A message a tick, then the tick."""
    events: list[Event] = []
    for number, (topic, message) in enumerate(messages, start=1):
        now_ns = number * PERIOD_NS
        events += [Received(topic, message, now_ns, now_ns, number), Tick(number, now_ns)]
    return events


def _picture(seed: int) -> np.ndarray:
    return np.random.default_rng(seed).integers(40, 200, (36, 48, 3), dtype=np.uint8)


def _image_raw(seed: int) -> RawImage:
    return RawImage(encoding="bgr8", width=48, height=36, step=144, data=_picture(seed).tobytes())


def of_camera() -> list[Event]:
    return timed((topics.CAMERA_IMAGE_RAW, _image_raw(seed)) for seed in range(60))


def of_colour_tracker() -> list[Event]:
    return timed((topics.CAMERA_IMAGE, encode(Frame(_picture(seed), 0, seed))) for seed in range(40))


def of_recognizer() -> list[Event]:
    plane = [(0.1, -0.1), (0.2, -0.1), (0.2, 0.1), (0.1, 0.1)]
    calibration = PlaneHomography.fit([(300, 300), (300, 200), (100, 200), (100, 300)], plane).to_message()
    said: list[Published] = [(topics.CALIBRATION_PLANE, calibration)]
    for n in range(2, 150):
        u = 200 + 40 * np.sin(n / 25)
        seen = image_of(
            n * PERIOD_NS, standing("blue", u, 250), standing("green", 260, 250), hand_with_tip(u - 20, 250)
        )
        said.append((topics.OBJECTS_TRACKED, seen))
        said.append((topics.ACTION_ESTIMATE, _estimate(n)))
    return timed(said)


def _estimate(number: int) -> ActionEstimate:
    message = ActionEstimate(frame="table", progress=[0.5, 0.5], effective_sample_size=100.0, particles=400, views=1)
    message.captured.FromNanoseconds(number * PERIOD_NS)
    message.actions.add(action="pointing", probability=1.0).parameters.add(name="u", mean=0.5, covariance=[0.1])
    message.target.number, message.target.action = 1 + number // 40, "pointing"
    message.target.arrived.FromNanoseconds((number - number % 40) * PERIOD_NS)
    message.target.location.x, message.target.location.x_deviation = 0.1, 0.01
    return message


def of_action_tracker() -> list[Event]:
    images = drawn_arm.drawn(drawn_arm.pointing()[1][:30], drawn_arm.camera(1))
    frames = [encode(Frame(image, 0, number)) for number, image in enumerate(images)]
    arms = BodyKeyPoints(np.full((2, 4, 2), 80.0), np.full((2, 4), 3.0), np.zeros((2, 4)), np.ones((2, 4)), 1.0)
    seen = [
        (topics.CAMERA_KEY_POINTS[number % 4], key_points_message(arms, round(number * 1e9 / 15)))
        for number in range(len(frames))
    ]
    pictures = [(topics.CAMERA_IMAGES[number % 4], frame) for number, frame in enumerate(frames)]
    return timed(one for pair in zip(seen, pictures, strict=True) for one in pair)


def of_pose_detector() -> list[Event]:
    frames = [encode(Frame(np.full((120, 160, 3), 90, np.uint8), 0, number)) for number in range(8)]
    return timed((topics.CAMERA_IMAGES[number % 4], frame) for number, frame in enumerate(frames))


def of_pointing_poses() -> list[Event]:
    """A recognizer that hears poses; what it hears besides is as in `of_recognizer`."""
    said: list[Published] = [
        (event.topic, event.message) for event in of_recognizer()[:12] if isinstance(event, Received)
    ]
    return timed([*said, *((topics.HUMAN_ARM_POSE, pose) for pose in poses(performed("pointing", [(0.4, 0.5)])))])


def of_body_tracker() -> list[Event]:
    frames = [encode(Frame(with_markers(eye), 0, number)) for number, eye in enumerate(EYES)]
    return timed((topics.CAMERA_IMAGES[number % 4], frames[number % 2]) for number in range(24))


def of_rule_learner() -> list[Event]:
    story = Story("goal-0")
    assert story.run()
    safety = SafetyState(state=SafetyState.STATE_ARMED, faults=[SafetyFault(code="jump", joint="j", detail="s")])
    events: list[Event] = list(story.events)
    for place in range(0, len(events), 50):
        if isinstance(events[place], Tick):
            now_ns = events[place].now_ns
            events.insert(place + 1, Received(topics.ARM_SAFETY, safety, now_ns, now_ns, 1))
    return events


def of_relocator() -> list[Event]:
    story = PointingStory("goal-0", aligns=True)
    story.safety(SafetyState.STATE_ARMED, "sentence")
    assert story.run()
    return list(story.events)


def of_synthesizer() -> list[Event]:
    cell = Cell()
    cell.do(goal(RelocationGoal.KIND_RELOCATE, source=(0.177, -0.02), target=OPENINGS[1], avoid=[(0.17, 0.06)]))
    return cell.events


def of_reacher() -> list[Event]:
    cell = ServoCell()
    cell.disarm(SafetyState.STATE_DISARMED, "sentence")
    cell.tick(5)
    cell.safety = SafetyState(state=SafetyState.STATE_ARMED)
    cell.reason = "a reason"
    return [*cell.run().events, *cell.tick(60).events]


def of_arm_driver() -> list[Event]:
    robot, events = FakeRobot(), []
    robot.reader.target[:] = HOAP3.units.to_counts(HOAP3.base_pose)
    more: dict[int, Published] = {
        5: (topics.OPERATOR_ARM, ArmRequest(source="a person", armed=True, by_person=True)),
        6: (topics.OPERATOR_ARM_AT_START, ArmRequest(source="a program", armed=True)),
        7: (topics.OPERATOR_ARM_AWAY, ArmRequest(source="a person elsewhere", armed=True, by_person=True)),
        8: (topics.ARM_TRAJECTORY, trajectory("one", {"right_elbow": -60.0}, 1.0)),
        9: (topics.HOSTS_LINK, LinkState(hosts=["desk_pc"])),
        49: (topics.OPERATOR_STOP_AWAY, StopRequest(source="terminal")),
        50: (topics.OPERATOR_STOP, StopRequest(source="a person")),
        51: (topics.OPERATOR_ESTOP, StopRequest(source="terminal")),
    }
    for number in range(1, 60):
        now_ns = number * PERIOD_NS
        heard = [(topics.WIRE_HOAP3_STATE, state_message(robot.state(now_ns)))]
        heard += [more[number]] if number in more else []
        events += [Received(topic, message, now_ns, now_ns, number) for topic, message in heard]
        events.append(Tick(number, now_ns))
    return events


def of_operator() -> list[Event]:
    fault = SafetyFault(code="jump", joint="j", detail="s")
    states = [SafetyState.STATE_DISCONNECTED, SafetyState.STATE_DISARMED, SafetyState.STATE_ARMED] * 10
    return timed((topics.ARM_SAFETY, SafetyState(state=state, faults=[fault])) for state in states)


def of_recorder() -> list[Event]:
    status = TrajectoryStatus(trajectory_id="one", reason="why")
    return [*of_recognizer()[:40], *timed([(topics.ARM_TRAJECTORY_STATUS, status)])]


NODES: dict[str, tuple[Any, Callable[[], list[Event]], dict[str, Any]]] = {
    "camera": (camera, of_camera, {"width": 48, "height": 36}),
    "colour_tracker": (colour_tracker, of_colour_tracker, {}),
    "recognizer": (recognizer, lambda: [*of_recognizer(), *of_pointing_poses()[-40:]], {}),
    "recognizer of poses": (recognizer, of_pointing_poses, {"pointing_from": "poses"}),
    "body_tracker": (body_tracker, of_body_tracker, {}),
    "action_tracker": (action_tracker, of_action_tracker, {}),
    "pose_detector": (pose_detector, of_pose_detector, {}),
    "rule_learner": (rule_learner, of_rule_learner, parameters("rule_learning", "rule_learner")),
    "relocator": (relocator, of_relocator, parameters("relocate_by_pointing", "relocator")),
    "synthesizer": (synthesizer, of_synthesizer, {"robot": ROBOT_FOLDER}),
    "reacher": (reacher, of_reacher, {"tasks": TASKS}),
    "arm_driver": (arm_driver, of_arm_driver, {"robot": ROBOT_FOLDER}),
    "operator": (operator, of_operator, {"arms_at_start": True}),
    "recorder": (recorder, of_recorder, {}),
}


def _config(node: str, folder: Path) -> Any:
    module, _, parameters = NODES[node]
    if node == "synthesizer":
        reaching_model().save(folder / "reaching.npz")
        parameters = {**parameters, "movement": {"file": folder / "reaching.npz"}}
    if node == "body_tracker":
        write_cameras(folder / "cameras.yaml", EYES)
        parameters = {"cameras": folder / "cameras.yaml"}
    if node == "action_tracker":
        parameters = drawn_arm.write_setup(folder, 2)
    return module.Config.model_validate(parameters)


def _faulty(sound: list[Event], protected: bool) -> list[tuple[str, Published]]:
    """Every fault of the richest message of each topic. Times that no clock has are for the bus to leave out."""
    richest: dict[str, Received] = {}
    for event in sound:
        if isinstance(event, Received):
            known = richest.get(event.topic.name)
            if known is None or event.message.ByteSize() > known.message.ByteSize():
                richest[event.topic.name] = event
    found = []
    for name, heard in richest.items():
        for number, (fault, bad) in enumerate(variants(heard.message)):
            if not protected and ("seconds=" in fault or "nanos=" in fault):
                continue
            if "id" in bad.DESCRIPTOR.fields_by_name and not fault.startswith(("id=", "empty")):
                bad.id = f"{bad.id}-{number}"  # the same id again would be answered, not judged
            found.append((f"{name} with {fault}", (heard.topic, bad)))
    return found


@pytest.mark.parametrize("protected", [True, False], ids=["as the bus hands them out", "without protection"])
@pytest.mark.parametrize("node", NODES)
def test_no_message_makes_a_node_fall_over(
    node: str, protected: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv(START_VARIABLE, "1")  # as the launcher does
    module, record, _ = NODES[node]
    sound = record()
    faulty = _faulty(sound, protected)
    bus, config = FaultyBus(sound, faulty, tmp_path, protected), _config(node, tmp_path)
    try:
        while bus.goes_on:  # a node may end, as a rule learner does whose arm is disarmed; then it starts anew
            module.run(bus, config)
            (tmp_path / "recording.mcap").unlink(missing_ok=True)
    except Exception as error:
        raise AssertionError(f"after {bus.fault}: {type(error).__name__}: {error}") from error
    assert bus.fault == faulty[-1][0]
    assert bus.published or not module.PUBLISHES
    checked = {topic.name for topic in module.SUBSCRIBES if topic.has_checked_numbers}
    numbers = [fault for fault, _ in faulty if "=nan" in fault and fault.partition(" with ")[0] in checked]
    assert all(fault in bus.left_out for fault in numbers) or not protected


@pytest.mark.parametrize("node", NODES)
def test_every_message_that_a_node_hears_is_tried(node: str) -> None:
    module, record, _ = NODES[node]
    tried = {event.topic.name for event in record() if isinstance(event, Received)}
    assert {
        topic.name for topic in module.SUBSCRIBES
    } <= tried or node == "recorder"  # hears everything, looks at nothing
