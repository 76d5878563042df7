"""Shows a run in the terminal: the story as lines, the nodes as a live table or as lines at each change."""

from __future__ import annotations

import signal
import time
from collections.abc import Iterable

import psutil
from rich.console import Console
from rich.live import Live
from rich.table import Table
from rich.text import Text

from paramove.documents import printable
from paramove.supervision.queued_output import QueuedOutput
from paramove.supervision.supervised_node import ENDED, State, SupervisedNode

_STYLES = {
    State.READY: "green",
    State.FINISHED: "green",
    State.DEGRADED: "yellow",
    State.STARTING: "cyan",
    State.SUSPENDED: "yellow",
    State.RESTARTING: "yellow",
    State.FAILED: "red",
    State.GIVEN_UP: "bold red",
}
_NOTABLE = (State.RESTARTING, State.GIVEN_UP, State.FAILED, State.DEGRADED)
REFRESH_S = 0.5


class LineView:
    """One line per event, for logs and pipes.

    Args:
        console: Prints.
        output: Queue of the console's output, where a terminal may block.
    """

    def __init__(self, console: Console, output: QueuedOutput | None = None) -> None:
        self._console = console
        self._output = output
        self._begun_s = time.monotonic()

    @property
    def closed_by(self) -> signal.Signals | None:
        """As `QueuedOutput.closed_by`."""
        return self._output.closed_by if self._output is not None else None

    def changed(self, node: SupervisedNode) -> None:
        """`12.3 s  camera  ready  detail`."""
        style = _STYLES.get(node.state, "")
        state = Text(f"{node.state.value:<11}", style=style)
        self._line(Text.assemble(f"{node.name:<16} ", state, f" {node.detail}"))

    def story(self, text: str) -> None:
        """The robot's speech or a new stage, in bold."""
        self._line(Text(printable(text), style="bold"))

    def problem(self, text: str) -> None:
        """Something went wrong."""
        self._line(Text(text, style="red"))

    def refresh(self, nodes: Iterable[SupervisedNode]) -> None:
        """Lines do not change once they are written."""

    def close(self) -> None:
        """Nothing to close."""

    def _line(self, text: Text) -> None:
        stamp = Text(f"{time.monotonic() - self._begun_s:7.1f} s  ", style="dim")
        self._console.print(Text.assemble(stamp, text), soft_wrap=True)


class TableView(LineView):
    """The story scrolls above a table of the nodes; states appear in the table only."""

    def __init__(self, console: Console, output: QueuedOutput | None = None) -> None:
        super().__init__(console, output)
        self._live = Live(console=console, auto_refresh=False)
        self._live.start()
        self._gauges: dict[str, _Gauge] = {}
        self._nodes: list[SupervisedNode] = []
        self._refreshed_s = 0.0

    def changed(self, node: SupervisedNode) -> None:
        """Prints a line for notable changes only."""
        if node.event in ("suspended", "resumed", "fault") or node.state in _NOTABLE:
            super().changed(node)

    def refresh(self, nodes: Iterable[SupervisedNode]) -> None:
        """Redraws the table, at most twice a second and no faster than the terminal takes it."""
        self._nodes = list(nodes)
        now_s = time.monotonic()
        if now_s - self._refreshed_s < REFRESH_S or (self._output is not None and self._output.is_behind):
            return
        self._refreshed_s = now_s
        self._live.update(self._table(self._nodes, now_s), refresh=True)

    def close(self) -> None:
        """Draws the table for the last time."""
        self._live.update(self._table(self._nodes, time.monotonic()), refresh=True)
        self._live.stop()

    def _table(self, nodes: Iterable[SupervisedNode], now_s: float) -> Table:
        table = Table(box=None, pad_edge=False, expand=True)
        for header in ("node", "state"):
            table.add_column(header, no_wrap=True)
        for header in ("per s", "lost", "CPU %", "MB", "restarts"):
            table.add_column(header, justify="right", no_wrap=True)
        table.add_column("message", ratio=1, no_wrap=True, overflow="ellipsis")
        for node in nodes:
            gauge = self._gauges.setdefault(node.name, _Gauge())
            style = "dim" if node.state in ENDED else _STYLES.get(node.state, "")
            table.add_row(
                node.name,
                Text(node.state.value, style=style),
                *gauge.cells(node, now_s),
                str(node.restarts or ""),
                Text(node.detail),
            )
        return table


class _Gauge:
    """Measures one node again and again."""

    def __init__(self) -> None:
        self._process: psutil.Process | None = None
        self._processed = 0
        self._read_s = 0.0
        self._rate_hz = 0.0

    def cells(self, node: SupervisedNode, now_s: float) -> tuple[str, str, str, str]:
        """Rate, loss, CPU, memory as text; empty for a node that does not run.

        The rate is from the node's count of handled messages since its last change.
        """
        if node.process is None:
            self._process = None
            return ("", "", "", "")
        try:
            if self._process is None or self._process.pid != node.process.pid:
                self._process = psutil.Process(node.process.pid)
                self._processed, self._read_s, self._rate_hz = 0, now_s, 0.0
            cpu, memory = self._process.cpu_percent(), self._process.memory_info().rss / 2**20
        except psutil.Error:  # it has just ended
            self._process = None
            return ("", "", "", "")
        if node.status.processed != self._processed:
            self._rate_hz = (node.status.processed - self._processed) / max(now_s - self._read_s, 1e-3)
            self._processed, self._read_s = node.status.processed, now_s
        lost = sum(count.lost for count in node.status.received)
        return (f"{self._rate_hz:.0f}", str(lost), f"{cpu:.0f}", f"{memory:.0f}")
