"""Signals that end a node, and children that the node forks, such as those of a pool of processes.

A forked child has its parent's handlers: it would only mark its copy of the bus as stopped, go on, and let the parent
wait for it for ever. So it gets the handlers that the node found at its start.
"""

from __future__ import annotations

import os
import signal
import threading
from collections.abc import Callable
from typing import Any

ENDS = (signal.SIGTERM, signal.SIGINT)


def handle_signals(stop: Callable[[], None]) -> None:
    """Calls `stop` at each signal that ends a node, in this process but not in children that it forks."""
    before = {number: signal.signal(number, lambda *_: stop()) for number in ENDS}
    masks: dict[int, Any] = {}

    def block() -> None:
        # A signal that reached the child before it has its handlers would be lost.
        masks[threading.get_ident()] = signal.pthread_sigmask(signal.SIG_BLOCK, ENDS)

    def unblock() -> None:
        signal.pthread_sigmask(signal.SIG_SETMASK, masks.pop(threading.get_ident()))

    def begin_child() -> None:
        for number, handler in before.items():
            signal.signal(number, handler)
        signal.set_wakeup_fd(-1)  # that of an event loop of the parent
        unblock()

    os.register_at_fork(before=block, after_in_parent=unblock, after_in_child=begin_child)
