"""Errors that the user of the emulator can correct."""

from __future__ import annotations

import difflib
from collections.abc import Iterable


class EmulatorError(ValueError):
    """The emulator cannot use a file, a port or a command; the message is one line and names what is valid.

    Attributes:
        missing: Whether the named file, port or emulator does not exist.
    """

    def __init__(self, message: str, missing: bool = False) -> None:
        super().__init__(" ".join(message.split()))
        self.missing = missing


class EmulatorStoppedError(RuntimeError):
    """The emulated servos have stopped while they ran: their world became unstable, or their terminal went away."""


def suggestion(word: str, known: Iterable[str]) -> str:
    """Suggests the closest known word, or lists all of them, as a phrase for an error message."""
    choices = sorted(known)
    close = difflib.get_close_matches(word, choices, n=1)
    return f"did you mean {close[0]!r}?" if close else f"there are: {', '.join(choices)}"
