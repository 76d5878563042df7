"""The order in which nodes are ended."""

from __future__ import annotations

from paramove.supervision.launch_file import start_waves
from paramove.supervision.launch_schema import LaunchFile

STOP_S = 5.0
"""From SIGTERM to SIGKILL."""


def stop_waves(file: LaunchFile) -> list[list[str]]:
    """Nodes in the order of their end."""
    first = [name for name, node in file.nodes.items() if node.stop == "first"]
    last = [name for name, node in file.nodes.items() if node.stop == "last"]
    between = [[name for name in wave if name not in (*first, *last)] for wave in reversed(start_waves(file))]
    return [wave for wave in (first, *between, last) if wave]
