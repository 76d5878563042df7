"""Table of the nodes, from their statuses."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from paramove.bus import Bus, topics
from paramove.msgs.node_status_pb2 import NodeStatus


def subscribe_to_nodes(bus: Bus) -> None:
    """Subscribes to the status of every node that has published one in the bus's folder."""
    for path in bus.settings.folder.glob("status.*"):
        if path.suffix != ".lock":
            bus.subscribe(topics.status(path.name.removeprefix("status.")))


@dataclass
class _Node:
    status: NodeStatus
    received_s: float
    restarts: int = 0
    processing_ms: float | None = None  # mean of the messages between its last two statuses


class NodeTable:
    """Latest status of each node. Times are of the monotonic wall clock, s."""

    def __init__(self) -> None:
        self._nodes: dict[str, _Node] = {}

    def handle(self, status: NodeStatus, now_s: float) -> None:
        """Handles a node's status; a new process id means that it was restarted."""
        before = self._nodes.get(status.node)
        node = _Node(status, now_s)
        if before is not None:
            node.restarts = before.restarts + (status.pid != before.status.pid)
            node.processing_ms = before.processing_ms
            handled = status.processed - before.status.processed
            if status.pid == before.status.pid and handled > 0:
                node.processing_ms = 1e3 * (status.processing_seconds - before.status.processing_seconds) / handled
        self._nodes[status.node] = node

    def section(self, now_s: float) -> list[dict[str, Any]]:
        """One row for each node that has ever published its status, by name."""
        return [
            {
                "name": name,
                "state": NodeStatus.State.Name(node.status.state).removeprefix("STATE_").lower(),
                "sentence": node.status.detail,
                "ms": None if node.processing_ms is None else round(node.processing_ms, 1),
                "lost": sum(count.lost for count in node.status.received),
                "restarts": node.restarts,
                "silent_s": round(now_s - node.received_s),
            }
            for name, node in sorted(self._nodes.items())
        ]
