"""Nodes and topics of an application as a graph: from a launch file, or from what runs."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

from paramove.bus import CLOCK, Topic, inspection, topics
from paramove.supervision.distribution import on_bus
from paramove.supervision.interfaces import Interface
from paramove.supervision.launch_file import Launch

MANY = 10
"""A node with so many subscriptions is a collector, such as the recorder: they are counted, not drawn."""


@dataclass(frozen=True)
class Edge:
    """A topic with all its publishers and subscribers.

    Attributes:
        topic: Name on the bus.
        rate_hz: Nominal or measured; None where messages come with events.
        publishers: Nodes; none where a topic has subscribers only.
        subscribers: Nodes.
        is_from_outside: Whether persons, or programs outside of the run, publish it.
    """

    topic: str
    rate_hz: float | None
    publishers: tuple[str, ...]
    subscribers: tuple[str, ...]
    is_from_outside: bool = False

    @property
    def label(self) -> str:
        """Name and rate."""
        return self.topic if self.rate_hz is None else f"{self.topic} {self.rate_hz:.3g} Hz"


@dataclass(frozen=True)
class Graph:
    """Nodes in the order in which data flows, as far as there is one, and the topics between them.

    Attributes:
        title: Name of the launch file, or of the domain.
        nodes: Name -> what it is: its module, or its state.
        edges: In the order of the topic table.
        collectors: Nodes that subscribe to nearly everything.
        to_all: Topics that go to every node, such as the clock.
    """

    title: str
    nodes: Mapping[str, str]
    edges: tuple[Edge, ...]
    collectors: frozenset[str]
    to_all: frozenset[str] = frozenset()

    def between(self, publisher: str, subscriber: str) -> list[Edge]:
        """Topics that one node publishes and the other subscribes to."""
        return [edge for edge in self.edges if publisher in edge.publishers and subscriber in edge.subscribers]

    def only_collected(self, edge: Edge) -> bool:
        """Whether only collectors subscribe to a topic."""
        return self.collectors.issuperset(edge.subscribers)

    @property
    def unpublished(self) -> list[Edge]:
        """Topics with subscribers that nobody publishes."""
        return [edge for edge in self.edges if not edge.publishers and not edge.is_from_outside]

    @property
    def from_outside(self) -> list[Edge]:
        """Topics with subscribers that only persons, or programs outside of the run, publish."""
        return [edge for edge in self.edges if not edge.publishers and edge.is_from_outside]


def graph_of(launch: Launch, interfaces: Mapping[str, Interface]) -> Graph:
    """Graph of a checked launch file; remaps are followed, relays are no nodes of it."""
    publishers: dict[str, list[str]] = {}
    subscribers: dict[str, list[str]] = {}
    table: dict[str, Topic] = {}
    for name, interface in interfaces.items():
        for by_topic, side in ((publishers, interface.publishes), (subscribers, interface.subscribes)):
            for topic in (topic for topic in side if topic not in topics.BY_RELAYS):
                by_topic.setdefault(on_bus(launch, name, topic), []).append(name)
                table[on_bus(launch, name, topic)] = topic
    rates = {name: topic.rate_hz for name, topic in table.items()}
    modules = {name: launch.file.nodes[name].module for name in interfaces}
    title = " with ".join([launch.name, *([", ".join(launch.overlays)] if launch.overlays else [])])
    to_all = {CLOCK.name} if launch.file.bus.clock == "simulated" else set()
    return _graph(title, modules, publishers, subscribers, rates, to_all, launch.file.external)


def running_graph(folder: Path, domain: str, seconds: float) -> Graph:
    """Graph of the nodes on a bus, with rates measured for `seconds`; empty if none runs."""
    publishers: dict[str, list[str]] = {}
    subscribers: dict[str, list[str]] = {}
    states: dict[str, str] = {}
    for node, status in inspection.statuses(folder, 2.0).items():
        if status is None:
            states[node] = "not responding"
            continue
        states[node] = status.State.Name(status.state).removeprefix("STATE_").lower()
        for by_topic, counts in ((publishers, status.published), (subscribers, status.received)):
            for count in counts:
                if not count.topic.startswith("status/"):
                    by_topic.setdefault(count.topic, []).append(node)
    known = {topic.name: topic for topic in topics.TOPICS}
    measured = inspection.measure(
        folder, [known[name] for name in publishers if name in known and not known[name].truth], seconds
    )
    rates = {item.topic.name: item.rate_hz if item.topic.rate_hz else None for item in measured}
    to_all = {CLOCK.name} if CLOCK.name in publishers else set()
    return _graph(f"domain {domain}", states, publishers, subscribers, rates, to_all)


def _graph(
    title: str,
    nodes: Mapping[str, str],
    publishers: Mapping[str, list[str]],
    subscribers: Mapping[str, list[str]],
    rates: Mapping[str, float | None],
    to_all: Iterable[str],
    external: Iterable[str] = (),
) -> Graph:
    order = {topic.name: index for index, topic in enumerate(topics.TOPICS)}
    names = sorted({*publishers, *subscribers}, key=lambda name: (order.get(name, len(order)), name))
    edges = tuple(
        Edge(
            name,
            rates.get(name),
            tuple(publishers.get(name, ())),
            tuple(subscribers.get(name, ())),
            name in external or _is_of_persons(name),
        )
        for name in names
    )
    collectors = frozenset(node for node in nodes if sum(node in edge.subscribers for edge in edges) >= MANY)
    # A collector subscribes to the topics of every application; those with no other subscriber are of another one.
    edges = tuple(edge for edge in edges if edge.publishers or not collectors.issuperset(edge.subscribers))
    ordered = {node: nodes[node] for node in _flow(list(nodes), edges, collectors)}
    return Graph(title, ordered, edges, collectors, frozenset(to_all))


def _is_of_persons(name: str) -> bool:
    topic = topics.known_by(name)
    return topic is not None and topic.is_request


def _flow(nodes: list[str], edges: Iterable[Edge], collectors: frozenset[str]) -> list[str]:
    """Nodes ordered so that few topics go backwards (Eades, Lin and Smyth 1993), collectors last."""
    world = [node for edge in edges if edge.topic == CLOCK.name for node in edge.publishers]
    left = [node for node in nodes if node not in (*collectors, *world)]
    to = {(a, b) for edge in edges for a in edge.publishers for b in edge.subscribers if a != b}
    begin = world[:1]  # data comes from the publisher of the clock
    end: list[str] = []
    while left:
        inside = [(a, b) for a, b in to if a in left and b in left]
        publishes = {node: sum(a == node for a, _ in inside) for node in left}
        subscribes = {node: sum(b == node for _, b in inside) for node in left}
        sink = next((node for node in left if publishes[node] == 0), None)
        source = next((node for node in left if subscribes[node] == 0), None)
        if sink is not None:
            end.insert(0, sink)
        elif source is not None:
            begin.append(source)
        else:
            begin.append(max(left, key=lambda node: publishes[node] - subscribes[node]))
        left.remove(end[0] if sink is not None else begin[-1])
    return [*begin, *end, *(node for node in nodes if node in collectors)]


def as_text(graph: Graph) -> str:
    """Node by node: topics that it subscribes to, with publishers; topics that it publishes, with subscribers."""
    lines = [f"{graph.title}: {len(graph.nodes)} nodes, {len(graph.edges)} topics"]
    width = max((len(edge.label) for edge in graph.edges), default=0)
    for node, about in graph.nodes.items():
        lines += ["", f"{node}  ({about})"]
        lines += _numbered("subscribes", list(_subscribed(graph, node, width)))
        lines += _numbered("publishes ", list(_published(graph, node, width)))
    if graph.unpublished:
        lines += ["", "Subscribed, no publisher:"]
        lines += [f"  {edge.topic}  by {', '.join(_without(edge.subscribers, graph))}" for edge in graph.unpublished]
    return "\n".join(lines) + "\n"


def _numbered(what: str, rows: list[str]) -> Iterator[str]:
    for number, row in enumerate(rows):
        yield f"  {what if number == 0 else ' ' * len(what)}  {row}".rstrip()


def _without(nodes: tuple[str, ...], graph: Graph) -> list[str]:
    """Nodes but the collectors, unless there are only collectors."""
    return [node for node in nodes if node not in graph.collectors] or list(nodes)


def _subscribed(graph: Graph, node: str, width: int) -> Iterator[str]:
    subscribers = [edge for edge in graph.edges if node in edge.subscribers]
    if node in graph.collectors:
        yield f"{len(subscribers)} of {len(graph.edges)} topics"
        return
    for edge in subscribers:
        yield f"{edge.label:<{width}}  <- {', '.join(edge.publishers) or _nobody(edge)}"


def _nobody(edge: Edge) -> str:
    return "from outside" if edge.is_from_outside else "no publisher (!)"


def _published(graph: Graph, node: str, width: int) -> Iterator[str]:
    for edge in graph.edges:
        if node in edge.publishers:
            yield f"{edge.label:<{width}}  -> {_to(graph, edge)}"


def _to(graph: Graph, edge: Edge) -> str:
    if edge.topic in graph.to_all:
        return "all nodes"
    return ", ".join(_without(edge.subscribers, graph)) or "no subscriber"


def as_mermaid(graph: Graph) -> str:
    """A `flowchart LR`; topics from one node to another share an arrow, collectors get one dotted arrow each."""
    lines = ["flowchart LR"]
    lines += [f'    {_id(node)}["{node}"]' for node in graph.nodes]
    for publisher in graph.nodes:
        for subscriber in graph.nodes:
            edges = graph.between(publisher, subscriber)
            if not edges:
                continue
            if subscriber in graph.collectors:
                edges = [edge for edge in edges if graph.only_collected(edge)]
            if edges:
                arrow = "-.->" if subscriber in graph.collectors else "-->"
                label = "<br/>".join(edge.label for edge in edges)
                lines.append(f'    {_id(publisher)} {arrow}|"{label}"| {_id(subscriber)}')
    for edge in graph.from_outside:
        outside = _id(f"outside_{edge.topic}")
        lines.append(f'    {outside}(["{edge.topic}: from outside"])')
        lines += [f"    {outside} --> {_id(subscriber)}" for subscriber in _without(edge.subscribers, graph)]
    for edge in graph.unpublished:
        ghost = _id(f"nobody_{edge.topic}")
        lines.append(f'    {ghost}(["{edge.topic}: no publisher"]):::unpublished')
        lines += [f"    {ghost} -.-> {_id(subscriber)}" for subscriber in _without(edge.subscribers, graph)]
    lines += [f"    {_id(node)}:::collector" for node in graph.collectors]
    if graph.unpublished:
        lines.append("    classDef unpublished stroke:#c00,color:#c00,stroke-dasharray:4 3")
    if graph.collectors:
        lines.append("    classDef collector stroke-dasharray:4 3")
    return "\n".join(lines) + "\n"


def _id(name: str) -> str:
    """A name that Mermaid takes; `end` alone would end a block."""
    return "n_" + re.sub(r"\W", "_", name)
