"""The person at the terminal: keys where there is one, lines where another program writes."""

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
"""Between two measurements: a joint that is moved by hand turns by a few degrees."""
UP_AND_CLEAR = "\x1b[1A\x1b[2K"
DONE, QUIT = ("\n", "\r"), ("q", "\x03", "\x04")


class QuitError(Exception):
    """The person wants to end, or the input has ended."""


class TerminalPerson:
    """Asks on the standard output and reads the standard input, never the whole keyboard; a closed one has ended.

    At a terminal Enter confirms and q ends. Otherwise lines do: an empty one or "q"; after any other line one more
    measurement is printed, and the wait continues.
    """

    def __init__(self, source: IO[Any] | None = None) -> None:
        self._source = source or sys.stdin or io.StringIO()

    @property
    def is_at_terminal(self) -> bool:
        """Whether a person can press keys: the input is a terminal, and no file, pipe or closed one."""
        return self._source.isatty()

    def tell(self, message: str) -> None:
        """Prints a message that needs no answer."""
        typer.echo(printable(message))

    def until_done(self, request: str, look: Callable[[], list[str]]) -> None:
        """Prints a request and calls `look` again and again until it is done. Raises QuitError."""
        prompt = f"{printable(request)} Enter when it is done, q to end."
        if self.is_at_terminal:
            self._keys(prompt, look)
        else:
            typer.echo(prompt)
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

    def _keys(self, prompt: str, look: Callable[[], list[str]]) -> None:
        n_displayed = 0
        with self.pressing() as pressed:  # drops what was typed before, and nothing after
            typer.echo(prompt)
            while True:
                lines = look()
                if sys.stdout.isatty():
                    typer.echo(
                        UP_AND_CLEAR * n_displayed + "".join(f"  {printable(line)}\n" for line in lines), nl=False
                    )
                    n_displayed = len(lines)
                if pressed(PERIOD_S) in DONE:
                    return

    def _lines(self, look: Callable[[], list[str]]) -> None:
        look()
        while (line := self._line(look)).strip():
            if line.strip() in QUIT:
                raise QuitError
            for measured in look():
                typer.echo(f"  {printable(measured)}")
        if not line:
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
def _unbuffered(descriptor: int) -> Iterator[None]:
    """The terminal gives each key at once, and does not echo it; restored afterwards."""
    before = termios.tcgetattr(descriptor)
    tty.setcbreak(descriptor)
    try:
        yield
    finally:
        termios.tcsetattr(descriptor, termios.TCSANOW, before)  # without waiting for output
