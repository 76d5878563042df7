"""An emulated arm is led by hand to places; a model of the segments leads to a place that was not shown."""

import itertools
import select

import numpy as np
import pytest
from typer.testing import CliRunner

from dynamixel_emulator.emulator import DynamixelEmulator
from dynamixel_emulator.servo import EmulatedServo
from paramove.cli.main import build
from paramove.demonstrations import DemonstrationError, DemonstrationSet
from paramove.demonstrations.kinesthetic_teaching import KinestheticTeacher
from paramove.demonstrations.movement import TARGET_NAMES
from paramove.demonstrations.taught_set import moved_part
from paramove.motion.reaching_file import load_reaching_model
from paramove.motion.servo_arm_reaching import ServoArmReaching
from paramove.motion.timing import minimum_jerk
from paramove.robots.description import RobotDescription
from paramove.robots.dynamixel.arm.gravity_compensated_arm import TorqueOffArm
from paramove.robots.dynamixel.bus.servo_chain import ServoChain
from paramove.robots.dynamixel.bus.servo_port import ServoPort
from paramove.training.examples import examples_of
from paramove.training.kinds import untrained
from paramove.training.training import train
from tests.robots.dynamixel.koch_arm import KOCH

ROBOT = RobotDescription.load(KOCH.parent / "open_manipulator_x")
CHAIN = ROBOT.chain
CORNERS = [np.array(place) for place in itertools.product((0.16, 0.24), (-0.1, 0.1), (0.06, 0.14))]
TARGETS = [*CORNERS, np.array([0.2, 0.0, 0.1])]
HELD_OUT = np.array([0.19, 0.05, 0.085])
FRAMES, PERIOD_NS = 30, 20_000_000


def way(target):
    """Angles of all joints on the way to a place, as hands lead the arm, with a rest before and after, [T, J]."""
    arm = CHAIN.kinematics
    begin = ROBOT.base_pose
    end = begin.copy()
    end[CHAIN.indices] = arm.joint_angles(target, arm.nearest_pitch(target, np.deg2rad(60.0)))
    share = minimum_jerk(np.linspace(0.0, 1.0, FRAMES))[:, None]
    moving = begin + share * (end - begin)
    return np.concatenate([np.repeat(moving[:1], 5, axis=0), moving, np.repeat(moving[-1:], 5, axis=0)])


class Hands:
    """Lead an emulated arm; its clock is counted."""

    def __init__(self, emulator, torque_off):
        self.emulator, self.torque_off, self.now_ns = emulator, torque_off, 0

    def lead(self, teacher, rows):
        for row in rows:
            with self.emulator.lock:
                for servo, count in zip(self.emulator.bus.servos, ROBOT.units.to_counts(row), strict=True):
                    servo.turned(float(count))
            while (measured := self.torque_off.measured()) is None:
                select.select([], [], [], 0.005)  # nobody turns a joint in no time: it is believed after a while
            _, angles = measured
            self.now_ns += PERIOD_NS
            teacher.handle(self.now_ns, angles)

    def teach(self, teacher, target):
        self.lead(teacher, way(target)[:1])
        teacher.begin()
        self.lead(teacher, way(target))
        return teacher.end()


@pytest.fixture(scope="module")
def hands(tmp_path_factory):
    link = tmp_path_factory.mktemp("port") / "port"
    rate = ROBOT.bus.baud_rate
    servos = [EmulatedServo(motor, number, rate) for motor, number in zip(ROBOT.motors, ROBOT.servo_ids, strict=True)]
    with DynamixelEmulator(servos, link) as emulator, ServoPort(str(link), rate, latency_s=0.1) as port:
        torque_off = TorqueOffArm(ServoChain(port), ROBOT)
        torque_off.release()
        yield Hands(emulator, torque_off)


@pytest.fixture(scope="module")
def taught(hands, tmp_path_factory):
    """A set of nine segments."""
    folder = tmp_path_factory.mktemp("sets") / "taught"
    teacher = KinestheticTeacher(ROBOT, folder, "reaching", "ann")
    for target in TARGETS:
        np.testing.assert_allclose(hands.teach(teacher, target), target, rtol=0.0, atol=3e-3)
    return folder


@pytest.fixture(scope="module")
def model_file(taught):
    """A model of the set, as `paramove train` makes it."""
    examples = examples_of(DemonstrationSet.load(taught), action="reaching")
    make = {
        "reaching": lambda: untrained(
            "best", description=examples.description("reaching"), floor_deviation=examples.floor_deviation
        )
    }
    file = taught.with_name("reaching.npz")
    train(examples, make, file).write()
    return file


