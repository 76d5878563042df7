"""All sockets of one process: publishers, subscribers, and its single poll loop."""

from __future__ import annotations

import contextlib
import math
import os
import time
from collections import deque
from collections.abc import Callable, Iterable, Mapping
from operator import attrgetter
from typing import Any

import zmq

from paramove.bus.connecting import running_nodes, written
from paramove.bus.endpoint import Ownership
from paramove.bus.monitor import ForeignConnections, can_read
from paramove.bus.publisher import Publisher
from paramove.bus.settings import BusSettings
from paramove.bus.subscriber import Received, Subscriber
from paramove.bus.topics import Topic
from paramove.msgs.clock_pb2 import Clock
from paramove.msgs.node_status_pb2 import NodeStatus

Marks = Mapping[str, tuple[int, int]]
"""Topic name on the bus -> epoch and sequence of the latest message published."""

WATCH_PERIOD_S = 0.25
_CONNECT_PERIOD_S = 0.05
DRAIN_LIMIT = 1000
"""Messages taken from one topic at once, so that a flood on it does not block the process."""
URGENT_LIMIT = 20
"""The same for an urgent topic, between any two other messages."""
QUIET_S = 0.02
"""Without a message for so long, no more are on the way from nodes that have ended."""
LAST_S = 0.2
"""Time for messages that are on the way when a node ends."""


