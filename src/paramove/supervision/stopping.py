"""The order in which nodes are started and ended, and how they are ended."""

from __future__ import annotations

import time
from collections.abc import Callable

from paramove.supervision.launch_schema import LaunchFile

STOP_S = 5.0
"""From SIGTERM to SIGKILL."""
STOP_ALL_S = 10.0
"""For all waves together."""


def start_waves(file: LaunchFile) -> list[list[str]]:
    """Nodes in the order of their start: each wave needs only nodes of earlier waves.

    Nodes that wait for each other, which only an unchecked file has, are the last wave.
    """
    waves: list[list[str]] = []
    placed: set[str] = set()
    while len(placed) < len(file.nodes):
        left = [name for name in file.nodes if name not in placed]
        wave = [name for name in left if placed.issuperset(file.nodes[name].after)] or left
        waves.append(wave)
        placed.update(wave)
    return waves


def stop_waves(file: LaunchFile) -> list[list[str]]:
    """Nodes in the order of their end: those with `stop: first`, the others against their start, `stop: last`."""
    first = [name for name, node in file.nodes.items() if node.stop == "first"]
    last = [name for name, node in file.nodes.items() if node.stop == "last"]
    between = [[name for name in wave if name not in (*first, *last)] for wave in reversed(start_waves(file))]
    return [wave for wave in (first, *between, last) if wave]


def stop_in_waves(
    file: LaunchFile,
    *,
    is_running: Callable[[str], bool],
    stop: Callable[[str], None],
    kill: Callable[[str], None],
    wait: Callable[[], None],
) -> None:
    """Ends the nodes wave by wave; those that take longer than `STOP_S`, or all than `STOP_ALL_S`, are killed.

    Args:
        file: Has the order.
        is_running, stop, kill: Of the node with this name.
        wait: Waits a moment for nodes to end, and handles their ends.
    """
    end_s = time.monotonic() + STOP_ALL_S
    for wave in stop_waves(file):
        for name in wave:
            stop(name)
        wave_end_s = min(time.monotonic() + STOP_S, end_s)
        while any(map(is_running, wave)):
            if time.monotonic() > wave_end_s:
                for name in wave:
                    kill(name)
            wait()
