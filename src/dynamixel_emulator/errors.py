"""What a user of the emulator did wrong."""

from __future__ import annotations

import difflib
from collections.abc import Iterable


class EmulatorError(ValueError):
    """A file, a port or a command that the emulator cannot use; one line with what would work.

    Attributes:
        missing: Whether what was named does not exist.
    """

    def __init__(self, message: str, missing: bool = False) -> None:
        super().__init__(" ".join(message.split()))
        self.missing = missing


def nearest(word: str, known: Iterable[str]) -> str:
    """The nearest of the known words, otherwise all of them, as a phrase for an error."""
    choices = sorted(known)
    close = difflib.get_close_matches(word, choices, n=1)
    return f"did you mean {close[0]!r}?" if close else f"there are: {', '.join(choices)}"
