"""A run of a few seconds, written by hand: one object is placed for the calibration, one is put away."""

import json

import cv2
import numpy as np
from foxglove_schemas_protobuf.CompressedImage_pb2 import CompressedImage
from foxglove_schemas_protobuf.JointStates_pb2 import JointStates

from paramove.bus import topics
from paramove.motion.relocation import RelocationOptions
from paramove.msgs.gesture_pb2 import Gesture
from paramove.msgs.hoap3_wire_pb2 import Hoap3State
from paramove.msgs.joint_trajectory_pb2 import JointTrajectory, TrajectoryPhase, TrajectoryPoint, TrajectoryStatus
from paramove.msgs.plane_calibration_pb2 import PlaneCalibration
from paramove.msgs.relocation_pb2 import Position, RelocationGoal, RelocationStatus
from paramove.msgs.rule_pb2 import ApplicationStage, Rule, Rules, Speech
from paramove.msgs.tracked_objects_pb2 import TrackedObject, TrackedObjects
from paramove.msgs.truth_pb2 import TruthBody, TruthLayout, TruthState
from paramove.recording.writer import RecordingWriter

PERIOD_NS = 66_666_667
SHOULDER = np.array([-0.035, -0.11, 0.125])
SURFACE_Z = -0.134
MIDDLE_Z = SURFACE_Z + 0.025
GRASP_Z = -0.098
OPENINGS = {"opening_0": (0.135, -0.095), "opening_1": (0.135, 0.019)}
RULES = {"yellow": "opening_0", "green": "opening_1"}
INTRINSICS = (600.0, 600.0, 239.5, 179.5, 0.05)
BEGIN_S, GRASP_S, END_S = 2.0, 3.0, 8.0
"""The arm's motion begins, closes its hand; the application is done."""


def camera_from_world():
    """A camera 0.6 m above the middle of the working area that looks straight down, image up away from the robot."""
    rotation = np.array([[0.0, -1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, -1.0]])
    centre = SHOULDER + np.array([0.16, -0.01, SURFACE_Z + 0.6])
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = rotation, -rotation @ centre
    return matrix


def layout():
    message = TruthLayout(
        seed=42,
        world_from_shoulder=SHOULDER.tolist(),
        camera_from_world=camera_from_world().ravel().tolist(),
        camera_intrinsics=INTRINSICS,
        surface_z=SURFACE_Z + SHOULDER[2],
    )
    for name, (x, y) in OPENINGS.items():
        message.openings.add(name=name, x=x + SHOULDER[0], y=y + SHOULDER[1], radius=0.014)
    for name, opening in RULES.items():
        message.rules.add(object=name, opening=opening)
    return message


