"""A list of tasks: done in order from wherever the arm is, rejected at the start or ended with the reason."""

from __future__ import annotations

import numpy as np
import pytest
from pydantic import ValidationError

from paramove.applications.reach_task import ReachStep, ReachTask
from paramove.documents.input_error import InputError
from paramove.msgs.joint_trajectory_pb2 import TrajectoryStatus
from paramove.msgs.relocation_pb2 import RelocationGoal, RelocationStatus
from paramove.msgs.rule_pb2 import Speech
from paramove.msgs.safety_state_pb2 import SafetyState
from tests.applications.servo_cell import STEPS, ServoCell
from tests.motion.servo_reaching import reaching


def test_plans_all_tasks_and_does_them_in_order() -> None:
    cell = ServoCell().run()
    assert cell.task.finished
    kinds = [(goal.kind, goal.plan_only) for goal in cell.goals]
    reach, relocate = RelocationGoal.KIND_OFFER_HAND, RelocationGoal.KIND_RELOCATE
    assert kinds == [
        (reach, True),
        (relocate, True),
        (reach, False),
        (relocate, False),
        (RelocationGoal.KIND_REST, False),
    ]
    assert [message.id for message in cell.sent] == ["reach-0-3/1", "reach-0-4/1", "reach-0-4/2"]
    phases = [[phase.name for phase in message.phases] for message in cell.sent]
    carried = ["carry", "place", "release", "withdraw", "retreat"]
    assert phases == [["reach"], ["approach", "lower", "grasp", "lift"], carried]
    assert list(cell.sent[0].joints) == list(cell.plan.arm.joints)
    first = cell.sent[1].points[0].position_rad
    np.testing.assert_allclose(first, cell.sent[0].points[-1].position_rad, rtol=0, atol=1e-12)
    speech = [one.text for one in cell.speech]
    assert speech[0] == "task 1 of 2, reach for (0.150, 0.050, 0.100) m"
    assert speech[1] == "task 2 of 2, pick up at (0.150, -0.050, 0.016) m and place at (0.120, 0.080, 0.016) m"
    assert speech[-1] == "all 2 tasks are done"


def test_goes_back_to_the_base_pose_at_the_end() -> None:
    cell = ServoCell(steps=STEPS[:1]).run()
    assert [phase.name for phase in cell.sent[-1].phases] == ["retreat"]
    np.testing.assert_allclose(cell.sent[-1].points[-1].position_rad, cell.plan.base_angles, rtol=0, atol=1e-12)


def test_begins_where_the_arm_rests_and_not_before() -> None:
    start = reaching("koch_v1_1").reach((0.12, -0.1, 0.12)).angles[-1]
    cell = ServoCell("koch_v1_1", start=start)
    cell.disarm(SafetyState.STATE_DISARMED, "servo 3 does not respond")
    cell.tick(20)
    assert not cell.sent
    assert cell.task.detail == "waiting until a person arms the arm (paramove arm enable); servo 3 does not respond"
    for number in range(30):
        if number == 4:
            cell.safety = SafetyState(state=SafetyState.STATE_ARMED)
        cell.angles = cell.angles + np.deg2rad(0.2)
        cell.tick()
    assert not cell.sent
    assert "waits until the arm rests" in cell.synthesizer.detail
    rested = cell.angles
    cell.run()
    np.testing.assert_allclose(cell.sent[0].points[0].position_rad, rested, rtol=0, atol=1e-12)


def test_a_wait_that_takes_longer_is_spoken_and_again_for_another_reason() -> None:
    cell = ServoCell(steps=STEPS[:1])
    cell.disarm(SafetyState.STATE_DISARMED, "joint 2 is far")
    cell.tick(10)
    assert not cell.speech
    cell.tick(60)
    cell.disarm(SafetyState.STATE_DISARMED, "joint 3 is far")
    cell.tick(60)
    assert ["joint 2 is far" in one.text for one in cell.speech] == [True, False]
    assert "joint 3 is far" in cell.speech[1].text
    cell.safety = SafetyState(state=SafetyState.STATE_ARMED)
    assert cell.run().task.finished


