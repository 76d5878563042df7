"""The synthetic demonstrator: anatomy, natural variation, and the model trained on it."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose

from paramove.alignment import movement_distance, warp
from paramove.demonstrations import (
    POINT_NAMES,
    RESTING_SHOULDER,
    ArmLengths,
    Demonstrator,
    Variation,
    demonstrations_at,
    grasp_states,
    reaching_cuboid,
    table_targets,
    train_reaching_model,
)
from paramove.demonstrations.synthetic import COMFORTABLE_TARGET, Action
from paramove.hmm import LeftRightHMM, resample
from paramove.phmm import InterpolativePHMM

ROBOT_SCALE = 243.0 / 679.1
ARRIVAL, GRASP = 36, 44  # states 37 and 45 of 80, counted from 1 (thesis 5.2.5)
exact = Demonstrator(variation=Variation.none())


def points(movement: np.ndarray) -> dict[str, np.ndarray]:
    return dict(zip(POINT_NAMES, np.moveaxis(movement.reshape(-1, 7, 3), 1, 0), strict=True))


def gripper(movement: np.ndarray) -> np.ndarray:
    return movement.reshape(-1, 7, 3)[:, 4:].mean(axis=1)


@pytest.fixture(scope="module")
def model() -> InterpolativePHMM:
    return train_reaching_model(0)


@settings(max_examples=30, deadline=None, derandomize=True)
@given(
    st.floats(0, 1), st.floats(0, 1), st.floats(0, 1), st.sampled_from(["reaching", "pointing"]), st.integers(0, 999)
)
def test_segments_keep_their_lengths(u: float, v: float, w: float, action: Action, seed: int) -> None:
    person = Demonstrator(variation=Variation(sensor=0.0))
    target = reaching_cuboid().theta(np.array([u, v, w]))
    body = points(person.demonstrate(action, target, np.random.default_rng(seed)))
    lengths = ArmLengths()
    assert_allclose(np.linalg.norm(body["elbow"] - body["shoulder"], axis=1), lengths.upper_arm, rtol=0.0, atol=1e-9)
    assert_allclose(np.linalg.norm(body["wrist"] - body["elbow"], axis=1), lengths.forearm, rtol=0.0, atol=1e-9)
    assert np.isfinite(np.concatenate(list(body.values()))).all()


@pytest.mark.parametrize(("action", "tip"), [("reaching", gripper), ("pointing", lambda m: points(m)["index"])])
def test_the_exact_movement_reaches_its_target_and_returns(action: Action, tip: object) -> None:
    assert callable(tip)
    for target in table_targets(3, 3)[0]:
        movement = exact.demonstrate(action, target, np.random.default_rng(0))
        assert_allclose(tip(movement)[len(movement) // 2], target, rtol=0.0, atol=1e-9)
        assert_allclose(movement[0], movement[-1], rtol=0.0, atol=1e-9)


def test_speed_is_that_of_a_person() -> None:
    movement = exact.demonstrate("reaching", COMFORTABLE_TARGET, np.random.default_rng(0))
    speed = np.linalg.norm(np.diff(gripper(movement), axis=0), axis=1) * 60.0
    assert 0.5 < speed.max() < 2.0
    assert np.abs(np.diff(speed)).max() * 60.0 < 12.0  # m/s^2


def test_posture_at_the_table_is_natural() -> None:
    for target in reaching_cuboid().points()[[0, 2, 4, 6]]:  # the lower corners
        body = points(exact.demonstrate("reaching", target, np.random.default_rng(0)))
        middle = len(body["elbow"]) * 45 // 100
        forearm = body["wrist"][middle] - body["elbow"][middle]
        slope = np.degrees(np.arcsin(-forearm[2] / np.linalg.norm(forearm)))
        opening = body["thumb"][middle] - body["index"][middle]
        assert 3.0 < slope < 30.0
        assert abs(np.degrees(np.arcsin(opening[2] / np.linalg.norm(opening)))) < 5.0
        assert opening[1] > 0  # the thumb of the right hand is on the left
        assert target[2] < body["elbow"][middle][2] < body["shoulder"][middle][2]


def fingertip(movement: np.ndarray) -> np.ndarray:
    return points(movement)["index"]


def spread_at(target: np.ndarray, seed: int, count: int, action: Action) -> tuple[float, float, float]:
    shown = demonstrations_at(target, np.random.default_rng(seed), repetitions=count, action=action).sequences
    movements = [resample(one, 100) for one in shown]
    pairs = [movement_distance(movements[i], movements[j]) for i in range(count) for j in range(i)]
    tip = gripper if action == "reaching" else fingertip
    misses = [np.linalg.norm(tip(one)[45] - target) for one in movements]
    return float(np.mean(pairs)), float(np.std(pairs)), float(np.mean(misses))


@pytest.mark.parametrize("action", ["reaching", "pointing"])
def test_repetitions_vary_as_in_the_recordings(action: Action) -> None:
    mean, deviation, miss = spread_at(COMFORTABLE_TARGET, 5, 24, action)
    assert 0.018 < mean < 0.028  # 2.3 cm (thesis 4.2.4)
    assert 0.002 < deviation < 0.008  # 0.4 cm
    assert 0.006 < miss < 0.010  # 0.8 cm (thesis 4.2.5)
    targets = table_targets(2, 2)[0]
    corners = [spread_at(target, 6 + number, 16, action)[:2] for number, target in enumerate(targets)]
    worst, worst_deviation = max(corners)
    assert worst > mean
    assert 0.028 < worst < 0.045  # 3.5 cm
    assert 0.006 < worst_deviation < 0.020  # 1.3 cm


FROZEN = {  # x of the elbow, wrist, knuckle, index finger and thumb in frame 60; sum of all coordinates
    "reaching": ([-0.31081097, -0.07634474, 0.01766906, 0.10109456, 0.05107289], -357.66940977538695),
    "pointing": ([-0.34581766, -0.10859569, -0.02107725, 0.05925606, -0.02328098], -376.39078680802714),
}


@pytest.mark.parametrize("action", ["reaching", "pointing"])
def test_movements_are_those_that_every_evaluation_used(action: Action) -> None:
    movement = Demonstrator().demonstrate(action, COMFORTABLE_TARGET, np.random.default_rng(1))
    frame, total = FROZEN[action]
    assert movement.shape == (197, 21)
    assert_allclose(movement[60, [6, 9, 12, 15, 18]], frame, rtol=0.0, atol=1e-8)
    assert_allclose(movement.sum(), total, rtol=1e-10, atol=0.0)


def test_the_same_seed_gives_the_same_movement() -> None:
    first, second = (Demonstrator().demonstrate("reaching", COMFORTABLE_TARGET, np.random.default_rng(3)) for _ in "ab")
    assert_allclose(first, second, rtol=0.0, atol=0.0)


def test_targets_out_of_reach_are_refused() -> None:
    with pytest.raises(ValueError, match=r"a target is a point 0\.2 to 0\.85 m from the resting shoulder"):
        Demonstrator().demonstrate("reaching", [2.0, 0.0, 0.0], np.random.default_rng(0))


def test_arm_lengths_of_the_trained_model_are_the_demonstrators(model: InterpolativePHMM) -> None:
    poses = model.means_.reshape(-1, 7, 3)
    upper = np.linalg.norm(poses[:, 2] - poses[:, 1].mean(axis=0), axis=1)
    lower = np.linalg.norm(poses[:, 4:].mean(axis=1) - poses[:, 2], axis=1)
    assert_allclose((upper + lower).max(), 0.6791, rtol=0.0, atol=0.012)  # l' of thesis 5.2.3
    assert_allclose(upper.max(), 0.2778, rtol=0.0, atol=0.008)  # a'
    assert_allclose(lower.max(), 0.4082, rtol=0.0, atol=0.002)  # b'


def test_arrival_and_grasp_are_in_the_same_states_at_all_corners(model: InterpolativePHMM) -> None:
    assert grasp_states(model.means_) == (ARRIVAL, GRASP)
    assert model.description is not None
    assert_allclose(model.description.arrival * 79, ARRIVAL, rtol=1e-12, atol=0.0)
    assert_allclose(model.description.grasp * 79, GRASP, rtol=1e-12, atol=0.0)
    for number, target in enumerate(model.grid_.points()):
        error = np.linalg.norm(gripper(model.means_[number])[ARRIVAL : GRASP + 1] - target, axis=1)
        assert error.max() * ROBOT_SCALE < 0.002


@pytest.mark.parametrize("place", [(0.5, 0.5, 0.0), (0.5, 1.0, 0.0)])
def test_synthesis_agrees_with_a_separately_trained_reference(
    model: InterpolativePHMM, place: tuple[float, float, float]
) -> None:
    target = model.grid_.theta(np.array(place))
    shown = demonstrations_at(target, np.random.default_rng(11)).sequences
    reference = gripper(LeftRightHMM(80, 2, 3).fit([resample(one, 200) for one in shown]).means_)
    path = gripper(model.state_means(target))
    assert np.linalg.norm(path[ARRIVAL] - target) * ROBOT_SCALE < 0.002
    assert np.linalg.norm(path[ARRIVAL] - reference[ARRIVAL]) * ROBOT_SCALE < 0.002
    alignment = warp(path, reference, "B")
    kept = (alignment.first >= 19) & (alignment.first < 60)
    error = np.linalg.norm(path[alignment.first] - reference[alignment.second], axis=1)[kept]
    assert error.max() * ROBOT_SCALE < 0.012


def test_cuboid_holds_what_the_scaled_arm_can_reach_of_the_robots_working_area(model: InterpolativePHMM) -> None:
    shoulder = model.means_.reshape(-1, 7, 3)[:, 1].mean(axis=0)
    assert np.linalg.norm(shoulder - RESTING_SHOULDER) < 0.02
    for place in ((0.12, -0.12, -0.10), (0.12, 0.08, -0.10), (0.12, -0.12, -0.06), (0.175, 0.08, -0.10)):
        inside = model.grid_.coordinates(shoulder + np.array(place) / ROBOT_SCALE)
        assert ((inside > -0.02) & (inside < 1.02)).all()


def test_cached_model_is_read_back(model: InterpolativePHMM, tmp_path: Path) -> None:
    file = tmp_path / "reaching.npz"
    model.save(file)
    written = file.stat().st_mtime_ns
    again = train_reaching_model(0, cache=file)
    assert_allclose(again.means_, model.means_, rtol=0.0, atol=0.0)
    assert again.description == model.description
    assert file.stat().st_mtime_ns == written
    other = train_reaching_model(1, cache=file)
    assert other.description is not None
    assert "seed 1" in other.description.source
    assert InterpolativePHMM.load(file).description == other.description