class SyntheticRun:
    """Writes the files of a run into `folder`.

    Args:
        robot: Its description; the arm holds one pose all the time, and the goal lies where that pose's gripper is.
        gripper_off: How far the gripper in the world is from the commanded one, [3], m.
        calibration_off: Added to what the homography gives, (x, y), m.
        lost: Sequence numbers that the recorder did not get of `objects/tracked`.
        view: Whether images are recorded.
    """

    def __init__(self, folder, robot, gripper_off=(0, 0, 0), calibration_off=(0, 0), lost=(), view=False):
        self.folder, self.robot = folder, robot
        self.gripper_off, self.calibration_off = np.array(gripper_off), np.array(calibration_off)
        self.lost, self.view = set(lost), view
        self.arm = robot.arms["right"]
        self.angles = np.deg2rad([20.0, -40.0, 30.0, -70.0, 10.0])
        pose = robot.base_pose.copy()
        pose[self.arm.indices] = self.angles
        self.counts = robot.units.to_counts(pose)
        points = self.arm.kinematics.forward(robot.units.to_radians(self.counts)[self.arm.indices])
        self.gripper, self.elbow = points.gripper, points.elbow
        forward = (self.gripper - self.elbow) * [1, 1, 0]
        forward /= np.linalg.norm(forward)
        self.source = self.gripper - RelocationOptions().grasp_aside * np.array([forward[1], -forward[0], 0])
        self.n_states = 1 + int(END_S * 1e9 / PERIOD_NS)

    def write(self, after_end=0):
        """Write recording, truth and verdict; `after_end` more periods are recorded after the application was done."""
        with RecordingWriter(self.folder / "truth.mcap", "test") as truth:
            truth.write("truth/layout", layout(), 0, 0, 1)
            for number in range(self.n_states + after_end):
                now = number * PERIOD_NS
                truth.write("truth/state", self._state(number), now, now, number + 1)
                if self.view:
                    truth.write("truth/view", self._image(90), now, now, number + 1)
        with RecordingWriter(self.folder / "recording.mcap", "test") as recording:
            said = sorted(self._said(after_end), key=lambda item: item[1])
            sequence = {}
            for topic, time_ns, message in said:
                sequence[topic] = sequence.get(topic, 0) + 1
                if topic is not topics.OBJECTS_TRACKED or sequence[topic] not in self.lost:
                    recording.write(topic.name, message, time_ns, time_ns, sequence[topic])
        objects = {
            name: {"opening": own, "rests_in": own, "at_rest": True, "last_touched_by": "robot", "success": True}
            for name, own in RULES.items()
        }
        verdict = {"success": True, "placed": 2, "objects": objects, "realtime_factor": 2.5 + after_end}
        (self.folder / "truth.json").write_text(json.dumps(verdict))
        return self.folder

    def _state(self, number):
        message = TruthState(
            time_ns=number * PERIOD_NS,
            gripper=(self.gripper + self.gripper_off + SHOULDER).tolist(),
            gripper_commanded=(self.gripper + SHOULDER).tolist(),
            unwanted_contacts=int(number > 50),
            deepest_penetration_mm=min(0.002 * number, 0.2),
            contacts=["palm - box"] if number == 51 else [],
        )
        for name, (x, y) in {"yellow": (0.15, 0.0), "green": (0.18, 0.05)}.items():
            point = np.array([x, y, MIDDLE_Z]) + SHOULDER
            message.objects.append(
                TruthBody(name=name, x=point[0], y=point[1], z=point[2], quaternion_xyzw=(0, 0, 0, 1))
            )
        return message

    def _said(self, after_end):
        yield from self._regular(after_end)
        yield from self._goal()
        yield topics.CALIBRATION_PLANE, _ns(1.0), self._calibration()
        rule = Rule(object="yellow", x=0.135, y=-0.093, observations=1, text="yellow belongs there")
        yield topics.RULES, _ns(1.5), Rules(frame="right_shoulder", rules=[rule])
        for time_s, kind, x in ((1.6, Gesture.KIND_RESTED, 0.151), (1.8, Gesture.KIND_VANISHED, 0.3)):
            gesture = Gesture(kind=kind, object="yellow", located=True, x=x, y=0.0, frame="right_shoulder")
            gesture.captured.FromNanoseconds(_ns(time_s))
            yield topics.GESTURES, _ns(time_s), gesture
        for time_s, detail in ((0.0, "I begin."), (END_S, "Thank you!")):
            yield topics.SPEECH, _ns(time_s), Speech(text=detail)
        stages = ((0.0, "CALIBRATE"), (1.0, "LEARN"), (1.9, "APPLY"), (END_S, "DONE"))
        for time_s, name in stages:
            stage = ApplicationStage(stage=ApplicationStage.Stage.Value(f"STAGE_{name}"))
            yield topics.APPLICATION_STAGE, _ns(time_s), stage

    def _regular(self, after_end):
        for number in range(self.n_states + after_end):
            now = number * PERIOD_NS
            state = Hoap3State(target_counts=self.counts.tolist())
            state.captured.FromNanoseconds(now)
            yield topics.WIRE_HOAP3_STATE, now, state
            tracked = TrackedObjects()
            tracked.objects.add(name="yellow", kind=TrackedObject.KIND_OBJECT, left_px=200, top_px=-5, width_px=20)
            tracked.objects.add(name="hand", kind=TrackedObject.KIND_HAND, u_px=100, v_px=50)
            yield topics.OBJECTS_TRACKED, now, tracked
            joints = JointStates()
            for name, angle in zip(self.arm.joints, self.angles, strict=True):
                joints.joints.add(name=name, position=angle)
            yield topics.ARM_JOINT_STATES, now, joints
            if self.view:
                yield topics.CAMERA_IMAGE, now, self._image(120 + number % 3)

    def _goal(self):
        def position(point):
            return Position(x=point[0], y=point[1], z=point[2])

        goal = RelocationGoal(id="g-1", kind=RelocationGoal.KIND_RELOCATE, object="yellow", frame="right_shoulder")
        getattr(goal, "from").CopyFrom(position(self.source))
        goal.to.CopyFrom(position([0.135, -0.093, GRASP_Z]))
        goal.attempt = 1
        yield topics.RELOCATION_GOAL, _ns(BEGIN_S), goal
        yield topics.RELOCATION_GOAL, _ns(BEGIN_S + 0.5), goal  # sent again
        trajectory = JointTrajectory(id="g-1/1", joints=[*self.arm.joints, self.arm.fingers])
        for time_s in (0.0, 3.0):
            trajectory.points.append(TrajectoryPoint(time_s=time_s, position_rad=[*self.angles, 0.0]))
        for name, start in (("reach", 0.0), ("grasp", GRASP_S - BEGIN_S), ("lift", GRASP_S - BEGIN_S + 0.8)):
            trajectory.phases.append(TrajectoryPhase(name=name, start_s=start))
        yield topics.ARM_TRAJECTORY, _ns(BEGIN_S), trajectory
        for along_s, state in ((0.5, "EXECUTING"), (2.5, "EXECUTING"), (3.0, "SUCCEEDED")):
            status = TrajectoryStatus(trajectory_id="g-1/1", time_s=along_s, duration_s=3.0)
            status.state = TrajectoryStatus.State.Value(f"STATE_{state}")
            status.captured.FromNanoseconds(_ns(BEGIN_S + along_s))
            yield topics.ARM_TRAJECTORY_STATUS, _ns(BEGIN_S + along_s), status
        for time_s, state, phase, holding in (
            (2.1, "ACCEPTED", "", False),
            (3.1, "EXECUTING", "grasp", False),
            (4.5, "EXECUTING", "carry", True),
            (7.0, "SUCCEEDED", "retreat", False),
        ):
            value = RelocationStatus.State.Value(f"STATE_{state}")
            status = RelocationStatus(goal_id="g-1", state=value, phase=phase, holding=holding, elbow_turn_rad=0.1)
            status.from_hull, status.to_hull = RelocationStatus.HULL_INSIDE, RelocationStatus.HULL_OUTSIDE
            yield topics.RELOCATION_STATUS, _ns(time_s), status

    def _calibration(self):
        """The exact homography of a camera without distortion, moved by `calibration_off`."""
        from paramove.objects.homography import PlaneHomography
        from paramove.runs.rule_learning.accuracy import project

        plane = np.array([(0.135, -0.1), (0.135, 0.076), (0.19, 0.076), (0.19, -0.1)])
        height = np.full((4, 1), MIDDLE_Z)
        image = project(layout(), np.hstack([plane, height]) + SHOULDER)
        message = PlaneCalibration()
        message.CopyFrom(PlaneHomography.fit(image, plane + self.calibration_off, GRASP_Z).to_message())
        return message

    def _image(self, level):
        picture = np.full((360, 480, 3), level, dtype=np.uint8)
        return CompressedImage(data=cv2.imencode(".jpg", picture)[1].tobytes(), format="jpeg")


def _ns(time_s):
    return round(time_s * 1e9)
