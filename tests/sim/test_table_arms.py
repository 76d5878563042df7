"""Arms at one table: one world, whose steps the servos of all of them share."""

from __future__ import annotations

from pathlib import Path

import mujoco
import numpy as np
import pytest

from paramove.documents.input_error import InputError
from sim.emulated_arm import EmulatedArm
from sim.table_arms import MountedArm, TableArms

ROOT = Path(__file__).parents[2]
SCENE = ROOT / "sim" / "tables" / "hand_over.xml"
KOCH = ROOT / "robot_description" / "koch_v1_1"
OPEN_MANIPULATOR = ROOT / "robot_description" / "open_manipulator_x"
PORT = Path("by-id/port")
TWO = {"left": MountedArm(robot=KOCH), "right": MountedArm(robot=OPEN_MANIPULATOR, x=0.38, yaw_deg=180.0)}


@pytest.fixture
def table(tmp_path: Path) -> TableArms:
    return TableArms(SCENE, TWO, tmp_path, PORT)


def at_rest(table: TableArms) -> tuple[EmulatedArm, EmulatedArm]:
    """Both arms, whose time no longer runs by itself."""
    with table:
        pass  # only the buses are used, at simulated times
    return table._arms["left"], table._arms["right"]


def test_the_servos_of_all_arms_and_the_world_step_together(table: TableArms) -> None:
    left, right = at_rest(table)
    begun_s = table.data.time
    left.emulator.bus.run_to(left.emulator.bus.now_s + 0.5005)
    assert table.data.time - begun_s == pytest.approx(0.5, abs=1e-9)
    assert right.emulator.bus.now_s == pytest.approx(left.emulator.bus.now_s, abs=1e-6)
    for arm in (left, right):
        angles = arm.mechanics.angles(arm._joint_names)
        assert np.abs(np.array(angles) - arm.robot.base_pose).max() < 0.2, "each is held by its own servos"


def test_an_arm_moves_by_its_own_servos_alone(table: TableArms) -> None:
    left, right = at_rest(table)
    left.emulator.bus.run_to(left.emulator.bus.now_s + 0.5)
    before = [np.array(arm.mechanics.angles(arm._joint_names)) for arm in (left, right)]
    right.emulator.bus.servos[0].memory["Goal Position"] += 200
    left.emulator.bus.run_to(left.emulator.bus.now_s + 1.0)
    after = [np.array(arm.mechanics.angles(arm._joint_names)) for arm in (left, right)]
    moved = [now - was for now, was in zip(after, before, strict=True)]
    assert abs(moved[1][0]) == pytest.approx(200 * np.pi / 2048, abs=0.1)
    assert np.abs(moved[0]).max() < 0.02


def test_the_truth_of_an_arm_is_in_the_frame_of_its_base(table: TableArms) -> None:
    with table:
        truths = dict(table.truths(7))
        site = table.data.site("right_end_effector").xpos.copy()
    assert {name: state.time_ns for name, state in truths.items()} == {"left": 7, "right": 7}
    left, right = ({body.name: (body.x, body.y, body.z) for body in truths[name].objects} for name in TWO)
    assert left["red_cube"] == pytest.approx((0.15, -0.06, 0.010), abs=1e-3)
    assert right["red_cube"] == pytest.approx((0.23, 0.06, 0.010), abs=1e-3)
    assert truths["right"].gripper[0] > 0.1, "it reaches forward"
    assert truths["right"].gripper == pytest.approx([0.38 - site[0], -site[1], site[2]], abs=1e-3)


def test_each_arm_has_a_port_in_the_folder_of_its_namespace(table: TableArms, tmp_path: Path) -> None:
    with table:
        assert (tmp_path / "left" / PORT).resolve() != (tmp_path / "right" / PORT).resolve()
        table.check()
        assert "koch_v1_1" in table.detail
        assert "open_manipulator_x" in table.detail
    assert not (tmp_path / "left" / PORT).exists()


def test_the_world_can_be_read_by_those_who_draw_it(table: TableArms, tmp_path: Path) -> None:
    table.write_model(tmp_path / "table.mjb")
    model = mujoco.MjModel.from_binary_path(str(tmp_path / "table.mjb"))
    assert model.joint("left_shoulder_pan").id >= 0
    assert model.joint("right_joint1").id >= 0


@pytest.mark.parametrize(
    ("scene", "robot", "message"),
    [
        ("no_such.xml", KOCH, "cannot be simulated"),
        (SCENE, ROOT / "robot_description" / "hoap3", "is not a servo arm"),
    ],
)
def test_what_cannot_be_simulated_is_rejected(tmp_path: Path, scene: Path, robot: Path, message: str) -> None:
    with pytest.raises(InputError, match=message):
        TableArms(tmp_path / scene, {"left": MountedArm(robot=robot)}, tmp_path, PORT)
