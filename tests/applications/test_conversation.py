"""Goals and their attempts."""

from __future__ import annotations

from paramove.applications.conversation import GoalClient, OutgoingMessages
from paramove.msgs.relocation_pb2 import RelocationGoal, RelocationStatus
from paramove.objects.object_shape import ObjectShape


def _sent(client: GoalClient, name: str, attempt: int, state: RelocationStatus.State, height: float = 0.0) -> int:
    """The attempt that a goal has on its way to the arm, which answers with this state."""
    outgoing = OutgoingMessages()
    client.start(RelocationGoal.KIND_RELOCATE, 0.0, name, attempt=attempt, shape=ObjectShape(0.0, height))
    client.step(0.0, outgoing)
    (goal,) = outgoing.goals
    client.on_status(RelocationStatus(goal_id=goal.id, state=state))
    return goal.attempt


def test_an_object_is_grasped_first_in_the_way_that_worked_last() -> None:
    client = GoalClient("arm_base", 0.036, "run")
    failed, succeeded = RelocationStatus.STATE_FAILED, RelocationStatus.STATE_SUCCEEDED
    assert [_sent(client, "cube", 1, failed), _sent(client, "cube", 2, succeeded)] == [1, 2]
    assert [_sent(client, "cube", 1, succeeded), _sent(client, "cube", 2, failed)] == [2, 3]
    assert _sent(client, "other", 1, succeeded) == 1
    assert _sent(client, "cube", 1, failed, height=0.02) == 1, "its height decides"
    assert [_sent(client, "cube", 1, failed), _sent(client, "cube", 2, succeeded)] == [2, 3]
    assert _sent(client, "cube", 1, succeeded) == 1
    assert (client.grasps, client.retries) == (9, 3), "a first try is no retry, whichever way it goes"
