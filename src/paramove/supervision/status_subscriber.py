"""Subscribes to the statuses of nodes and the robot's speech, for the supervisor."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from pathlib import Path

from paramove.bus import BusSettings, Exchange, Received, topics
from paramove.msgs.node_status_pb2 import NodeStatus


class StatusSubscriber:
    """Subscribes to the status of every node, the robot's speech and the application's stage. Never waits.

    Args:
        folder: Bus folder.
        nodes: Names of the nodes.
        on_status: Gets each NodeStatus.
        on_story: Gets each spoken sentence of the robot and each new stage of the application.
    """

    def __init__(
        self,
        folder: Path,
        nodes: Iterable[str],
        on_status: Callable[[NodeStatus], None],
        on_story: Callable[[str], None],
    ) -> None:
        self._exchange = Exchange("supervisor", BusSettings(folder=folder))
        self._topics = [topics.SPEECH, topics.APPLICATION_STAGE, *map(topics.status, nodes)]
        for topic in self._topics:
            self._exchange.subscribe(topic)
        self._on_status = on_status
        self._on_story = on_story
        self._stage = ""

    def listen(self) -> None:
        """Handles all that has come in."""
        self._exchange.wait(0.0)
        for received in self._exchange.take(topic.name for topic in self._topics):
            self._handle(received)

    def close(self) -> None:
        """Closes all sockets."""
        self._exchange.close()

    def _handle(self, received: Received) -> None:
        if received.topic.type is NodeStatus:
            self._on_status(received.message)
        elif received.topic is topics.SPEECH:
            self._on_story(f'robot: "{received.message.text}"')
        else:
            stage = received.message.Stage.Name(received.message.stage).removeprefix("STAGE_").lower()
            if stage != self._stage:
                self._stage = stage
                self._on_story(f"stage: {stage}")
