"""The physics of the world: frictions, what holds what, the robot's own contacts, and states that are not finite."""

from __future__ import annotations

import mujoco
import numpy as np
import pytest
from numpy.testing import assert_allclose

from paramove.robots.description import RobotDescription
from paramove.robots.hoap3.firmware import Firmware
from sim import places, scene, tool_box
from sim.world import OPENINGS_UP, SimulationError, World, hand_quaternion


def _run(world: World, seconds: float, counts: np.ndarray | None = None) -> None:
    firmware = Firmware(world.description)
    if counts is None:
        counts = world.description.units.to_counts(world.description.base_pose)
    for _ in range(round(1000 * seconds)):
        world.apply(firmware.step(counts, world.joint_positions(), world.joint_velocities()))
        world.step()


def test_friction_between_table_and_object_really_is_a_quarter(world: World) -> None:
    """MuJoCo takes the larger of two frictions, here 0.3, unless one side has priority."""
    world.place("yellow", tool_box.standing_centre(0.185, 0.0))
    _run(world, 0.02)
    found = {"table": [], "box": []}
    for contact in world.data.contact:
        names = {world.model.geom(int(geom)).name for geom in contact.geom}
        if names & set(tool_box.COLOURS):
            found["table" if "table" in names else "box"].append(contact)
    for contacts in found.values():
        assert contacts
        for contact in contacts:
            assert_allclose(contact.friction[:2], 0.25, rtol=0, atol=1e-12)
            assert contact.dim == 4
            assert_allclose(contact.solref, (0.002, 1.0), rtol=0, atol=1e-12)
            assert_allclose(contact.solimp[:3], (0.99, 0.999, 0.0003), rtol=0, atol=1e-12)


def test_a_pushed_cylinder_slides_rather_than_topples(world: World) -> None:
    """It topples only if pushed above r / friction = 40 mm."""
    world.place("green", tool_box.standing_centre(0.185, 0.0))
    _run(world, 0.05)
    body = world.model.body("green").id
    weight = tool_box.CYLINDER_MASS * 9.81
    world.data.xfrc_applied[body, :3] = (0.0, 0.30 * weight, 0.0)
    height = 0.010  # of the push over the centre: 35 mm above the ground
    world.data.xfrc_applied[body, 3:] = (-0.30 * weight * height, 0.0, 0.0)
    _run(world, 0.15)
    assert world.position("green")[1] > 0.003
    assert world.axis("green")[2] > 0.99


def test_no_constraint_ties_the_robot_to_anything(world: World) -> None:
    model = world.model
    torso = model.body("torso").id
    assert model.neq == 3
    for equality in range(model.neq):
        assert model.eq_type[equality] == mujoco.mjtEq.mjEQ_WELD
        ends = {model.body(int(model.eq_obj1id[equality])).name, model.body(int(model.eq_obj2id[equality])).name}
        assert scene.HAND in ends
        assert ends - {scene.HAND} < set(tool_box.COLOURS)
        assert model.body_rootid[model.eq_obj1id[equality]] != torso
        assert model.body_rootid[model.eq_obj2id[equality]] != torso
        assert not model.eq_active0[equality]


def test_fingers_are_no_stickier_than_allowed_and_the_hand_of_the_instructor_touches_nothing(world: World) -> None:
    model = world.model
    torso = model.body("torso").id
    of_robot = model.body_rootid[model.geom_bodyid] == torso
    assert model.geom_friction[of_robot, 0].max() <= 1.0
    for geom in range(model.ngeom):
        if str(model.geom(geom).name).startswith("hand_"):
            assert model.geom_contype[geom] == 0
            assert model.geom_conaffinity[geom] == 0


def test_options_are_those_of_the_grasp(world: World) -> None:
    option = world.model.opt
    assert option.timestep == 0.001
    assert option.cone == mujoco.mjtCone.mjCONE_ELLIPTIC
    assert option.impratio == 10.0
    assert option.integrator == mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    assert option.disableflags & mujoco.mjtDisableBit.mjDSBL_AUTORESET


