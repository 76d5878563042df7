"""One simulated person, and what is measured of the model."""

from pathlib import Path

import numpy as np

from paramove.demonstrations import DemonstrationSet
from paramove.motion.reaching_file import load_reaching_model
from paramove.motion.servo_arm_reaching import ServoArmReaching
from paramove.robots import RobotDescription
from paramove.training import examples_of, train, untrained
from studies.teaching.experiment import ACTION, along, cameras, run, taught
from studies.teaching.simulated_person import RATE_HZ, key_points, mean_path, movement

TARGET = np.array([0.2, 0.0, 0.0])
ROBOT = Path(__file__).parents[3] / "robot_description" / "koch_v1_1"


def test_two_cameras_reach_new_positions():
    found = run(2, 0)
    assert found["movements"] >= 8
    assert found["end"] < 2.0
    assert found["path"] < 6.0


def test_a_robot_executes_what_two_cameras_saw(tmp_path):
    folder, target = tmp_path / "set", np.array([0.18, 0.05, 0.08])
    taught(folder, 2, 0)
    examples = examples_of(DemonstrationSet.load(folder), action=ACTION, body=True)
    description, floor = examples.description(ACTION), examples.floor_deviation
    make = {ACTION: lambda: untrained("best", description=description, floor_deviation=floor)}
    train(examples, make, tmp_path / "body.npz").write()
    motion = ServoArmReaching(RobotDescription.load(ROBOT), load_reaching_model(tmp_path / "body.npz")).reach(target)
    np.testing.assert_allclose(motion.gripper[-1], target, rtol=0.0, atol=1e-3)


def test_a_path_is_compared_by_where_it_leads():
    path = mean_path(TARGET, 60)
    slow_at_the_end = np.concatenate([path, np.repeat(path[-1:], 40, axis=0)])
    np.testing.assert_allclose(along(slow_at_the_end), along(path), rtol=0.0, atol=1e-9)


def test_key_points_have_the_measured_noise():
    poses = movement(TARGET, np.random.default_rng(0))
    still = np.repeat(poses[:1], 3000, axis=0)
    found = key_points(still, cameras(1)[0], np.random.default_rng(1))
    hands = np.array([one.positions[0, 3] for one in found])
    near = np.linalg.norm(hands - np.median(hands, axis=0), axis=1) < 20.0
    assert 0.03 < 1.0 - near.mean() < 0.2, "outliers and exchanged sides"
    np.testing.assert_allclose(hands[near].std(axis=0), found[0].deviations[0, 3], rtol=0.15)
    assert RATE_HZ == 15.0
