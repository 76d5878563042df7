"""Ends the nodes of a launcher that died without ending them.

Each node gets SIGTERM from the kernel when the launcher dies (PR_SET_PDEATHSIG); this process sends SIGKILL to the
process groups that outlive it. It reads a `Watched` for each change from a pipe whose other end the launcher holds, and
acts when that end closes, which the kernel does however the launcher ended.
"""

from __future__ import annotations

import contextlib
import os
import signal
import sys
import time

from paramove.documents import Message, MessageError, MessageReader, Pid

GRACE_S = 1.5
_LONGEST = 200


class Watched(Message):
    """A process group that ends with the launcher from now on, or no longer."""

    group: Pid
    watched: bool


CHANGES = MessageReader(Watched, max_bytes=_LONGEST)


def main() -> None:
    """Follows the pipe on standard input to its end, then ends what is left."""
    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
        signal.signal(number, signal.SIG_IGN)  # a closed terminal must not end the guard before the nodes
    groups: set[int] = set()
    while line := sys.stdin.buffer.readline(_LONGEST):
        with contextlib.suppress(MessageError):  # the last one, of a launcher that was killed while it wrote
            change = CHANGES.read(line)
            if change.watched:
                groups.add(change.group)
            else:
                groups.discard(change.group)
    end_groups(groups, GRACE_S)
    if groups:
        _print(f"paramove: the launcher was killed; its {len(groups)} processes were ended")


def _print(message: str) -> None:
    """Prints to standard error, which is the launcher's. A terminal that blocks for 1 s ends this process."""
    signal.alarm(1)
    with contextlib.suppress(OSError):
        os.write(2, f"{message}\n".encode())


def end_groups(groups: set[int], grace_s: float) -> None:
    """SIGTERM and SIGCONT to each process group, SIGKILL to those that are left after `grace_s`."""
    deadline_s = time.monotonic() + grace_s
    left = {group for group in groups if _send(group, signal.SIGTERM) and _send(group, signal.SIGCONT)}
    while left and time.monotonic() < deadline_s:
        time.sleep(0.02)
        left = {group for group in left if _send(group, 0)}
    for group in left:
        _send(group, signal.SIGKILL)


def _send(group: int, number: int) -> bool:
    with contextlib.suppress(ProcessLookupError, PermissionError):
        os.killpg(group, number)
        return True
    return False


if __name__ == "__main__":
    main()
