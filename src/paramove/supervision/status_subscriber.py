"""Hears what nodes say of themselves and what the robot says, for the supervisor."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from pathlib import Path

from paramove.bus import BusSettings, Exchange, Received, topics
from paramove.msgs.node_status_pb2 import NodeStatus


class StatusSubscriber:
    """Subscribes to the status of every node and to the story of the run. Never waits.

    Args:
        folder: Bus folder.
        nodes: Names whose status is heard.
        on_status: Gets each NodeStatus.
        on_story: Gets each sentence of the robot and each new stage of the application.
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
        self._told = ""

    def listen(self) -> None:
        """Handles all that has come in."""
        self._exchange.wait(0.0)
        for heard in self._exchange.take(topic.name for topic in self._topics):
            self._handle(heard)

    def close(self) -> None:
        """Closes all sockets."""
        self._exchange.close()

    def _handle(self, heard: Received) -> None:
        if heard.topic.type is NodeStatus:
            self._on_status(heard.message)
        elif heard.topic is topics.SPEECH:
            self._on_story(f'robot: "{heard.message.sentence}"')
        else:
            stage = heard.message.Stage.Name(heard.message.stage).removeprefix("STAGE_").lower()
            if stage != self._told:
                self._told = stage
                self._on_story(f"stage: {stage}")