def test_a_cylinder_falls_out_of_sight_through_an_opening(world: World) -> None:
    """3 mm beside the axis it still passes: 4 mm are free all around."""
    world.move_box(np.zeros(3), OPENINGS_UP)
    item = tool_box.OPENINGS[1]
    world.place("blue", item.centre + np.array((0.003, 0.0, tool_box.CYLINDER_HALF_HEIGHT + 0.002)))
    _run(world, 0.5)
    centre = world.position("blue")
    assert centre[2] + tool_box.CYLINDER_HALF_HEIGHT < tool_box.SURFACE_Z - 0.04
    assert np.hypot(centre[0] - item.x, centre[1] - item.y) < tool_box.OPENING_RADIUS


def test_the_closed_side_is_a_plane_at_the_same_height(world: World) -> None:
    world.place("blue", tool_box.standing_centre(tool_box.OPENINGS[1].x, tool_box.OPENINGS[1].y))
    _run(world, 0.3)
    assert_allclose(world.position("blue")[2], tool_box.SURFACE_Z + tool_box.CYLINDER_HALF_HEIGHT, rtol=0, atol=3e-4)


def test_the_robot_rests_without_touching_anything(world: World) -> None:
    _run(world, 0.5)
    assert world.contacts.unwanted == 0
    assert not world.contacts.present
    assert_allclose(world.joint_positions(), world.description.base_pose, rtol=0, atol=np.deg2rad(0.6))


def test_a_contact_of_the_robot_with_the_box_counts_once(world: World, description: RobotDescription) -> None:
    """The box is brought up under the resting right hand and taken away again, twice."""
    _run(world, 0.01)
    gripper, _ = world.gripper()
    into_hand = gripper - np.array((tool_box.CENTRE[0] - 0.08, tool_box.CENTRE[1], tool_box.CENTRE[2]))
    for expected in (1, 2):
        world.move_box(into_hand, (0.0, 1.0, 0.0, 0.0))
        _run(world, 0.004)
        assert world.contacts.unwanted >= expected
        world.move_box(np.array((0.0, 0.0, 2.0)), (0.0, 1.0, 0.0, 0.0))
        _run(world, 0.1)
    assert sum(world.contacts.unwanted_pairs.values()) == world.contacts.unwanted


def test_the_instructor_holds_and_lets_go(world: World) -> None:
    top = world.position("yellow") + np.array((0.0, 0.0, tool_box.CYLINDER_HALF_HEIGHT))
    backward = np.array((0.2, -0.5, 0.84))
    world.move_hand(top, backward)
    world.grasp("yellow")
    for step in range(400):
        world.move_hand(top + np.array((0.0, 0.0, 0.05 * step / 400)), backward)
        _run(world, 0.001)
    _run(world, 0.3)
    assert_allclose(world.position("yellow") - top, (0, 0, 0.05 - tool_box.CYLINDER_HALF_HEIGHT), rtol=0, atol=1e-3)
    assert world.last_touched_by["yellow"] == "instructor"
    world.release()
    _run(world, 0.2)
    assert world.position("yellow")[2] < top[2] - 0.02


@pytest.mark.parametrize(("what", "part"), [("qvel", "right_elbow"), ("qpos", "right_elbow"), ("ctrl", "right_elbow")])
def test_a_state_that_is_not_finite_stops_the_simulation_and_names_the_joint(
    world: World, what: str, part: str
) -> None:
    joint = world.model.joint(part)
    torques = np.zeros(world.description.n_joints)
    if what == "ctrl":
        torques[world.description.index(part)] = np.nan
    elif what == "qvel":
        world.data.qvel[joint.dofadr[0]] = np.nan
    else:
        world.data.qpos[joint.qposadr[0]] = np.nan
    world.apply(torques)
    with pytest.raises(SimulationError, match=part):
        world.step()


def test_parked_cylinders_stand_still(world: World) -> None:
    _run(world, 0.3)
    for colour, place in zip(tool_box.COLOURS, places.PARKED, strict=True):
        assert_allclose(world.position(colour), place, rtol=0, atol=3e-4)
        assert world.speed(colour) < 1e-3


def test_hand_points_along_its_backward_direction() -> None:
    backward = np.array((0.3, -0.6, 0.5))
    matrix = np.zeros(9)
    mujoco.mju_quat2Mat(matrix, np.array(hand_quaternion(backward)))
    axes = matrix.reshape(3, 3)
    assert_allclose(axes[:, 2], backward / np.linalg.norm(backward), rtol=0, atol=1e-12)
    assert axes[2, 0] > 0
    with pytest.raises(ValueError, match="vertical"):
        hand_quaternion(np.array((0.0, 0.0, 1.0)))
