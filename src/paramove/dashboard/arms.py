"""The arms of a run that are in namespaces: of each the state of its gate, and what it does."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from paramove.bus import Received, topics
from paramove.dashboard.estimates import Estimates
from paramove.msgs.safety_state_pb2 import SafetyState
from paramove.robots import AROUND_SERVO_ARM


def gate_section(message: SafetyState) -> dict[str, Any]:
    """State of a safety gate for the page."""
    return {
        "state": SafetyState.State.Name(message.state).removeprefix("STATE_").lower(),
        "faults": [{"joint": fault.joint, "sentence": fault.detail} for fault in message.faults],
        "refused": message.rejected_trajectories,
    }


class Arms:
    """Give it the messages of namespaces; `section` gives JSON values for the page."""

    def __init__(self) -> None:
        self._gates: dict[str, dict[str, Any]] = {}
        self._estimates: dict[str, Estimates] = {}

    def handle(self, namespace: str, name: str, received: Received) -> None:
        """Handles a message of a topic that is called `name` in its namespace."""
        if name == topics.ARM_SAFETY.name:
            self._gates[namespace] = gate_section(received.message)
            return
        if namespace not in self._estimates:
            self._estimates[namespace] = Estimates((AROUND_SERVO_ARM.x, AROUND_SERVO_ARM.y))
        estimates = self._estimates[namespace]
        handlers: dict[str, Callable[[Any, float], None]] = {
            topics.SPEECH.name: estimates.on_speech,
            topics.RELOCATION_GOAL.name: estimates.on_goal,
            topics.RELOCATION_STATUS.name: estimates.on_goal_status,
        }
        if name in handlers:
            handlers[name](received.message, 1e-9 * received.captured_ns)

    def section(self, now_s: float) -> list[dict[str, Any]]:
        """One row for each arm whose gate has published its state, by namespace."""
        rows = []
        for namespace, gate in sorted(self._gates.items()):
            sections = self._estimates[namespace].sections(now_s) if namespace in self._estimates else {}
            words = sections.get("words") or [{"sentence": ""}]
            row = {"name": namespace, "gate": gate, "goal": sections.get("goal", {}), "sentence": words[-1]["sentence"]}
            rows.append(row)
        return rows

    def gate(self) -> dict[str, Any]:
        """All gates in one: their common state, or the states, and the faults of all; empty without arms."""
        if not self._gates:
            return {}
        states = dict.fromkeys(gate["state"] for gate in self._gates.values())
        faults = [
            {**fault, "sentence": f"{namespace}: {fault['sentence']}"}
            for namespace, gate in sorted(self._gates.items())
            for fault in gate["faults"]
        ]
        return {
            "state": ", ".join(states),
            "faults": faults,
            "refused": sum(gate["refused"] for gate in self._gates.values()),
        }