def test_a_set_of_all_segments_is_written(taught):
    shown = DemonstrationSet.load(taught)
    assert (len(shown), shown.actions, shown.subjects, shown.parameter_names) == (
        9,
        ("reaching",),
        ("ann",),
        TARGET_NAMES,
    )
    assert shown.frame == "arm_base"
    for movement, target in zip(shown, TARGETS, strict=True):
        np.testing.assert_allclose(movement.theta, target, rtol=0.0, atol=3e-3)
        hand = np.mean([movement.point(name) for name in ("knuckle", "index", "thumb")], axis=0)
        np.testing.assert_allclose(hand[-1], movement.theta, rtol=0.0, atol=1e-9)
        assert movement.duration < 1e-9 * PERIOD_NS * FRAMES, "the rests are cut off"


def test_a_model_of_them_leads_to_a_place_that_was_not_shown(model_file):
    model = load_reaching_model(model_file)
    points = model.synthesize(HELD_OUT, 60).reshape(60, -1, 3)
    end = points[-1, [model.description.point_names.index(name) for name in ("knuckle", "index", "thumb")]].mean(axis=0)
    assert np.linalg.norm(end - HELD_OUT) < 0.02


def test_the_arm_reaches_by_the_model_that_it_was_taught(model_file):
    motion = ServoArmReaching(ROBOT, load_reaching_model(model_file)).reach(HELD_OUT)
    np.testing.assert_allclose(motion.gripper[-1], HELD_OUT, rtol=0.0, atol=1e-3)


def test_the_newest_segments_are_dropped_one_by_one(hands, tmp_path):
    folder = tmp_path / "set"
    teacher = KinestheticTeacher(ROBOT, folder, "reaching")
    for target in TARGETS[:2]:
        hands.teach(teacher, target)
    assert teacher.taught.drop() == "taught_002.mcap"
    assert len(DemonstrationSet.load(folder)) == 1
    assert teacher.taught.drop() == "taught_001.mcap"
    assert list(folder.iterdir()) == []
    with pytest.raises(DemonstrationError, match="no segment of this session is left"):
        teacher.taught.drop()


def test_a_set_that_was_changed_meanwhile_is_left_alone(hands, tmp_path):
    teacher = KinestheticTeacher(ROBOT, tmp_path, "reaching")
    hands.teach(teacher, TARGETS[0])
    other = KinestheticTeacher(ROBOT, tmp_path, "reaching", append=True)
    hands.teach(other, TARGETS[1])
    with pytest.raises(DemonstrationError, match=r"labels.yaml was changed meanwhile; take taught_001.mcap out"):
        teacher.taught.drop()
    assert len(DemonstrationSet.load(tmp_path)) == 2


def test_nothing_is_written_over(hands, tmp_path):
    hands.teach(KinestheticTeacher(ROBOT, tmp_path, "reaching"), TARGETS[0])
    with pytest.raises(
        DemonstrationError, match="holds a demonstration set already; choose another folder, or --append"
    ):
        KinestheticTeacher(ROBOT, tmp_path, "reaching")
    more = KinestheticTeacher(ROBOT, tmp_path, "reaching", append=True)
    hands.teach(more, TARGETS[0])
    shown = DemonstrationSet.load(tmp_path)
    assert [movement.recording for movement in shown] == ["taught_001.mcap", "taught_002.mcap"]


def test_a_set_with_other_parameters_is_refused(tmp_path):
    (tmp_path / "labels.yaml").write_text("version: 1\nparameters: [u, v]\nsegments: []\n")
    with pytest.raises(DemonstrationError, match=r"has the parameters \(u, v\), teaching gives \(target_x, "):
        KinestheticTeacher(ROBOT, tmp_path, "reaching", append=True)


def test_a_segment_without_a_movement_is_left_out(hands, tmp_path):
    teacher = KinestheticTeacher(ROBOT, tmp_path / "set", "reaching")
    with pytest.raises(DemonstrationError, match="no segment has begun"):
        teacher.end()
    teacher.begin()
    with pytest.raises(DemonstrationError, match="has no frames"):
        teacher.end()
    teacher.begin()
    hands.lead(teacher, way(TARGETS[0])[:5])
    with pytest.raises(DemonstrationError, match="moved by less than 2 mm"):
        teacher.end()
    assert not teacher.is_recording
    assert not (tmp_path / "set").exists()


def test_rests_are_no_part_of_a_movement():
    hand = np.zeros((20, 3))
    hand[5:15, 0] = np.linspace(0.0, 0.1, 10)
    hand[15:, 0] = 0.1
    assert moved_part(hand, 0.002) == (5, 15)


def test_the_commands_take_such_a_set(taught, tmp_path):
    file = tmp_path / "reaching.npz"
    done = CliRunner().invoke(build("train"), ["train", str(taught), "--leave-out", "none", "--out", str(file)])
    assert done.exit_code == 0, done.output
    assert load_reaching_model(file).description.action == "reaching"
    done = CliRunner().invoke(build("demos"), ["demos", "list", str(taught)])
    assert done.exit_code == 0, done.output
    assert "reaching" in done.stdout
