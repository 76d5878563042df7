"""`paramove launch --view`: the page's overlay, and its link for the person at the terminal."""

from __future__ import annotations

import json
import os
import signal
import sys
import threading
import webbrowser
from collections.abc import Iterable, Sequence
from pathlib import Path

from paramove.dashboard.link_file import link_in
from paramove.supervision.launch_file import load
from paramove.supervision.supervised_node import SupervisedNode
from paramove.supervision.supervisor import View

OVERLAY = "view"


def with_page(folder: Path, name: str, overlays: Sequence[str] | None) -> tuple[list[str], str]:
    """The overlays of a launch file, its default ones if None, with the page's on top; and the setting of its title."""
    launch = load(folder, name, overlays)
    title = (launch.file.description or launch.name.replace("_", " "))[:80]
    return [*launch.overlays, OVERLAY], f"dashboard.title={json.dumps(title)}"


class AnnouncingView:
    """Another view that also tells the page's link as soon as there is one, and opens it where there is a display.

    Args:
        view: Shows the run.
        run_folder: The page leaves its link there.
    """

    def __init__(self, view: View, run_folder: Path) -> None:
        self._view = view
        self._run_folder = run_folder
        self._told = False

    @property
    def closed_by(self) -> signal.Signals | None:
        """As the other view."""
        return self._view.closed_by

    def changed(self, node: SupervisedNode) -> None:
        """As the other view."""
        self._view.changed(node)

    def story(self, text: str) -> None:
        """As the other view."""
        self._view.story(text)

    def problem(self, text: str) -> None:
        """As the other view."""
        self._view.problem(text)

    def refresh(self, nodes: Iterable[SupervisedNode]) -> None:
        """As the other view; looks for the link."""
        if not self._told and (link := link_in(self._run_folder)):
            self._told = True
            self._view.story(f"live page: {link}")
            if _has_display():
                threading.Thread(target=webbrowser.open, args=(link,), daemon=True).start()  # it may take seconds
        self._view.refresh(nodes)

    def close(self) -> None:
        """As the other view."""
        self._view.close()


def _has_display() -> bool:
    """Whether a person sits at this machine's screen and looks at this terminal."""
    return sys.stdout.isatty() and bool(os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY"))
