"""A running application, seen and used by a program that is no node of it."""

from __future__ import annotations

import math
import time
from collections import deque
from collections.abc import Callable, Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any, Self

from paramove.bus import (
    BusVisitor,
    Publisher,
    Received,
    Subscriber,
    Topic,
    inspection,
    running_folder,
    running_nodes,
    topics,
)
from paramove.client.content import message_of
from paramove.documents import InputError
from paramove.msgs.relocation_pb2 import RelocationGoal, RelocationStatus
from paramove.msgs.safety_state_pb2 import SafetyState
from paramove.operator import stop_arms

_SERVE_S = 0.02
_CLOCK_S = 2.0
_REPEAT_S = 0.5
LAST_STATES = (RelocationStatus.STATE_SUCCEEDED, RelocationStatus.STATE_FAILED, RelocationStatus.STATE_REJECTED)


class NoMessageError(RuntimeError):
    """Nothing came on a topic in time, such as the answer to a stop; the text names the topic and its publisher."""


class NotConnectedError(RuntimeError):
    """A connection is used before or after its `with` block."""


def connect(domain: str | None = None, name: str = "client", namespace: str = "") -> Run:
    """The application that runs in a domain, for a `with` block.

    Args:
        domain: Default: $PARAMOVE_DOMAIN, else "default".
        name: Of this program, for the messages of others.
        namespace: In which it names topics: `arm/safety` is then `left/arm/safety` on the bus.

    Raises InputError if nothing runs there.
    """
    return Run(running_folder(domain), name, namespace)


