"""Helpers for messages: suggestions of names, and text without control characters."""

from __future__ import annotations

import difflib
from collections.abc import Iterable


def closest(word: str, known: Iterable[str]) -> list[str]:
    """The word among `known` that is nearest to `word`; none if none is near."""
    return difflib.get_close_matches(word, sorted(known), n=1, cutoff=0.6)


def nearest(word: str, known: Iterable[str]) -> str:
    """The word among `known` that is nearest to `word`, else all of them, as a phrase for an error."""
    choices = sorted(known)
    close = closest(word, choices)
    if close:
        return f"did you mean '{close[0]}'?"
    return f"there are: {', '.join(choices)}" if choices else "there are none"


def printable(text: str) -> str:
    """The text with control characters, written as escapes."""
    return "".join(letter if letter.isprintable() else repr(letter)[1:-1] for letter in text)
