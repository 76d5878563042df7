"""Prompts to a person who sets something up: in the terminal, and on request on a page in the browser."""

from __future__ import annotations

import contextlib
import itertools
import os
import sys
import tempfile
import threading
import webbrowser
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, TypeVar

import typer

from paramove.documents import printable

if TYPE_CHECKING:
    from paramove.dashboard import SetUpPage

Item = TypeVar("Item")
FOLDER_VARIABLE = "PARAMOVE_SET_UP_PAGE"
"""Folder that commands share, one after the other, so that one page in the browser follows them all."""
ViewOption = Annotated[bool, typer.Option("--view", help="also show picture and prompts on a page in the browser")]


class Prompts:
    """Shows prompts in the terminal, and on the page if there is one.

    Attributes:
        page: In the browser; None without.
    """

    def __init__(self, page: SetUpPage | None = None) -> None:
        self.page = page

    def prompt(self, sentence: str, happened: str = "") -> None:
        """What has just happened, if anything, and what to do now."""
        self.report(happened)
        typer.echo(printable(sentence))
        if self.page is not None:
            self.page.prompt(sentence)

    def report(self, happened: str) -> None:
        """What has just happened; nothing for ""."""
        if happened:
            typer.echo(printable(happened))
        if self.page is not None:
            self.page.report(happened)


def begun(items: Iterator[Item]) -> Iterator[Item]:
    """The same, with the first one there already: a camera that is missing is noticed before the first prompt."""
    return itertools.chain(list(itertools.islice(items, 1)), items)


def open_where_displayed(link: str) -> None:
    """Opens the link in a browser if a person at this machine's screen uses this terminal."""
    if sys.stdout.isatty() and (os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")):
        threading.Thread(target=webbrowser.open, args=(link,), daemon=True).start()  # it may take seconds


@contextlib.contextmanager
def prompts(title: str, view: bool) -> Iterator[Prompts]:
    """While the block lasts the page is there, if `view` or the launch of a run requests it."""
    shared = os.environ.get(FOLDER_VARIABLE)
    if not view and not shared:
        yield Prompts()
        return
    from paramove.dashboard import PageServer, SetUpPage

    with contextlib.ExitStack() as left:
        folder = Path(shared or left.enter_context(tempfile.TemporaryDirectory()))
        server = left.enter_context(PageServer(folder, followed=bool(shared)))
        typer.echo(f"live page: {server.link}")
        open_where_displayed(server.link)
        yield Prompts(SetUpPage(server, title))
