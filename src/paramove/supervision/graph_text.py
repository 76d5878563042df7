"""A graph of nodes and topics as text for a terminal, and as a Mermaid flowchart for a page."""

from __future__ import annotations

import re
from collections.abc import Iterator

from paramove.supervision.graph import Edge, Graph


def as_text(graph: Graph) -> str:
    """Node by node: what it hears and from whom, what it says and to whom."""
    lines = [f"{graph.title}: {len(graph.nodes)} nodes, {len(graph.edges)} topics"]
    width = max((len(edge.label) for edge in graph.edges), default=0)
    for node, about in graph.nodes.items():
        lines += ["", f"{node}  ({about})"]
        lines += _numbered("hears", list(_heard(graph, node, width)))
        lines += _numbered("says ", list(_said(graph, node, width)))
    if graph.unsaid:
        lines += ["", "Heard, but said by nobody:"]
        lines += [f"  {edge.topic}  by {', '.join(_without(edge.heard_by, graph))}" for edge in graph.unsaid]
    return "\n".join(lines) + "\n"


def _numbered(what: str, rows: list[str]) -> Iterator[str]:
    for number, row in enumerate(rows):
        yield f"  {what if number == 0 else ' ' * len(what)}  {row}".rstrip()


def _without(nodes: tuple[str, ...], graph: Graph) -> list[str]:
    """Nodes but the collectors, unless there are only collectors."""
    return [node for node in nodes if node not in graph.collectors] or list(nodes)


def _heard(graph: Graph, node: str, width: int) -> Iterator[str]:
    heard = [edge for edge in graph.edges if node in edge.heard_by]
    if node in graph.collectors:
        yield f"{len(heard)} of {len(graph.edges)} topics"
        return
    for edge in heard:
        yield f"{edge.label:<{width}}  <- {', '.join(edge.said_by) or 'nobody (!)'}"


def _said(graph: Graph, node: str, width: int) -> Iterator[str]:
    for edge in graph.edges:
        if node in edge.said_by:
            yield f"{edge.label:<{width}}  -> {_to(graph, edge)}"


def _to(graph: Graph, edge: Edge) -> str:
    if edge.topic in graph.all_hear:
        return "all nodes"
    return ", ".join(_without(edge.heard_by, graph)) or "nobody"


def as_mermaid(graph: Graph) -> str:
    """A `flowchart LR`; topics from one node to another share an arrow, collectors get one dotted arrow each."""
    lines = ["flowchart LR"]
    lines += [f'    {_id(node)}["{node}"]' for node in graph.nodes]
    for speaker in graph.nodes:
        for hearer in graph.nodes:
            edges = graph.between(speaker, hearer)
            if not edges:
                continue
            if hearer in graph.collectors:
                edges = [edge for edge in edges if graph.only_collected(edge)]
            if edges:
                arrow = "-.->" if hearer in graph.collectors else "-->"
                label = "<br/>".join(edge.label for edge in edges)
                lines.append(f'    {_id(speaker)} {arrow}|"{label}"| {_id(hearer)}')
    for edge in graph.unsaid:
        ghost = _id(f"nobody_{edge.topic}")
        lines.append(f'    {ghost}(["{edge.topic}: said by nobody"]):::unsaid')
        lines += [f"    {ghost} -.-> {_id(hearer)}" for hearer in _without(edge.heard_by, graph)]
    lines += [f"    {_id(node)}:::collector" for node in graph.collectors]
    if graph.unsaid:
        lines.append("    classDef unsaid stroke:#c00,color:#c00,stroke-dasharray:4 3")
    if graph.collectors:
        lines.append("    classDef collector stroke-dasharray:4 3")
    return "\n".join(lines) + "\n"


def _id(name: str) -> str:
    """A name that Mermaid takes; `end` alone would end a block."""
    return "n_" + re.sub(r"\W", "_", name)