def test_a_joint_a_little_outside_its_range_is_taken_in() -> None:
    start = reaching("koch_v1_1").base_angles.copy()
    start[1] = reaching("koch_v1_1").lower[1] - np.deg2rad(1.5)
    cell = ServoCell("koch_v1_1", start=start).run()
    assert cell.task.finished
    assert cell.sent[0].points[0].position_rad[1] == pytest.approx(reaching("koch_v1_1").lower[1], rel=0, abs=1e-12)


def test_a_joint_far_outside_its_range_ends_the_tasks_with_what_helps() -> None:
    start = reaching("koch_v1_1").base_angles.copy()
    start[1] = reaching("koch_v1_1").lower[1] - np.deg2rad(5.0)
    cell = ServoCell("koch_v1_1", start=start).run()
    assert not cell.sent
    assert "joint shoulder_lift stands 5.0 deg outside its range; disarm, move it by hand" in cell.task.failure


@pytest.mark.parametrize(
    ("state", "word"), [(TrajectoryStatus.STATE_STOPPED, "stopped"), (TrajectoryStatus.STATE_REJECTED, "rejected")]
)
def test_what_the_driver_stops_or_rejects_ends_the_tasks_with_its_reason(
    state: TrajectoryStatus.State, word: str
) -> None:
    cell = ServoCell()
    cell.answers, cell.reason = (TrajectoryStatus.STATE_ACCEPTED, state), "joint joint2 is too fast"
    cell.run()
    assert len(cell.sent) == 1
    for part in ("task 1 of 2", "(0.150, 0.050, 0.100) m", f"driver {word} the motion", "joint joint2 is too fast"):
        assert part in cell.task.failure
    assert cell.speech[-1].text == cell.task.failure
    assert cell.speech[-1].request == Speech.REQUEST_HELP
    cell.tick(20)
    assert len(cell.sent) == 1


def test_nothing_in_the_gripper_ends_the_tasks() -> None:
    cell = ServoCell()
    cell.graspable = False
    cell.run()
    assert "task 2 of 2" in cell.task.failure
    assert "felt nothing" in cell.task.failure
    np.testing.assert_allclose(cell.angles, cell.plan.base_angles, rtol=0, atol=1e-9)


@pytest.mark.parametrize("state", [SafetyState.STATE_HOLD, SafetyState.STATE_DISCONNECTED])
def test_an_arm_that_is_no_longer_armed_ends_the_tasks_with_the_reason(state: SafetyState.State) -> None:
    cell = ServoCell()
    cell.answers = (TrajectoryStatus.STATE_ACCEPTED,)
    while not cell.sent:
        cell.tick()
    cell.disarm(state, "servo 12 (joint2) is too hot")
    cell.run()
    assert "the arm is no longer armed" in cell.task.failure
    assert "servo 12 (joint2) is too hot" in cell.task.failure


def test_statuses_of_other_goals_change_nothing() -> None:
    cell = ServoCell()
    cell.answers = ()
    while not cell.sent:
        cell.tick()
    cell.task.on_goal_status(RelocationStatus(goal_id="x", state=RelocationStatus.STATE_FAILED))
    cell.tick()
    assert not cell.task.failure
    assert cell.task.detail.startswith("task 1 of 2")


def test_a_task_out_of_reach_is_rejected_before_the_arm_moves() -> None:
    cell = ServoCell(steps=(*STEPS, ReachStep(reach=(0.6, 0.0, 0.1)))).run()
    assert not cell.sent
    for part in ("task 3 of 3", "(0.600, 0.000, 0.100) m", "the nearest position that can be reached is"):
        assert part in cell.task.failure
    with pytest.raises(InputError, match="no tasks"):
        ReachTask((), "reach-0")


@pytest.mark.parametrize(
    "step",
    [
        {},
        {"pick": [0.1, 0.0, 0.1]},
        {"reach": [0.1, 0.0, 0.1], "place": [0.1, 0.0, 0.1]},
        {"reach": [0.1, 0.0]},
        {"reach": [0.1, 0.0, float("nan")]},
        {"throw": [0.1, 0.0, 0.1]},
        {"reach": [1e308, 0.0, 0.1]},
        {"pick": [0.1, 0.0, 0.1], "place": [0.1, -2.1, 0.1]},
    ],
)
def test_what_is_no_task_is_refused(step: dict[str, list[float]]) -> None:
    with pytest.raises(ValidationError, match=r"expected \{reach|required|finite|Extra inputs|each from -2 to 2"):
        ReachStep.model_validate(step)
