"""Which nodes of a bus have to be connected before a node is ready.

A subscriber connects within 0.2 s of its publisher's start, so what a node published at its very start would reach
nobody. Every node therefore writes into the lock file of its status topic what it subscribes to and publishes. One that
starts reads the files of the nodes that are there, and waits until each of its subscribers has subscribed, and each of
its publishers has welcomed it; see `Exchange.connect`. Programs that only visit the bus have no status and are not
waited for.
"""

from __future__ import annotations

import os
from collections.abc import Iterable
from pathlib import Path
from typing import NamedTuple

CONNECT_TIMEOUT_S = 2.0
"""A node is ready after so long at most, with the nodes that are missing in its status."""
_PREFIX, _SUFFIX = "status.", ".lock"
_MAX_BYTES = 2**16


class NodeTopics(NamedTuple):
    """What a node that is running subscribes to and publishes, by names on the bus."""

    node: str
    subscribes: frozenset[str]
    publishes: frozenset[str]


def written(subscribes: Iterable[str], publishes: Iterable[str]) -> str:
    """The lines of a lock file after the one that names its holder."""
    return f"subscribes {' '.join(sorted(subscribes))}\npublishes {' '.join(sorted(publishes))}\n"


def running_nodes(folder: Path) -> list[NodeTopics]:
    """Nodes that hold the lock of their status and have written their topics."""
    locked = locked_inodes()
    found = []
    for path in sorted(folder.glob(f"{_PREFIX}*{_SUFFIX}")):
        try:
            if path.stat().st_ino not in locked:
                continue
            with path.open("rb") as file:
                lines = file.read(_MAX_BYTES).decode(errors="replace").splitlines()
        except OSError:  # it has just ended
            continue
        topics = dict(line.split(" ", 1) for line in lines[1:] if " " in line)
        if topics.keys() >= {"subscribes", "publishes"}:
            subscribes, publishes = (frozenset(topics[key].split()) for key in ("subscribes", "publishes"))
            node = path.name.removeprefix(_PREFIX).removesuffix(_SUFFIX)
            found.append(NodeTopics(node, subscribes, publishes))
    return found


def locked_inodes() -> frozenset[int]:
    """Inodes of the files that any process holds by `flock`, without touching a lock."""
    try:
        lines = Path("/proc/locks").read_text(encoding="ascii").splitlines()
    except OSError:
        return frozenset()
    # Not the device: on overlay and btrfs the kernel's list names another one than stat does.
    fields = (line.split() for line in lines if " FLOCK " in line)
    inodes = (field.rpartition(":")[2] for words in fields for field in words if field.count(":") == 2)
    return frozenset(int(inode) for inode in inodes if inode.isdecimal())


def file_identity(path: Path) -> tuple[int, int] | None:
    """Inode and time of the last change of the file at a path, which differ from those of the next one there."""
    try:
        found = os.lstat(path)
    except OSError:
        return None
    return found.st_ino, found.st_ctime_ns
