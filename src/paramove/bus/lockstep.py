"""Lockstep, the member's side: time waits until this process is done with a tick.

1. The member connects to `<bus folder>/lockstep` and greets (JOIN) once the clock's publisher has welcomed it.
2. The first tick whose marks name the member is a handshake: the member publishes nothing and waits until the publisher
   of every subscribed topic with a mark has welcomed it. So it misses nothing that is published later.
3. At every later tick it reads each topic up to the tick's mark: the messages published when the tick began. Messages
   beyond the mark are queued for the next iteration. So an iteration has the same messages on any machine.
4. When the node comes back for the next iteration it answers DONE with the marks of what it has published itself. One
   that ends answers LEAVE with them, and they count for one more tick: the others read its last messages there.

A topic without a mark has a publisher that time does not wait for (a person's page, a node with `lockstep: false`), and
status topics follow wall time; their messages are handed over at the tick after they arrived.
"""

from __future__ import annotations

import logging
import os
import time
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import zmq

from paramove.bus import topics
from paramove.bus.endpoint import Ownership, bound_socket, socket_path
from paramove.bus.envelope import Envelope, pack, publisher_id
from paramove.bus.exchange import Exchange, Marks
from paramove.bus.monitor import ForeignConnections
from paramove.bus.schemas import schema_hash
from paramove.bus.ticks import LONGEST_WAIT_S, Iteration, Tick
from paramove.msgs.clock_pb2 import Clock, TickDone, TopicMark

_log = logging.getLogger(__name__)

SERVICE = "lockstep"
"""Name of the barrier's socket in the bus folder."""
RETRY_PERIOD_S = 2.0
"""After so long a missing message is requested again, or given up if its publisher is gone."""


def to_marks(marks: Iterable[TopicMark]) -> dict[str, tuple[int, int]]:
    """Marks of a message as a dictionary."""
    return {mark.topic: (mark.epoch, mark.sequence) for mark in marks}


def from_marks(marks: Marks) -> list[TopicMark]:
    """Marks as a message's list, sorted by topic."""
    return [TopicMark(topic=name, epoch=marks[name][0], sequence=marks[name][1]) for name in sorted(marks)]


def member_mark(node: str) -> str:
    """Name of the mark that confirms to a member that it was admitted; its epoch is the process id."""
    return f"{SERVICE}/{node}"


def read_up_to(exchange: Exchange, marks: Marks, names: list[str]) -> None:
    """Waits until everything up to the marks has been drained.

    A message that is missing although its publisher is alive is requested again, so that it is counted as lost; if the
    publisher is gone it is given up. Both are logged: from there on the run may differ from another one.
    """
    started_s = retried_s = time.monotonic()
    while not exchange.stopped:
        exchange.drain(names)
        absent = exchange.missing(marks, names)
        if not absent:
            return
        now_s = time.monotonic()
        if now_s - retried_s > RETRY_PERIOD_S:
            retried_s = now_s
            for name in absent:
                connected = exchange.subscribers[name].connected
                _log.warning(
                    "lockstep: topic %s not received up to its mark after %.0f s; %s; this run may differ from others",
                    name,
                    now_s - started_s,
                    "requesting it again" if connected else "its publisher is gone",
                )
                if connected:
                    exchange.reopen(name)
            if not any(exchange.subscribers[name].connected for name in absent):
                return
        exchange.wait(RETRY_PERIOD_S)


def answers_socket(
    context: zmq.Context[Any], folder: Path, holder: str, max_bytes: int
) -> tuple[zmq.Socket[Any], Ownership, ForeignConnections]:
    """The end that receives the answers of all members. Raises TopicTakenError and BusFolderError.

    Args:
        context: Of ZeroMQ.
        folder: Bus folder.
        holder: Name of the node.
        max_bytes: Of an answer.
    """
    options = {
        zmq.ROUTER_HANDOVER: 1,  # a restarted member comes with the name of the dead one
        zmq.LINGER: 0,
        zmq.MAXMSGSIZE: max_bytes,
    }
    return bound_socket(context, zmq.ROUTER, folder, SERVICE, holder, options)


def member_socket(context: zmq.Context[Any], folder: Path, node: str) -> zmq.Socket[Any]:
    """The end of the member called `node`."""
    socket: zmq.Socket[Any] = context.socket(zmq.DEALER)
    socket.setsockopt(zmq.IDENTITY, node.encode())
    socket.setsockopt(zmq.LINGER, 200)
    socket.setsockopt(zmq.RECONNECT_IVL, 20)
    socket.connect(f"ipc://{socket_path(folder, SERVICE)}")
    return socket


class LockstepTicks:
    """Iterations of a member."""

    def __init__(self, exchange: Exchange, node: str) -> None:
        self._exchange = exchange
        self._node = node
        self.now_ns = 0
        self.may_publish = False
        self._clock = exchange.subscribe(topics.CLOCK)
        self._socket = member_socket(exchange.context, exchange.settings.folder, node)
        exchange.add_socket(self._socket)
        self._schema = schema_hash(TickDone)
        self._joined = False
        self._shaken = False
        self._tick: int | None = None

    def next(self, names: list[str]) -> Iteration | None:
        if self._tick is not None:
            self._answer(TickDone.KIND_DONE, self._tick)
            self._tick = None
        while not self._exchange.stopped:
            if not self._joined:
                self._join()
                continue
            clock = self._next_clock()
            if clock is None:
                continue
            self.now_ns = clock.time_ns
            marks = to_marks(clock.published)
            if marks.get(member_mark(self._node), (0, 0))[0] != os.getpid():
                continue  # the barrier has not read our greeting yet
            read_up_to(self._exchange, marks, names)
            if not self._shaken:
                self._shaken = True
                self._answer(TickDone.KIND_DONE, clock.tick)
                continue
            self.may_publish = True
            self._tick = clock.tick
            return self._exchange.take(names, marks), Tick(clock.tick, clock.time_ns)
        return None

    def leave(self) -> None:
        """Requests the barrier to stop waiting for this process."""
        if self._joined:
            self._answer(TickDone.KIND_LEAVE, self._tick or 0)
            self._joined = False

    def _join(self) -> None:
        self._exchange.drain([topics.CLOCK.name])
        if self._clock.welcomed:
            self._joined = True
            self._answer(TickDone.KIND_JOIN, 0)
        else:
            self._exchange.wait(LONGEST_WAIT_S)

    def _next_clock(self) -> Clock | None:
        self._exchange.drain([topics.CLOCK.name])
        clock = self._exchange.pop(topics.CLOCK)
        if clock is None:
            self._exchange.wait(LONGEST_WAIT_S)
            return None
        message: Clock = clock.message
        return message

    def _answer(self, kind: TickDone.Kind, tick: int) -> None:
        marks = self._exchange.marks() | {member_mark(self._node): (os.getpid(), 0)}
        answer = TickDone(node=self._node, pid=os.getpid(), kind=kind, tick=tick, published=from_marks(marks))
        payload = answer.SerializeToString()
        envelope = Envelope(self._schema, publisher_id(self._node), 0, tick, self.now_ns, self.now_ns)
        self._socket.send_multipart([pack(envelope, payload), payload], zmq.NOBLOCK)
