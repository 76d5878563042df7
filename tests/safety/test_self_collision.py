"""Distances between a robot's parts, by its model."""

from __future__ import annotations

import mujoco
import numpy as np
import pytest

from paramove.documents.input_error import InputError
from paramove.safety.self_collision import SelfCollision
from tests.robots.hoap3.movements import HOAP3

ARM = """<mujoco><worldbody>
 <geom name="table" type="plane" size="0 0 1" pos="0 0 -0.5"/>
 <body name="base"><geom type="sphere" size="0.05"/>
  <body name="upper"><joint name="shoulder" type="hinge" axis="0 1 0"/>
   <geom type="capsule" size="0.02" contype="0" fromto="0.1 0 0 0.3 0 0"/>
   <body name="collar" pos="0.3 0 0"><geom type="sphere" size="0.03"/>
    <body name="fore"><joint name="elbow" type="hinge" axis="0 1 0"/>
   <geom type="capsule" size="0.02" fromto="0.1 0 0 0.3 0 0"/>
     <body name="hand" pos="0.3 0 0"><joint name="wrist" type="slide" axis="1 0 0"/>
      <geom type="sphere" size="0.02" conaffinity="0"/>
      <geom type="box" size="1 1 1" contype="0" conaffinity="0"/></body>
  </body></body></body></body>
 <body name="ring"><geom type="sphere" size="0.06" pos="0.1 0 0"/></body>
 <body name="wall" pos="-0.64 7 0"><geom type="plane" size="0 0 1" zaxis="1 0 0"/></body>
 <body name="loose"><freejoint name="free"/>
  <geom type="sphere" size="0.01" pos="5 5 5" contype="2" conaffinity="4"/></body>
</worldbody></mujoco>"""
MODEL = mujoco.MjModel.from_xml_string(ARM)
JOINTS = ("shoulder", "elbow", "wrist")
LOWER, UPPER = np.array([-3.0, -3.0, 0.0]), np.array([3.0, 3.0, 0.02])


def arm(free_pose: tuple[float, float, float] = (0.0, 0.0, 0.0)) -> SelfCollision:
    return SelfCollision(MODEL, JOINTS, np.array(free_pose), LOWER, UPPER)


def bodies(collision: SelfCollision) -> set[tuple[str, str]]:
    return {tuple(sorted(MODEL.body(MODEL.geom_bodyid[geom]).name for geom in pair)) for pair in collision.pairs}


def test_neighbours_welded_parts_and_what_always_touches_are_left_out() -> None:
    measured = bodies(arm())
    assert ("fore", "hand") not in measured, "neighbours"
    assert ("collar", "fore") not in measured, "welded to a neighbour"
    assert ("base", "ring") not in measured, "both fixed"
    assert ("hand", "upper") in measured
    assert ("fore", "ring") in measured
    assert ("hand", "world") in measured
    assert not any("loose" in pair for pair in measured), "not meant to collide"
    # The collar of this arm, 0.3 from the axis and fixed to the upper arm, never comes near the ring.
    assert ("fore", "upper") not in measured, "welded collar: upper and fore are neighbours"


def test_what_touches_in_a_free_pose_is_left_out() -> None:
    folded = (0.0, 3.0, 0.0)
    assert {("fore", "ring"), ("base", "hand")} <= bodies(arm())
    assert not {("fore", "ring"), ("base", "hand")} & bodies(arm(folded))


def test_the_distance_is_that_of_spheres_by_hand() -> None:
    collision = arm(free_pose=(0.0, 3.0, 0.0))
    for elbow in (3.0, 3.1, 3.2):
        hand = np.array([0.3 + 0.3 * np.cos(elbow), -0.3 * np.sin(elbow)])
        distance, one, other = collision.distances(np.array([0.0, elbow, 0.0]))
        assert {one, other} == {"hand", "ring"}
        np.testing.assert_allclose(distance, np.linalg.norm(hand - [0.1, 0.0]) - 0.08, rtol=0, atol=1e-6)
    assert arm().distances(np.array([0.0, 3.1, 0.0]))[0] < -0.01


def test_the_hand_over_the_table_is_measured_and_far_is_far() -> None:
    collision = arm()
    down = np.arcsin(0.45 / 0.6)
    distance, one, other = collision.distances(np.array([down, 0.0, 0.0]))
    np.testing.assert_allclose(distance, 0.03, rtol=0, atol=1e-6)
    assert "hand" in (one, other) or "fore" in (one, other)
    assert collision.distances(np.zeros(3)) == (0.05, "", "")


def test_a_wall_without_end_is_measured_too() -> None:
    distance, one, other = arm().distances(np.array([3.0, 0.0, 0.0]))
    assert "wall" in (one, other)  # to the hand as near as to the end of the forearm
    np.testing.assert_allclose(distance, 0.64 + 0.6 * np.cos(3.0) - 0.02, rtol=0, atol=1e-6)


def test_only_what_touches_in_every_random_pose_is_left_out() -> None:
    folded = np.array([0.0, 3.0, 0.0])
    assert ("fore", "ring") not in bodies(SelfCollision(MODEL, JOINTS, np.zeros(3), folded, folded, n_samples=3))
    for seed in range(40):
        some = SelfCollision(MODEL, JOINTS, np.zeros(3), LOWER, UPPER, n_samples=12, seed=seed)
        assert ("fore", "ring") in bodies(some)


def test_the_same_seed_leaves_out_the_same_pairs() -> None:
    def left(seed: int) -> list[list[int]]:
        return SelfCollision(MODEL, JOINTS, np.zeros(3), LOWER, UPPER, n_samples=1, seed=seed).pairs.tolist()

    found = [left(seed) for seed in range(40)]
    assert found == [left(seed) for seed in range(40)]
    assert any(pairs != found[0] for pairs in found), "by one pose, which the seed draws"


def test_a_joint_the_model_does_not_have_or_that_has_no_angle_is_named() -> None:
    with pytest.raises(InputError, match=r"'hip' is not in the model.*shoulder, elbow, wrist"):
        SelfCollision(MODEL, ("shoulder", "hip"), np.zeros(2), LOWER[:2], UPPER[:2])
    with pytest.raises(InputError, match=r"'free'.*no single angle; allowed: hinge, slide"):
        SelfCollision(MODEL, ("free",), np.zeros(1), LOWER[:1], UPPER[:1])


def test_hoap3_s_base_pose_is_free_and_an_arm_in_the_body_is_not() -> None:
    model = mujoco.MjModel.from_xml_path(str(HOAP3.model_path))
    collision = SelfCollision(model, HOAP3.joint_names, HOAP3.base_pose, HOAP3.lower, HOAP3.upper, n_samples=20)
    assert collision.distances(HOAP3.base_pose)[0] >= 0.005
    right = HOAP3.indices(HOAP3.arms["right"].joints)
    generator = np.random.default_rng(1)
    found = []
    for _ in range(60):
        pose = HOAP3.base_pose.copy()
        pose[right] = generator.uniform(HOAP3.lower[right], HOAP3.upper[right])
        found.append(collision.distances(pose))
    inside = [bodies for distance, *bodies in found if distance < 0.0]
    assert 1 <= len(inside) <= 20
    for pair in inside:
        assert any(body.startswith("right_") for body in pair)
