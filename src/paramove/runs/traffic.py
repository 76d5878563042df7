"""Rates and losses of every recorded topic, from the recording alone, in the run's own time."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from paramove.bus import topics
from paramove.documents import read_document
from paramove.recording import Recorded
from paramove.supervision import InterfaceError, read_interface
from paramove.workspace import Workspace


@dataclass
class TopicTraffic:
    """Publication times and sequence numbers of one topic, in order."""

    publish_ns: list[int] = field(default_factory=list)
    sequence: list[int] = field(default_factory=list)

    @property
    def lost(self) -> int:
        """Messages missing between the recorded ones. A publisher that started again begins a new count."""
        steps = [after - before for before, after in zip(self.sequence, self.sequence[1:], strict=False)]
        return sum(step - 1 for step in steps if step > 1) + (self.sequence[0] - 1 if self.sequence else 0)

    @property
    def rate_hz(self) -> float | None:
        """Mean rate between the first and the last message; None for fewer than two."""
        if len(self.publish_ns) < 2 or self.publish_ns[-1] == self.publish_ns[0]:
            return None
        return 1e9 * (len(self.publish_ns) - 1) / (self.publish_ns[-1] - self.publish_ns[0])

    @property
    def longest_gap_s(self) -> float:
        """Longest time between two messages, s."""
        gaps = [after - before for before, after in zip(self.publish_ns, self.publish_ns[1:], strict=False)]
        return 1e-9 * max(gaps, default=0)


class Traffic:
    """Counts every message of a recording."""

    def __init__(self) -> None:
        self.topics: dict[str, TopicTraffic] = {}
        self.last_ns = 0

    def take(self, recorded: Recorded) -> None:
        """Count a message."""
        topic = self.topics.setdefault(recorded.topic, TopicTraffic())
        topic.publish_ns.append(recorded.publish_ns)
        topic.sequence.append(recorded.sequence)
        self.last_ns = max(self.last_ns, recorded.publish_ns)

    def cut(self, end_ns: int) -> None:
        """Drop what was published at `end_ns` and later."""
        for topic in self.topics.values():
            n_before = sum(time_ns < end_ns for time_ns in topic.publish_ns)
            del topic.publish_ns[n_before:], topic.sequence[n_before:]

    def rates(self, publishers: dict[str, str]) -> dict[str, dict[str, Any]]:
        """Topic -> node, declared and measured rate, messages, longest gap."""
        return {
            name: {
                "node": publishers.get(name, ""),
                "declared_hz": topics.by_name(name).rate_hz,
                "measured_hz": topic.rate_hz,
                "messages": len(topic.sequence),
                "longest_gap_s": topic.longest_gap_s,
            }
            for name, topic in sorted(self.topics.items())
        }

    def loss(self) -> dict[str, Any]:
        """Messages that the recorder did not get, per topic and in total."""
        lost = {name: topic.lost for name, topic in sorted(self.topics.items())}
        return {"total": sum(lost.values()), "topics": lost}


def publishers_of(launch_file: Path, workspace: Workspace) -> dict[str, str]:
    """Topic -> name of the node that publishes it, from a run's effective launch file. Skips unreadable interfaces."""
    publishers: dict[str, str] = {}
    if not launch_file.is_file():
        return publishers
    launch = read_document(launch_file, "launch file of a run").data
    for node, settings in launch.get("nodes", {}).items():
        try:
            interface = read_interface(settings["module"], workspace)
        except (InterfaceError, KeyError):
            continue
        remaps, namespace = settings.get("remaps", {}), settings.get("namespace", "")
        publishers |= {topics.name_on_bus(topic.name, remaps, namespace): node for topic in interface.publishes}
        publishers[topics.status(node).name] = node
    return publishers
