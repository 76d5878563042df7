"""A graph of nodes and topics as SVG, drawn as an N2 chart.

The nodes lie on the diagonal in the order in which data flows. What node i says to node j stands in row i and column
j: it leaves the node to the side and arrives from above, or, where it goes back to an earlier node, from below. So no
line crosses a text, whatever the graph.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from xml.sax.saxutils import escape, quoteattr

from paramove.supervision.graph import Edge, Graph

LETTER_PX = 6.4
"""Width of a letter of the sans-serif at 11 px, on the wide side."""
LINE_PX, PAD_PX, BOX_PX, MARGIN_PX, TITLE_PX = 14.0, 9.0, 34.0, 16.0, 40.0
NO_PUBLISHER, FROM_OUTSIDE = "no publisher", "from outside"
"""In the place of a node."""

_STYLE = """
    text { font: 11px "DejaVu Sans", Verdana, sans-serif; fill: #1f2933; }
    .title { font-size: 15px; font-weight: bold; }
    .node { font-size: 12px; font-weight: bold; text-anchor: middle; }
    .about { font-size: 9px; fill: #52606d; text-anchor: middle; }
    .topic { text-anchor: middle; }
    .rate, .note { fill: #7b8794; }
    .box { fill: #e3f0fb; stroke: #2b6cb0; stroke-width: 1.3; }
    .collector { fill: #f5f7fa; stroke: #7b8794; stroke-dasharray: 4 3; }
    .nobody { fill: #fdecea; stroke: #c0392b; stroke-dasharray: 4 3; }
    .label { fill: #ffffff; fill-opacity: 0.94; }
    .line { fill: none; stroke: #2b6cb0; stroke-width: 1.2; }
    .back { stroke: #b7791f; }
    .unpublished { stroke: #c0392b; stroke-dasharray: 4 3; }
    .collected { stroke: #9aa5b1; stroke-dasharray: 4 3; }
"""


@dataclass(frozen=True)
class _Box:
    """Column and row of a node; its box lies in their middle. Lengths in px."""

    left: float
    top: float
    width: float
    height: float

    @property
    def middle(self) -> tuple[float, float]:
        """Of the box, x and y."""
        return self.left + self.width / 2, self.top + self.height / 2


@dataclass(frozen=True)
class _Chart:
    """Layout: the box of each node, from the upper left on, and the text of each cell (publisher, subscriber)."""

    graph: Graph
    boxes: dict[str, _Box]
    cells: dict[tuple[str, str], list[str]]


def as_svg(graph: Graph) -> str:
    """The graph as an SVG document."""
    chart = _laid_out(graph)
    last = list(chart.boxes.values())[-1] if chart.boxes else _Box(300.0, TITLE_PX, 0.0, 0.0)
    width = last.left + last.width + MARGIN_PX
    height = last.top + last.height + MARGIN_PX + LINE_PX
    body = [*_lines(chart), *_labels(chart), *_boxes(chart)]
    remark = "right and down: onwards; left and up (brown): back; dashed: collected, or without publisher (red)"
    remark += "".join(f"; {escape(topic)}: to all nodes" for topic in sorted(graph.to_all))
    return "\n".join(
        [
            f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width:.0f} {height:.0f}" '
            f'width="{width:.0f}" height="{height:.0f}" role="img" aria-label={quoteattr(graph.title)}>',
            f"<style>{_STYLE}</style>",
            '<defs><marker id="tip" viewBox="0 0 8 8" refX="7" refY="4" markerWidth="7" markerHeight="7" '
            'orient="auto"><path d="M0 0 L8 4 L0 8 z" fill="context-stroke"/></marker></defs>',
            f'<rect width="{width:.0f}" height="{height:.0f}" fill="#ffffff"/>',
            f'<text class="title" x="{MARGIN_PX}" y="26">{escape(graph.title)}</text>',
            *body,
            f'<text class="note" x="{MARGIN_PX}" y="{height - 8:.0f}">{remark}</text>',
            "</svg>\n",
        ]
    )


def _laid_out(graph: Graph) -> _Chart:
    nobody = [NO_PUBLISHER] if graph.unpublished else []
    outside = [FROM_OUTSIDE] if graph.from_outside else []
    names = [*nobody, *outside, *graph.nodes]
    pairs = ((publisher, subscriber) for publisher in names for subscriber in names if publisher != subscriber)
    cells = {pair: lines for pair in pairs if (lines := _written(graph, *pair))}
    boxes = {}
    left, top = MARGIN_PX, TITLE_PX
    for name in names:
        column = [line for (_, subscriber), lines in cells.items() if subscriber == name for line in lines]
        row = [len(lines) for (publisher, _), lines in cells.items() if publisher == name]
        width = LETTER_PX * max(1.25 * len(name), *map(len, column), 8) + 2 * PAD_PX
        height = max(BOX_PX, LINE_PX * max(row, default=0)) + 2 * PAD_PX
        boxes[name] = _Box(left, top, width, height)
        left, top = left + width, top + height
    return _Chart(graph, boxes, cells)


def _written(graph: Graph, publisher: str, subscriber: str) -> list[str]:
    """Text of a cell."""
    if publisher in (NO_PUBLISHER, FROM_OUTSIDE):
        edges = graph.unpublished if publisher == NO_PUBLISHER else graph.from_outside
        if subscriber in graph.collectors:
            return []
        return [edge.label for edge in edges if subscriber in edge.subscribers]
    if subscriber in (NO_PUBLISHER, FROM_OUTSIDE):
        return []
    edges = graph.between(publisher, subscriber)
    if subscriber not in graph.collectors:
        return [edge.label for edge in edges]
    only: list[Edge] = [edge for edge in edges if graph.only_collected(edge)]
    more = len(edges) - len(only)
    rest = f"and {more} more" if only else f"{more} topic{'s' if more > 1 else ''}"
    return [edge.label for edge in only] + ([rest] if more else [])


def _kind(chart: _Chart, publisher: str, subscriber: str) -> str:
    if publisher == NO_PUBLISHER:
        return "line unpublished"
    if subscriber in chart.graph.collectors:
        return "line collected"
    return "line back" if chart.boxes[subscriber].left < chart.boxes[publisher].left else "line"


def _lines(chart: _Chart) -> Iterator[str]:
    """From the side of one box along its row, then along the column of the other to its upper or lower edge."""
    for publisher, subscriber in sorted(chart.cells, key=lambda cell: cell[1] not in chart.graph.collectors):
        from_x, from_y = chart.boxes[publisher].middle
        to_x, to_y = chart.boxes[subscriber].middle
        onwards = to_x > from_x
        start = from_x + (1 if onwards else -1) * (chart.boxes[publisher].width / 2 - PAD_PX / 2)
        end = to_y - (1 if onwards else -1) * (BOX_PX / 2 + 1)
        yield (
            f'<path class="{_kind(chart, publisher, subscriber)}" marker-end="url(#tip)" '
            f'd="M{start:.1f} {from_y:.1f} H{to_x:.1f} V{end:.1f}"/>'
        )


def _labels(chart: _Chart) -> Iterator[str]:
    for (publisher, subscriber), lines in chart.cells.items():
        x, _ = chart.boxes[subscriber].middle
        _, y = chart.boxes[publisher].middle
        wide = LETTER_PX * max(map(len, lines)) + 4
        high = LINE_PX * len(lines)
        yield (
            f'<rect class="label" x="{x - wide / 2:.1f}" y="{y - high / 2:.1f}" width="{wide:.1f}" '
            f'height="{high:.1f}"/>'
        )
        for number, line in enumerate(lines):
            name, _, rate = line.partition(" ")
            rest = f' <tspan class="rate">{escape(rate)}</tspan>' if rate else ""
            baseline = y - high / 2 + LINE_PX * (number + 0.78)
            yield f'<text class="topic" x="{x:.1f}" y="{baseline:.1f}">{escape(name)}{rest}</text>'


def _boxes(chart: _Chart) -> Iterator[str]:
    for name, box in chart.boxes.items():
        x, y = box.middle
        wide = box.width - PAD_PX
        kind = "nobody" if name == NO_PUBLISHER else "collector" if name in chart.graph.collectors else "box"
        yield (
            f'<rect class="{kind}" x="{x - wide / 2:.1f}" y="{y - BOX_PX / 2:.1f}" width="{wide:.1f}" '
            f'height="{BOX_PX}" rx="6"/>'
        )
        about = chart.graph.nodes.get(name, "")
        yield f'<text class="node" x="{x:.1f}" y="{y + (4 if not about else -1):.1f}">{escape(name)}</text>'
        if about:
            yield f'<text class="about" x="{x:.1f}" y="{y + 11:.1f}">{escape(about)}</text>'
