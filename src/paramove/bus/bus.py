"""The bus as a node sees it."""

from __future__ import annotations

import gc
import logging
import time
from collections import Counter
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path
from types import TracebackType
from typing import Any, Literal, overload

from paramove.bus import topics
from paramove.bus.connecting import CONNECT_TIMEOUT_S
from paramove.bus.exchange import Exchange, Marks
from paramove.bus.live_parameters import LiveParameters
from paramove.bus.lockstep import LockstepTicks, read_up_to
from paramove.bus.settings import BusSettings
from paramove.bus.status import StatusReporter
from paramove.bus.subscriber import Received
from paramove.bus.ticks import ExternalClock, RealTimeTicks, SimulatedTicks, Tick, TickSource
from paramove.bus.topics import Topic
from paramove.documents import InputError
from paramove.msgs.node_status_pb2 import NodeStatus

_log = logging.getLogger(__name__)


class Bus:
    """Topics that a node subscribes to and publishes, and its time.

    Everything happens in the thread that uses the bus: sockets are read and the status is published once a second
    while the node waits for its next message. A bus that publishes `clock` keeps the time itself (see
    `paramove.bus.barrier`).

    Args:
        node: Name of the node.
        settings: Settings that the supervisor gives every node of the bus.
        subscribes: Topics to subscribe to.
        publishes: Topics to publish; the status topic is added.
        run_folder: Where the node may write files.

    Attributes:
        settings: As given.
        run_folder: As given.
        dropped: By topic, how many messages were dropped because no loop took them and the queue was full.

    Raises:
        TopicTakenError, BusFolderError: see `paramove.bus.endpoint`.
        ValueError: a topic of ground truth without `truth_folder`.
    """

    def __init__(
        self,
        node: str,
        settings: BusSettings,
        subscribes: Iterable[Topic] = (),
        publishes: Iterable[Topic] = (),
        run_folder: Path | None = None,
    ) -> None:
        self.node = node
        self.settings = settings
        self.run_folder = run_folder or Path()
        self.dropped: Counter[str] = Counter()
        self._taken_up: Received | Tick | None = None
        self.exchange = Exchange(node, settings)
        self._subscribed: list[str] = []
        self._backlog: list[Received] = []
        self._held: list[tuple[Topic, Any, int | None]] = []
        self._tick: Tick | None = None
        self._live: LiveParameters | None = None
        self._frozen = False
        self._connect_s = 0.0  # left for waiting until connected
        try:
            publishes = tuple(publishes)
            self._status = StatusReporter(self.exchange, node)
            for topic in publishes:
                self.exchange.advertise(topic)
            for topic in subscribes:
                self.subscribe(topic)
            self._ticks = self._source_of_time(topics.CLOCK in publishes)
        except BaseException:
            self.exchange.close()
            raise
        self.exchange.every_second = lambda: self._status.publish(self.now_ns)

    @property
    def now_ns(self) -> int:
        """Time of the bus clock: monotonic time of the machine, or simulated time since the start of the run."""
        return self._ticks.now_ns

    @property
    def taken_up(self) -> str:
        """The latest event given to a loop, such as "gestures, sequence 12" or "tick 3"; "" before."""
        event = self._taken_up
        if isinstance(event, Tick):
            return f"tick {event.number}"
        return f"{event.topic.name}, sequence {event.sequence}" if event else ""

    @property
    def has_failed(self) -> bool:
        """Whether the latest state published is `failed`."""
        return self._status.state == NodeStatus.STATE_FAILED

    @property
    def has_ended(self) -> bool:
        """Whether the latest state published is that the node is about to end well."""
        return self._status.state == NodeStatus.STATE_STOPPED

    @property
    def stopped(self) -> bool:
        """Whether the node was requested to end."""
        return self.exchange.stopped

    def subscribe(self, topic: Topic) -> None:
        """Subscribes to one more topic."""
        self.exchange.subscribe(topic)
        if topic.name not in self._subscribed:
            self._subscribed.append(topic.name)

    def follow(self, live: LiveParameters) -> None:
        """Lets persons change parameters of the node while it runs, between two of its events."""
        self._live = live
        self._status.parameters = live.parameters
        self.subscribe(topics.PARAMETERS_SET)

    def when_readable(self, descriptor: int, call: Callable[[], None]) -> None:
        """Calls `call`, in the bus's thread, as soon as `descriptor` can be read, even between two ticks.

        So another thread of the node can publish at once. `call` must read the descriptor.
        """
        self.exchange.when_readable(descriptor, call)

    def when_idle(self, work: Callable[[], bool]) -> None:
        """Calls `work`, in the bus's thread, while no message waits and no tick is due, as long as it returns True.

        For work that takes long: it is done in slices of a few milliseconds, between which messages and ticks are
        handed out, urgent ones first. Not in lockstep, where time waits for a node.
        """
        self.exchange.idle_work = work

    def publish(self, topic: Topic, message: Any, captured_ns: int | None = None) -> None:
        """Publishes `message`. Never waits.

        In lockstep, what is published before the first tick goes out with it: only then has everybody subscribed.

        Args:
            topic: One of those the node publishes.
            message: Of the topic's type.
            captured_ns: Time at which the content was measured, ns of the bus clock; default now.

        Raises:
            KeyError: the node does not publish this topic.
            TypeError, ValueError: see `Publisher.publish`.
        """
        self.exchange.check_process()
        if topic.name not in self.exchange.publishers:
            published = ", ".join(sorted(self.exchange.publishers))
            raise KeyError(
                f"{self.node} does not publish {topic.name}; add the topic to PUBLISHES, which has {published}"
            )
        if self._ticks.may_publish:
            self.publish_at_once(topic, message, captured_ns)
        else:
            self._held.append((topic, message, captured_ns))

    @overload
    def events(self, *selected: Topic, tick: Literal[False] = False) -> Iterator[Received]: ...
    @overload
    def events(self, *selected: Topic, tick: Literal[True]) -> Iterator[Received | Tick]: ...

    def events(self, *selected: Topic, tick: bool = False) -> Iterator[Received | Tick]:
        """Every message of these topics (default: of all subscribed, also later on), oldest first, until the bus stops.

        Messages of other topics are queued for a later loop, up to the topic's high water mark.

        Args:
            selected: Topics.
            tick: Also yield a `Tick` once a camera period, after the messages of that period.
        """
        return self._events(selected, tick, conflate=False)

    def latest(self, *selected: Topic) -> Iterator[Received]:
        """Like `events`, but of each topic only the latest message that has arrived."""
        for event in self._events(selected, tick=False, conflate=True):
            assert isinstance(event, Received)
            yield event

    def rest(self) -> list[Received]:
        """What has arrived and no loop has taken, oldest first: for a node that is about to end."""
        self.exchange.drain_to_the_last()
        rest = self._backlog + self.exchange.take(self._subscribed)
        self._backlog = []
        return rest

    def connect(self, timeout_s: float = CONNECT_TIMEOUT_S, visitor: bool = False) -> None:
        """Waits until the node is connected with those that run already, so that neither misses a message of the other.

        In lockstep the handshake at the first tick does that. What is subscribed to later is connected at `ready`.

        Args:
            timeout_s: Longest time, all in all. Nodes that are missing then are in the status.
            visitor: Nobody waits for this node.
        """
        if not visitor:
            self.exchange.announce(self._status.ownership)
        self._connect_s = 0.0 if self.settings.lockstep else timeout_s
        self._wait_until_connected()

    def _wait_until_connected(self) -> None:
        if self._connect_s <= 0.0:
            return
        began_s = time.monotonic()
        self.exchange.connect(self._connect_s)
        self._connect_s -= time.monotonic() - began_s
        for node, names in self.exchange.unconnected().items():
            _log.warning("not connected with %s yet (%s); what it misses is counted", node, ", ".join(names))

    def starting(self, message: str) -> None:
        """Publishes what the node is doing before it is ready."""
        self._status.change(NodeStatus.STATE_STARTING, message, self.now_ns)

    def ready(self, message: str) -> None:
        """Publishes that the node does its work, and how."""
        if not self._frozen:  # what is alive now stays alive: the collector can skip it
            self._frozen = True
            self._wait_until_connected()
            gc.collect()
            gc.freeze()
        self._status.change(NodeStatus.STATE_READY, message, self.now_ns)

    def degraded(self, message: str) -> None:
        """Publishes that the node works with less than it should, and what is missing."""
        self._status.change(NodeStatus.STATE_DEGRADED, message, self.now_ns)

    def failed(self, message: str) -> None:
        """Publishes that the node cannot do its work, and why."""
        self._status.change(NodeStatus.STATE_FAILED, message, self.now_ns)

    def ended(self, message: str) -> None:
        """Publishes that the node is about to end well."""
        self._status.change(NodeStatus.STATE_STOPPED, message, self.now_ns)

    def stop(self) -> None:
        """Ends every loop over events. May be called from a signal handler; publishing still works until `close`."""
        self.exchange.stop()

    def close(self) -> None:
        """Leaves the bus. Messages published just before still arrive."""
        self.exchange.stop()
        if isinstance(self._ticks, LockstepTicks):
            self._ticks.leave()
        self.exchange.close()

    def idle(self, seconds: float) -> None:
        """Does nothing for so long but what the bus needs: answers subscriptions, publishes the status, drains sockets.

        For a process with a pace of its own, such as the simulator in real time. Also with no time left the bus gets
        what it needs, once. Ends early only if the bus is stopped.
        """
        end_s = time.monotonic() + seconds
        self.exchange.wait(max(0.0, seconds))
        while not self.stopped and (left_s := end_s - time.monotonic()) > 0:
            self.exchange.wait(left_s)

    def wait_for_subscriber(self, seconds: float) -> None:
        """Waits until there is a subscriber to the node's status, at most so long.

        For a node that ends right after it began: otherwise nobody would receive the reason.
        """
        end_s = time.monotonic() + seconds
        while not (self._status.has_subscriber or self.stopped) and (left_s := end_s - time.monotonic()) > 0:
            self.exchange.wait(left_s)

    def read_up_to(self, marks: Marks, keep: bool = False) -> list[Received]:
        """Waits for everything received up to the marks; returns it in the order of publish time, then of SUBSCRIBES.

        Args:
            marks: Topic name on the bus -> epoch and sequence.
            keep: Only wait, and leave the messages for the next call.
        """
        self.exchange.drain(self._subscribed)
        read_up_to(self.exchange, marks, self._subscribed)
        return [] if keep else self.exchange.take(self._subscribed, marks)

    def keep_time(self, now_ns: int) -> None:
        """Sets the time, on the bus that publishes `clock`; raises RuntimeError on others or if time ran backwards.

        InputError for the time of a simulation in a run with the time of this machine.
        """
        if not isinstance(self._ticks, ExternalClock):
            raise RuntimeError(f"{self.node} does not publish {topics.CLOCK.name}, so it cannot set the time")
        if now_ns < self._ticks.now_ns:
            if self.settings.clock == "monotonic":
                raise InputError(
                    f"{self.node} simulates time, but the clock of this run is that of the machine; start it by a "
                    "launch file with 'bus: {clock: simulated}'"
                )
            raise RuntimeError(f"time would run back from {self._ticks.now_ns} ns to {now_ns} ns")
        self._ticks.now_ns = now_ns

    def hold(self) -> None:
        """Queues what is published from now on until `release`, on the bus that publishes `clock`."""
        assert isinstance(self._ticks, ExternalClock)
        self._ticks.may_publish = False

    def release(self) -> None:
        """Publishes the queued messages; later ones are published at once."""
        if isinstance(self._ticks, ExternalClock):
            self._ticks.may_publish = True
        held, self._held = self._held, []
        for topic, message, captured_ns in held:
            self.publish_at_once(topic, message, captured_ns)

    def publish_at_once(self, topic: Topic, message: Any, captured_ns: int | None = None) -> None:
        """Like `publish`, but never queued."""
        now_ns = self.now_ns
        captured_ns = now_ns if captured_ns is None else captured_ns
        self.exchange.publishers[topic.name].publish(message, captured_ns, now_ns)

    def __enter__(self) -> Bus:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def _source_of_time(self, publishes_clock: bool) -> TickSource:
        if publishes_clock:
            return ExternalClock(self.settings.begun_ns)
        if self.settings.clock == "monotonic":
            return RealTimeTicks(self.exchange)
        return LockstepTicks(self.exchange, self.node) if self.settings.lockstep else SimulatedTicks(self.exchange)

    def _events(self, selected: tuple[Topic, ...], tick: bool, conflate: bool) -> Iterator[Received | Tick]:
        names = {topic.name for topic in selected}
        if not_subscribed := names - set(self._subscribed):
            raise KeyError(
                f"{self.node} does not subscribe to {', '.join(sorted(not_subscribed))}; add the topic to SUBSCRIBES"
            )
        while not self.stopped:
            while (
                not self.stopped and (received := self._next_of(names or set(self._subscribed), conflate)) is not None
            ):
                yield from self._timed(received)
            if tick and self._tick is not None and not self.stopped:
                now, self._tick = self._tick, None
                yield from self._timed(now)
            if not self._next_iteration():
                return

    def _timed(self, event: Received | Tick) -> Iterator[Received | Tick]:
        """Yields one event and accounts for the time until the node comes back."""
        started_ns = time.perf_counter_ns()
        self._taken_up = event
        try:
            yield event
        finally:
            self._status.processing_ns += time.perf_counter_ns() - started_ns
            self._status.processed += 1

    def _next_of(self, names: set[str], conflate: bool) -> Received | None:
        """Takes the oldest message of these topics out of the backlog; with `conflate` also all others of its topic."""
        if self._backlog and not self._backlog[0].topic.is_urgent:
            self._backlog[:0] = self.exchange.take_urgent()
        for index, received in enumerate(self._backlog):
            if received.topic.name not in names:
                continue
            if conflate and any(later.topic.name == received.topic.name for later in self._backlog[index + 1 :]):
                continue
            name = received.topic.name
            if conflate:
                self._backlog = [item for item in self._backlog if item.topic.name != name]
            else:
                del self._backlog[index]
            return received
        return None

    def _next_iteration(self) -> bool:
        """Waits for the next iteration; False once the bus was stopped."""
        self.exchange.housekeeping()
        self._trim_backlog()
        iteration = self._ticks.next(self._subscribed)
        if iteration is None:
            return False
        messages, self._tick = iteration
        self._backlog += messages if self._live is None else self._without_requests(messages, self._live)
        if self._held and self._ticks.may_publish:
            self.release()
        return True

    def _without_requests(self, messages: list[Received], live: LiveParameters) -> list[Received]:
        """What the node gets of these messages; changes of its parameters are made, and reported by its status."""
        requests = [received for received in messages if received.topic is topics.PARAMETERS_SET]
        is_answered = False
        for received in requests:
            is_answered |= live.receive(received.message, self.now_ns)
        if live.land(self.now_ns) or is_answered:
            self._status.publish(self.now_ns)
        return [received for received in messages if received.topic is not topics.PARAMETERS_SET]

    def _trim_backlog(self) -> None:
        """Drops the oldest messages that no loop took, beyond the high water mark of their topic."""
        if not self._backlog:
            return
        waiting = Counter(received.topic.name for received in self._backlog)
        remaining = []
        for received in self._backlog:
            if waiting[received.topic.name] > received.topic.high_water_mark:
                waiting[received.topic.name] -= 1
                self.dropped[received.topic.name] += 1
            else:
                remaining.append(received)
        self._backlog = remaining
