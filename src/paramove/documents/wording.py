"""Wording of messages: wrong keys of a file, suggestions of names, and text without control characters."""

from __future__ import annotations

import difflib
from collections.abc import Iterable
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from pydantic import ValidationError
    from pydantic_core import ErrorDetails

MAX_FINDINGS = 5


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


def findings(error: ValidationError) -> str:
    """Each wrong key with its location, the expected and the actual value; at most `MAX_FINDINGS`."""
    errors = error.errors()
    more = [f"and {len(errors) - MAX_FINDINGS} more"] if len(errors) > MAX_FINDINGS else []
    return "; ".join([_described(item) for item in errors[:MAX_FINDINGS]] + more)


def _described(item: ErrorDetails) -> str:
    where = ".".join(map(str, item["loc"])) or "the file"
    if item["type"] == "missing":
        return f"{where} is missing"
    expected = f"{item['msg'][:1].lower()}{item['msg'][1:]}"
    if item["type"] in ("model_type", "dict_type"):
        expected = "expected lines of `name: value`"
    found = "nothing" if item["input"] is None else f"{item['input']!r:.60}"
    return f"{where}: {expected}, found {found}"
