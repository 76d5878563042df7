"""Several arms take turns: no arm begins a turn before all have ended the one before."""

from __future__ import annotations

import pytest

from paramove.applications.reach_task import ReachStep
from paramove.applications.turns import Turns
from paramove.documents.input_error import InputError
from paramove.msgs.relocation_pb2 import RelocationGoal, RelocationStatus
from paramove.msgs.safety_state_pb2 import SafetyFault, SafetyState

TICK_NS = 66_666_667
ARMED = SafetyState(state=SafetyState.STATE_ARMED)
REACH = ReachStep(reach=(0.2, 0.0, 0.1))
MOVE = ReachStep(pick=(0.2, 0.0, 0.02), place=(0.2, 0.1, 0.02))


class Cell:
    """Arms whose goals succeed at once, but those that are held back."""

    def __init__(self, turns: list[dict[str, ReachStep]], safety: SafetyState = ARMED) -> None:
        self.turns = Turns(turns, "turns-0")
        self.goals: list[tuple[str, RelocationGoal]] = []
        self.held: set[str] = set()
        self.refused: set[str] = set()
        self.now_ns = 0
        for arm in self.turns.arms:
            self.turns.on_safety(arm, safety)

    def tick(self, times: int = 1) -> Cell:
        for _ in range(times):
            self.now_ns += TICK_NS
            for arm, output in self.turns.tick(self.now_ns).items():
                for goal in output.goals:
                    self.goals.append((arm, goal))
                    if arm in self.held and not goal.plan_only:
                        continue
                    succeeded = RelocationStatus.STATE_SUCCEEDED
                    state = RelocationStatus.STATE_REJECTED if arm in self.refused else succeeded
                    status = RelocationStatus(goal_id=goal.id, state=state, reason="too far")
                    self.turns.on_goal_status(arm, status)
        return self

    @property
    def moves(self) -> list[tuple[str, str]]:
        """Arm and kind of each goal that moves it, once each."""
        known = {goal.id: (arm, goal) for arm, goal in self.goals if not goal.plan_only}
        return [(arm, RelocationGoal.Kind.Name(goal.kind).removeprefix("KIND_")) for arm, goal in known.values()]


def test_each_arm_does_its_task_and_goes_back_before_the_next_turn() -> None:
    cell = Cell([{"left": MOVE}, {"right": MOVE, "left": REACH}]).tick(200)
    assert cell.turns.finished
    assert cell.moves[:2] == [("left", "RELOCATE"), ("left", "REST")]
    assert sorted(cell.moves[2:]) == [
        ("left", "OFFER_HAND"),
        ("left", "REST"),
        ("right", "RELOCATE"),
        ("right", "REST"),
    ]
    assert len({goal.id for _, goal in cell.goals}) == 9, "three tasks, each planned, done and followed by the way back"


def test_an_arm_that_is_late_keeps_the_others_from_the_next_turn() -> None:
    cell = Cell([{"left": MOVE, "right": REACH}, {"right": MOVE}])
    cell.held = {"left"}
    cell.tick(100)
    assert [arm for arm, kind in cell.moves if kind == "RELOCATE"] == ["left"]
    assert "turn 1 of 2: left task 1 of 1, pick up" in cell.turns.detail


def test_a_task_that_fails_ends_the_turns_with_arm_and_reason() -> None:
    cell = Cell([{"left": MOVE}, {"right": MOVE}])
    cell.refused = {"left"}
    cell.tick(100)
    assert not cell.turns.finished
    assert "left: task 1 of 1" in cell.turns.failure
    assert "too far" in cell.turns.failure
    assert cell.moves == []


def test_an_arm_is_waited_for_until_it_is_armed() -> None:
    fault = SafetyFault(code="servo", detail="servo 3 does not respond")
    cell = Cell([{"left": MOVE}], SafetyState(state=SafetyState.STATE_DISARMED, faults=[fault])).tick(100)
    assert cell.moves == []
    assert "servo 3 does not respond" in cell.turns.detail
    cell.turns.on_safety("left", ARMED)
    cell.tick(100)
    assert [kind for _, kind in cell.moves] == ["RELOCATE", "REST"]


@pytest.mark.parametrize("turns", [[], [{}], [{"left": REACH}, {}]])
def test_turns_without_a_task_are_rejected(turns: list[dict[str, ReachStep]]) -> None:
    with pytest.raises(InputError, match="expected turns"):
        Turns(turns, "x")
