"""State of a node, published once a second."""

from __future__ import annotations

import logging
import os

from paramove.bus.endpoint import Ownership
from paramove.bus.exchange import Exchange
from paramove.bus.sequence import SequenceCounter
from paramove.bus.topics import status
from paramove.msgs.node_status_pb2 import NodeParameter, NodeStatus, TopicCount

_log = logging.getLogger(__name__)


MAX_MESSAGE_LENGTH = 4000
"""Characters; an exception may carry a whole document."""


class StatusReporter:
    """Publishes `status/<node>`.

    Attributes:
        state: Latest state published.
        processing_ns: Time the node has spent on messages and ticks, on the wall clock.
        processed: How many it has handled.
        parameters: Those of the node that may change while it runs.
    """

    def __init__(self, exchange: Exchange, node: str) -> None:
        self._exchange = exchange
        self._publisher = exchange.advertise(status(node))
        self._node = node
        self.state: NodeStatus.State = NodeStatus.STATE_STARTING
        self._message = ""
        self.processing_ns = 0
        self.processed = 0
        self.parameters: list[NodeParameter] = []

    @property
    def ownership(self) -> Ownership:
        """Of the status topic."""
        return self._publisher.ownership

    @property
    def has_subscriber(self) -> bool:
        """Whether anybody has subscribed; from then on the latest state has been sent, as the topic is latched."""
        return self._publisher.subscriptions > 0

    def change(self, state: NodeStatus.State, message: str, now_ns: int) -> None:
        """Publishes a state and its message at once, if they are new."""
        message = message[:MAX_MESSAGE_LENGTH]
        if (state, message) == (self.state, self._message) and self._publisher.sequence:
            return
        self.state, self._message = state, message
        _log.info("%s: %s", NodeStatus.State.Name(state).removeprefix("STATE_").lower(), message)
        self.publish(now_ns)

    def publish(self, now_ns: int) -> None:
        """Publishes the present state and counts."""
        cut_off = [one.cut_off for one in self._exchange.subscribers.values() if one.cut_off]
        works = self.state in (NodeStatus.STATE_READY, NodeStatus.STATE_DEGRADED)
        status_message = NodeStatus(
            node=self._node,
            state=NodeStatus.STATE_DEGRADED if cut_off and works else self.state,
            detail="; ".join([*cut_off, self._message]) + self._unconnected(),
            pid=os.getpid(),
            processing_seconds=self.processing_ns * 1e-9,
            processed=self.processed,
            parameters=self.parameters,
        )
        status_message.captured.FromNanoseconds(now_ns)
        for publisher in self._exchange.publishers.values():
            status_message.published.append(TopicCount(topic=publisher.name, messages=publisher.sequence))
        for subscriber in self._exchange.subscribers.values():
            status_message.received.append(_count(subscriber.name, subscriber.counter))
        self._publisher.publish(status_message, now_ns, now_ns)

    def _unconnected(self) -> str:
        missing = [f"{node} ({', '.join(names)})" for node, names in self._exchange.unconnected().items()]
        return f"; not connected with {', '.join(missing)}" if missing else ""


def _count(name: str, counter: SequenceCounter) -> TopicCount:
    return TopicCount(
        topic=name,
        messages=counter.messages,
        lost=counter.lost,
        repeated_=counter.repeated,
        rejected=counter.rejected.total(),
    )