class Exchange:
    """Publishers and subscribers of a process.

    There is no thread: sockets are read, subscriptions answered and lost connections noticed in `wait` and `drain`,
    which the process's loop calls. Use it in the thread and process that made it.
    """

    def __init__(self, node: str, settings: BusSettings) -> None:
        self.node = node
        self.settings = settings
        self.stopped = False
        self.publishers: dict[str, Publisher] = {}
        self.subscribers: dict[str, Subscriber] = {}
        self.every_second: Callable[[], None] = lambda: None
        self.idle_work: Callable[[], bool] = lambda: False
        """A slice of work that may wait for everything else; returns whether there is more."""
        self.urgent_first = False
        """Whether urgent topics overtake all others; not in lockstep, where the order of messages is the same in every
        run."""
        self._urgent: list[str] = []
        self._only_urgent = False
        self.context: zmq.Context[Any] = zmq.Context()
        self._owned: list[Ownership] = []
        self._pending: dict[str, deque[tuple[int, Received]]] = {}
        self._callbacks: dict[int, Callable[[], None]] = {}
        self._poller = zmq.Poller()
        self._wake = os.eventfd(0, os.EFD_NONBLOCK | os.EFD_CLOEXEC)
        self._poller.register(self._wake, zmq.POLLIN)
        self._others: list[zmq.Socket[Any] | ForeignConnections] = []
        self._foreign: list[ForeignConnections] = []
        self._pid = os.getpid()
        self._watch_due_s = 0.0
        self._second_due_s = 0.0
        self._closed = False
        self._announced: Ownership | None = None
        self._forwarded: set[str] = set()
        self._unconnected: list[tuple[str, str]] = []

    def advertise(self, topic: Topic) -> Publisher:
        """Becomes the publisher of a topic."""
        settings = self.settings
        publisher = Publisher(self.context, settings.folder_of(topic), topic, self.node, settings.name_of(topic))
        self._owned.append(publisher.ownership)
        self._foreign.append(publisher.foreign)
        self.publishers[topic.name] = publisher
        self._poller.register(publisher.socket, zmq.POLLIN)
        self._write_topics()
        return publisher

    def subscribe(self, topic: Topic) -> Subscriber:
        """Subscribes to a topic; to do it again changes nothing."""
        if topic.name not in self.subscribers:
            settings = self.settings
            subscriber = Subscriber(
                self.context,
                settings.folder_of(topic),
                topic,
                settings.name_of(topic),
                self.node,
                by_own_clock=not settings.lockstep,
            )
            self.subscribers[topic.name] = subscriber
            if topic.is_urgent:
                self._urgent = sorted([*self._urgent, topic.name], key=self._rank)
            self._pending[topic.name] = deque()
            self._poller.register(subscriber.socket, zmq.POLLIN)
            self._write_topics()
        return self.subscribers[topic.name]

    def announce(self, ownership: Ownership) -> None:
        """From now on starting nodes wait until they are connected with this one; see `paramove.bus.connecting`.

        Args:
            ownership: Of the node's status topic.
        """
        self._announced = ownership
        self._write_topics()

    def forwards(self, subscribes: Iterable[str]) -> None:
        """Announces topics, too, that other sockets of the node subscribe to under its name."""
        self._forwarded.update(subscribes)
        self._write_topics()

    def connect(self, timeout_s: float) -> None:
        """Waits until connected with all nodes that run already and share a topic, at most `timeout_s`.

        Their subscriptions have arrived here, and their publishers have welcomed this node.
        """
        end_s = time.monotonic() + timeout_s
        subscribed = {item.name for item in self.subscribers.values()}
        published = {item.name for item in self.publishers.values()}
        self._unconnected = [
            (other.node, name)
            for other in running_nodes(self.settings.folder)
            for name in sorted((other.subscribes & published) | (other.publishes & subscribed))
            if other.node != self.node
        ]
        while self.unconnected() and not self.stopped and (left_s := end_s - time.monotonic()) > 0:
            self.wait(min(left_s, _CONNECT_PERIOD_S))

    def unconnected(self) -> dict[str, list[str]]:
        """Node -> topics of those that `connect` waited for in vain, and that still run."""
        if not self._unconnected:
            return {}
        connected = {item.name for item in self.subscribers.values() if item.welcomed}
        by_publisher = {item.name: item.subscribers for item in self.publishers.values()}
        running = {other.node for other in running_nodes(self.settings.folder)}
        self._unconnected = [
            (node, name)
            for node, name in self._unconnected
            if node in running and name not in connected and node not in by_publisher.get(name, ())
        ]
        missing: dict[str, list[str]] = {}
        for node, name in self._unconnected:
            missing.setdefault(node, []).append(name)
        return missing

    def _write_topics(self) -> None:
        if self._announced is not None:
            subscribes = self._forwarded.union(item.name for item in self.subscribers.values())
            publishes = {item.name for item in self.publishers.values()}
            self._announced.write(written(subscribes, publishes))

    def add_socket(
        self,
        socket: zmq.Socket[Any],
        ownership: Ownership | None = None,
        foreign: ForeignConnections | None = None,
    ) -> None:
        """Lets `wait` return when `socket` can be read; it is closed with the others."""
        if foreign is not None:
            self._foreign.append(foreign)
            self._others.append(foreign)
        self._others.append(socket)
        self._poller.register(socket, zmq.POLLIN)
        if ownership is not None:
            self._owned.append(ownership)

    def watch_descriptor(self, descriptor: int, watched: bool = True) -> None:
        """Lets `wait` return when a file descriptor can be read, or no longer."""
        if watched:
            self._poller.register(descriptor, zmq.POLLIN)
        else:
            self._poller.unregister(descriptor)

    def when_readable(self, descriptor: int, call: Callable[[], None]) -> None:
        """Lets `wait` call `call` as soon as `descriptor` can be read; unless `call` reads it, again and again."""
        self._callbacks[descriptor] = call
        self._poller.register(descriptor, zmq.POLLIN)

    def wait(self, timeout_s: float) -> set[object]:
        """Waits until something can be read, at most `timeout_s`.

        Drains what can be read of the subscribed topics and answers subscriptions. Before, a slice of `idle_work` is
        done, and as long as there is more of it, there is no wait.

        Returns:
            The sockets and descriptors that could be read.
        """
        self.housekeeping()
        if self.idle_work():
            timeout_s = 0.0
        until_due_s = min(self._watch_due_s, self._second_due_s) - time.monotonic()
        events = self._poller.poll(math.ceil(1000 * max(0.0, min(timeout_s, until_due_s))))
        ready: set[object] = {item for item, _ in events}
        if ready:
            for publisher in self.publishers.values():
                if publisher.socket in ready:
                    publisher.serve()
            self.drain([name for name, item in self.subscribers.items() if item.socket in ready], ready=True)
            for descriptor, call in self._callbacks.items():
                if descriptor in ready:
                    call()
        return ready

    def drain(self, topics: Iterable[str], ready: bool = False, limit: int = DRAIN_LIMIT) -> None:
        """Takes what has arrived of these topics out of the sockets, without waiting.

        With `urgent_first` it ends as soon as an urgent message waits: to decode a long one takes time.

        Args:
            topics: Names of subscribed topics.
            ready: A poll has shown that each of them has a message.
            limit: Messages of each topic.
        """
        for name in topics:
            subscriber, pending = self.subscribers[name], self._pending[name]
            for number in range(limit):
                received = subscriber.receive(ready and number == 0)
                if received is None:
                    break
                pending.append((subscriber.counter.epoch or 0, received))
                if self.urgent_first and not received.topic.is_urgent and self._urgent_waits():
                    return

    def drain_to_the_last(self) -> None:
        """Drains until nothing more arrives for `QUIET_S`, or `LAST_S` have passed; also once the bus is stopped."""
        poller = zmq.Poller()
        for subscriber in self.subscribers.values():
            poller.register(subscriber.socket, zmq.POLLIN)
        end_s = time.monotonic() + LAST_S
        self.drain(self.subscribers)
        while poller.poll(math.ceil(1000 * QUIET_S)) and time.monotonic() < end_s:
            self.drain(self.subscribers)

    def take_urgent(self) -> list[Received]:
        """What has arrived of the urgent topics: stops first, each topic in order of arrival.

        Empty unless `urgent_first`. Costs little while nothing waits, so it may be called between any two messages. It
        takes a few of each topic, so that a flood of them does not keep the process from its ticks.
        """
        if not self.urgent_first:
            return []
        taken: list[Received] = []
        for name in self._urgent:
            subscriber, pending = self.subscribers[name], self._pending[name]
            if not pending and can_read(subscriber.socket):
                self.drain([name], ready=True, limit=URGENT_LIMIT)
            taken += [received for _, received in pending]
            pending.clear()
        return taken

    def take_next(self, topics: list[str]) -> list[Received]:
        """What has arrived, without waiting: of the urgent topics alone where there is something.

        Of the others at least every second time, so that a flood of urgent messages does not keep them away for good.
        """
        messages = self.take_urgent()
        self._only_urgent = bool(messages) and not self._only_urgent
        if not self._only_urgent:
            self.drain(topics)
            messages += self.take(topics)
        return messages

    def _urgent_waits(self) -> bool:
        return any(can_read(self.subscribers[name].socket) for name in self._urgent)

    def _rank(self, name: str) -> bool:
        return not self.subscribers[name].topic.is_stop

    def take(self, topics: Iterable[str], marks: Marks | None = None) -> list[Received]:
        """What was drained of these topics, in the order of publish time, then of the topics.

        What was published after the marks is left. A topic without a mark is taken whole.
        """
        taken: list[Received] = []
        for name in topics:
            pending, subscriber = self._pending[name], self.subscribers[name]
            mark = marks.get(subscriber.name) if marks else None
            present = subscriber.counter.epoch
            while pending:
                epoch, received = pending[0]
                # Of the present publisher and published after the mark, or by a new start of it that has no mark yet.
                if mark is not None and epoch == present and (epoch != mark[0] or received.sequence > mark[1]):
                    break
                taken.append(received)
                pending.popleft()
        return sorted(taken, key=attrgetter("published_ns"))

    def missing(self, marks: Marks, topics: Iterable[str]) -> list[str]:
        """Those of the topics that have not been received up to their marks."""
        absent = []
        for name in topics:
            subscriber = self.subscribers[name]
            mark = marks.get(subscriber.name)
            if mark is not None and not subscriber.counter.has_reached(*mark):
                absent.append(name)
        return absent

    def marks(self) -> dict[str, tuple[int, int]]:
        """The latest message of every topic published here, but the clock and the status, which follow other rules."""
        return {
            item.name: (item.epoch, item.sequence)
            for item in self.publishers.values()
            if item.topic.type not in (Clock, NodeStatus)
        }

    def pop(self, topic: Topic) -> Received | None:
        """The oldest drained message of a topic."""
        pending = self._pending[topic.name]
        return pending.popleft()[1] if pending else None

    def reopen(self, name: str) -> None:
        """Subscribes to a topic again: the publisher's welcome then reveals what was lost."""
        self._poller.unregister(self.subscribers[name].socket)
        self.subscribers[name].reopen()
        self._poller.register(self.subscribers[name].socket, zmq.POLLIN)

    def stop(self) -> None:
        """Makes `wait` return at once and for good. May be called from a signal handler."""
        self.stopped = True
        if not self._closed and os.getpid() == self._pid:  # a fork shares the descriptor with its parent
            with contextlib.suppress(OSError):  # another thread is closing it just now
                os.eventfd_write(self._wake, 1)

    def close(self) -> None:
        """Closes everything. Messages published just before still arrive, for `publisher.LINGER_MS` at most."""
        if self._closed:
            return
        self.stopped = self._closed = True
        if os.getpid() != self._pid:
            return  # a fork: the sockets and the thread behind them are the parent's
        for item in (*self.subscribers.values(), *self.publishers.values(), *self._others):
            item.close()
        self.context.term()
        # Only now are the sockets' files gone: a successor that binds earlier would lose its own to libzmq's clean-up.
        for ownership in self._owned:
            ownership.release()
        os.close(self._wake)

    def check_process(self) -> None:
        """Raises RuntimeError after a fork: libzmq's thread, which moves every message, exists in the parent alone."""
        if os.getpid() != self._pid:
            raise RuntimeError(
                f"the bus of {self.node} was made in process {self._pid} and cannot be used after a fork; "
                "make a Bus in the new process, under another name"
            )

    def housekeeping(self) -> None:
        """Periodic work, a few times a second; for a loop that always has messages and therefore never calls `wait`."""
        self.check_process()
        now_s = time.monotonic()
        if now_s >= self._watch_due_s:
            self._watch_due_s = now_s + WATCH_PERIOD_S
            for foreign in self._foreign:
                foreign.look()
            for subscriber in self.subscribers.values():
                if subscriber.is_deaf():
                    self._poller.unregister(subscriber.socket)
                    subscriber.revive()
                    self._poller.register(subscriber.socket, zmq.POLLIN)
        if now_s >= self._second_due_s:
            self._second_due_s = now_s + 1.0
            self.every_second()
