"""Several arms that take turns: in each turn every arm with a task does it, and no arm begins the next one before."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from paramove.applications.conversation import OutgoingMessages
from paramove.applications.reach_task import ReachStep, ReachTask
from paramove.documents import InputError
from paramove.msgs.relocation_pb2 import RelocationStatus
from paramove.msgs.safety_state_pb2 import SafetyState


class Turns:
    """Pass received messages to the `on_…` methods, then call `tick`. Begins when the arms are armed.

    After its task an arm goes back to its base pose, out of the way of the others; then its part of the turn is done.
    No safety gate knows the other arms: that two of them never come near each other is up to who writes the turns.

    Args:
        turns: Of each turn, arm -> what it does, in the frame of its base.
        run_name: Prefix of the goals' ids; unique to the process.

    Raises:
        InputError: There are no turns, or one of them has no task.

    Attributes:
        arms: All that have a task.
        detail: What they do, as text.
        failure: Why they cannot go on; empty while they can.
        finished: Whether all is done.
    """

    def __init__(self, turns: Sequence[Mapping[str, ReachStep]], run_name: str) -> None:
        if not turns or not all(turns):
            raise InputError("expected turns such as [{left: {reach: [0.2, 0.0, 0.1]}}], each with a task; found none")
        self._turns, self._run_name = tuple(turns), run_name
        self.arms = tuple(dict.fromkeys(arm for turn in turns for arm in turn))
        self._safety: dict[str, SafetyState] = {}
        self._done = 0
        self._tasks = self._begun()
        self.detail = "waiting for the arms' drivers"
        self.failure = ""
        self.finished = False

    def on_goal_status(self, arm: str, status: RelocationStatus) -> None:
        """Follow the status of an arm's goal."""
        if arm in self._tasks:
            self._tasks[arm].on_goal_status(status)

    def on_safety(self, arm: str, message: SafetyState) -> None:
        """Store the state of an arm's safety gate."""
        self._safety[arm] = message
        if arm in self._tasks:
            self._tasks[arm].on_safety(message)

    def tick(self, now_ns: int) -> dict[str, OutgoingMessages]:
        """One tick; returns the messages to publish by arm."""
        output = {arm: task.tick(now_ns) for arm, task in self._tasks.items()}
        failures = [f"{arm}: {task.failure}" for arm, task in self._tasks.items() if task.failure]
        if failures:
            self.failure = "; ".join(failures)
        elif not self.finished and all(task.finished for task in self._tasks.values()):
            self._done += 1
            self.finished = self._done == len(self._turns)
            self._tasks = {} if self.finished else self._begun()
        if self._tasks:
            parts = ", ".join(f"{arm} {task.detail}" for arm, task in self._tasks.items())
            self.detail = f"turn {self._done + 1} of {len(self._turns)}: {parts}"
        return output

    def _begun(self) -> dict[str, ReachTask]:
        """Tasks of the present turn, which know the states of the gates."""
        name = f"{self._run_name}-{self._done + 1}"
        tasks = {arm: ReachTask([step], f"{name}-{arm}") for arm, step in self._turns[self._done].items()}
        for arm, task in tasks.items():
            if arm in self._safety:
                task.on_safety(self._safety[arm])
        return tasks