class Run:
    """One connection to a run, of one thread, while it is a context. Topics are called by their names.

    Args:
        folder: Of the run's bus.
        name: Of this program.
        namespace: See `connect`.

    Attributes:
        name, namespace: As given.
        is_simulated: Whether the run's time is simulated; known once connected.
    """

    def __init__(self, folder: Path, name: str = "client", namespace: str = "") -> None:
        self._folder, self.name, self.namespace = folder, name, namespace
        self._subscribers: dict[str, Subscriber] = {}
        self._publishers: dict[str, Publisher] = {}
        self._queues: dict[str, deque[Received]] = {}
        self._latest: dict[str, Received] = {}
        self._now_ns = 0
        self.is_simulated = False
        self._open_visitor: BusVisitor | None = None

    def __enter__(self) -> Self:
        self._open_visitor = BusVisitor(self._folder, self.name)
        self.is_simulated = inspection.publisher_of(self._folder, topics.CLOCK).alive
        if self.is_simulated:
            self._subscribe(topics.CLOCK)
        return self

    def __exit__(self, *_: object) -> None:
        self._visitor.close()
        self._open_visitor = None

    @property
    def now_ns(self) -> int:
        """Time of the run: simulated, or this host's monotonic clock.

        Raises NoMessageError if simulated time is not known and does not come within 2 s.
        """
        if not self.is_simulated:
            return time.monotonic_ns()
        self._step(0.0)
        self._until(lambda: topics.CLOCK.name in self._latest, _CLOCK_S)
        if topics.CLOCK.name not in self._latest:
            raise NoMessageError(inspection.why_nothing_came(self._folder, topics.CLOCK, _CLOCK_S))
        return self._now_ns

    @property
    def _visitor(self) -> BusVisitor:
        if self._open_visitor is None:
            raise NotConnectedError("not connected: use it within `with paramove.connect() as run:`")
        return self._open_visitor

    def latest(self, topic: str | Topic, timeout_s: float = 5.0) -> Any:
        """The latest message of a topic; waits for one if there is none yet. Raises NoMessageError and InputError."""
        row = self._subscribe(self._named(topic))
        self._step(0.0)
        self._until(lambda: row.name in self._latest, timeout_s)
        if row.name not in self._latest:
            raise NoMessageError(inspection.why_nothing_came(self._folder, row, timeout_s))
        return self._latest[row.name].message

    def listen(self, *names: str | Topic, seconds: float = math.inf) -> Iterator[Received]:
        """Messages of topics with their times, as they arrive within `seconds` of this call.

        The first is the latest one of a latched topic. What arrives between two calls for the same topic is not lost:
        the second call begins with it.

        Raises InputError for a wrong name, ValueError if `seconds` is no number.
        """
        if math.isnan(seconds):
            raise ValueError("seconds: a number expected, found nan")
        queues = [self._queue_of(self._subscribe(self._named(name))) for name in names]
        return self._taken_from(queues, time.monotonic() + seconds)

    def _queue_of(self, topic: Topic) -> deque[Received]:
        """What arrived on a topic since somebody first listened to it, and was not taken yet."""
        if topic.name not in self._queues:
            self._queues[topic.name] = deque(maxlen=topic.high_water_mark)
            if topic.profile is topics.Profile.LATCHED and topic.name in self._latest:
                self._queues[topic.name].append(self._latest[topic.name])
        return self._queues[topic.name]

    def _taken_from(self, queues: list[deque[Received]], until_s: float) -> Iterator[Received]:
        while True:
            for queue in queues:
                while queue:
                    yield queue.popleft()
            left_s = until_s - time.monotonic()
            if left_s <= 0.0:
                return
            self._step(left_s)

    def publish(self, topic: str | Topic, content: Any, wait_s: float = 2.0) -> bool:
        """Publishes a message, captured now, on a topic that no node publishes.

        Args:
            topic: Its name.
            content: A message of its type, or its fields: a mapping, or a text in YAML.
            wait_s: How long to wait for a first subscriber, and for the time of the run.

        Returns:
            Whether somebody subscribes.

        Raises:
            TopicTakenError: Somebody publishes the topic.
            InputError: There is no such topic, it is for nodes or persons, or that is no message of it.
            ValueError: The message is larger than the topic allows.
            NoMessageError: The run's simulated time is not known.
        """
        row = self._named(topic)
        message = message_of(row.type, content) if isinstance(content, str | Mapping) else content
        publisher = self.offer(row)
        self.wait_for_subscribers([publisher], wait_s)
        now_ns = self.now_ns
        publisher.publish(message, now_ns, now_ns)
        self._step(0.0)
        return publisher.subscriptions > 0

    def wait_for_subscribers(self, publishers: Iterable[Publisher], wait_s: float) -> bool:
        """Waits until each of them has a subscriber, and all nodes that run and subscribe to it; whether one has.

        In simulated time it also waits until that is known.
        """
        offered = list(publishers)
        running = running_nodes(self._folder)
        expected = {one.name: {node.node for node in running if one.name in node.subscribes} for one in offered}

        def is_on() -> bool:
            knows_the_time = self._now_ns > 0 or not self.is_simulated
            return knows_the_time and all(
                one.subscriptions and expected[one.name] <= one.subscribers for one in offered
            )

        self._until(is_on, wait_s)
        return any(one.subscriptions for one in offered)

    def idle(self, seconds: float) -> None:
        """Waits, while new subscribers are served."""
        self._until(lambda: False, seconds)

    def send_goal(self, goal: Any, timeout_s: float = 60.0) -> RelocationStatus:
        """Sends a goal to the robot's synthesizer, and waits for its last state: succeeded, failed or rejected.

        For a launch file in which no node sends goals and `external` names `relocation/goal`. A goal moves an arm only
        while it is armed.

        Args:
            goal: A RelocationGoal, or its fields. Without an id it gets one.
            timeout_s: For the last state.

        Raises:
            NoMessageError: It has not come to an end in time.
            TopicTakenError, InputError: As for `publish`.
        """
        message = RelocationGoal()
        message.CopyFrom(message_of(RelocationGoal, goal) if isinstance(goal, str | Mapping) else goal)
        message.id = message.id or f"{self.name} {time.monotonic_ns()}"
        message.attempt = message.attempt or 1
        status_topic = self._subscribe(self._named(topics.RELOCATION_STATUS))
        self._queue_of(status_topic).clear()
        until_s, latest = time.monotonic() + timeout_s, RelocationStatus()
        while time.monotonic() < until_s:
            if latest.state == RelocationStatus.STATE_UNSPECIFIED:  # repeated until it is acknowledged
                self.publish(topics.RELOCATION_GOAL, message, wait_s=_REPEAT_S)
            for received in self.listen(status_topic.name, seconds=_REPEAT_S):
                status: RelocationStatus = received.message
                if status.goal_id == message.id:
                    latest = status
                    if latest.state in LAST_STATES:
                        return latest
        state = RelocationStatus.State.Name(latest.state).removeprefix("STATE_").lower()
        raise NoMessageError(f"goal {message.id!r} has not ended within {timeout_s:g} s; its state is {state}")

    def stop(self, timeout_s: float = 2.0) -> SafetyState:
        """Stops all arms of the run; returns the answer of the gate in this namespace, or else of the first.

        Raises NoMessageError if one has not answered in time: then nobody knows that its arm stops. TopicTakenError as
        `stop_arms` does.
        """
        answers = stop_arms(self._folder, f"program {self.name}", timeout_s)
        answered = {namespace: answer for namespace, answer in answers.items() if answer is not None}
        if silent := [namespace for namespace in answers if namespace not in answered]:
            whose = f" of {', '.join(silent)}" if any(silent) else ""
            raise NoMessageError(
                f"no safety gate{whose} has answered the stop within {timeout_s:g} s: the arm may still move; use the "
                "switch of the motors' power"
            )
        return answered.get(self.namespace) or next(iter(answered.values()))

    def _named(self, topic: str | Topic) -> Topic:
        """A topic by its name on the bus, or by that in this connection's namespace."""
        row = topics.named(topic)
        return row if topics.split_name(row.name)[0] else topics.topic_in(self.namespace, row)

    def _subscribe(self, topic: Topic) -> Topic:
        if topic.name not in self._subscribers:
            self._subscribers[topic.name] = self._visitor.subscriber(topic)
        return topic

    def offer(self, topic: Topic) -> Publisher:
        """Becomes the publisher of a topic, if it is not yet; subscribers connect from now on. Raises as `publish`."""
        if topic.reserved_for:
            raise InputError(f"{topic.name} is for {topic.reserved_for}")
        if topic.name not in self._publishers:
            self._publishers[topic.name] = self._visitor.publisher(topic)
        return self._publishers[topic.name]

    def _until(self, is_it: Callable[[], bool], timeout_s: float) -> None:
        until_s = time.monotonic() + timeout_s
        while not is_it():
            left_s = until_s - time.monotonic()
            if left_s <= 0.0:
                return
            self._step(left_s)

    def _step(self, timeout_s: float) -> None:
        """Waits until something can be read, a little at most, and reads it; raises NotConnectedError."""
        _ = self._visitor
        for publisher in self._publishers.values():
            publisher.serve()
        inspection.wait(self._subscribers.values(), min(_SERVE_S, timeout_s))
        for name, subscriber in self._subscribers.items():
            while (received := subscriber.receive()) is not None:
                self._latest[name] = received
                if name in self._queues:
                    self._queues[name].append(received)
        if topics.CLOCK.name in self._latest:
            self._now_ns = self._latest[topics.CLOCK.name].message.time_ns
