"""The person at the terminal: keys where there is one, lines where another program speaks."""

from __future__ import annotations

import contextlib
import io
import os
import select
import sys
import termios
import tty
from collections.abc import Callable, Iterator
from typing import IO, Any

import typer

from paramove.documents import printable

PERIOD_S = 0.02
"""From look to look: a joint that is moved by hand turns by a few degrees."""
UP_AND_CLEAR = "\x1b[1A\x1b[2K"
DONE, QUIT = ("\n", "\r"), ("q", "\x03", "\x04")


class QuitError(Exception):
    """The person wants to end, or the input has ended."""


class TerminalPerson:
    """Asks on the standard output and reads the standard input, never the whole keyboard; a closed one has ended.

    At a terminal Enter says that something is done, and q ends. Otherwise lines do: an empty one or "q"; after any
    other one more look is taken and printed, and the wait goes on.
    """

    def __init__(self, source: IO[Any] | None = None) -> None:
        self._source = source or sys.stdin or io.StringIO()

    @property
    def is_at_terminal(self) -> bool:
        """Whether a person can press keys: the input is a terminal, and no file, pipe or closed one."""
        return self._source.isatty()

    def tell(self, sentence: str) -> None:
        """Say something that needs no answer."""
        typer.echo(printable(sentence))

    def until_done(self, request: str, look: Callable[[], list[str]]) -> None:
        """Ask, and look again and again until it is done. Raises QuitError."""
        asked = f"{printable(request)} Enter when it is done, q to end."
        if self.is_at_terminal:
            self._keys(asked, look)
        else:
            typer.echo(asked)
            self._lines(look)

    @contextlib.contextmanager
    def pressing(self) -> Iterator[Callable[[float], str]]:
        """A function that waits so many seconds for a key and gives it, "" if none was pressed.

        It raises QuitError for q, and at the end of the input. Other programs write keys without Enter between them.
        """
        with contextlib.ExitStack() as opened:
            try:
                descriptor = self._source.fileno()
            except OSError as error:  # not a file of the system, as a closed input
                raise QuitError from error
            if self.is_at_terminal:
                opened.enter_context(_unbuffered(descriptor))

            def pressed(seconds: float) -> str:
                if not select.select([descriptor], [], [], seconds)[0]:
                    return ""
                key = os.read(descriptor, 1).decode(errors="replace")
                if key in QUIT or not key:
                    raise QuitError
                return key

            yield pressed

    def _keys(self, asked: str, look: Callable[[], list[str]]) -> None:
        shown = 0
        with _unbuffered(self._source.fileno()) as descriptor:  # drops what was typed before, and nothing after
            typer.echo(asked)
            while True:
                lines = look()
                if sys.stdout.isatty():
                    typer.echo(UP_AND_CLEAR * shown + "".join(f"  {printable(line)}\n" for line in lines), nl=False)
                    shown = len(lines)
                if select.select([descriptor], [], [], PERIOD_S)[0]:
                    key = os.read(descriptor, 1).decode(errors="replace")
                    if key in DONE:
                        return
                    if key in QUIT or not key:
                        raise QuitError

    def _lines(self, look: Callable[[], list[str]]) -> None:
        look()
        while (word := self._line(look)).strip():
            if word.strip() in QUIT:
                raise QuitError
            for line in look():
                typer.echo(f"  {printable(line)}")
        if not word:
            raise QuitError

    def _line(self, look: Callable[[], list[str]]) -> str:
        """The next line, looking while it is waited for."""
        try:
            descriptor = self._source.fileno()
        except OSError:  # not a file of the system: it is all there
            return str(self._source.readline())
        line = b""
        while not line.endswith(b"\n"):
            if not select.select([descriptor], [], [], PERIOD_S)[0]:
                look()
                continue
            byte = os.read(descriptor, 1)
            if not byte:
                break
            line += byte
        return line.decode(errors="replace")


@contextlib.contextmanager
def _unbuffered(descriptor: int) -> Iterator[int]:
    """The terminal gives each key at once, and does not show it; as it was afterwards."""
    before = termios.tcgetattr(descriptor)
    tty.setcbreak(descriptor)
    try:
        yield descriptor
    finally:
        termios.tcsetattr(descriptor, termios.TCSANOW, before)  # without waiting until all is shown
