"""What does not fit in a YAML file that a person wrote, key by key."""

from __future__ import annotations

from pydantic import ValidationError
from pydantic_core import ErrorDetails

MAX_FINDINGS = 5


def findings(error: ValidationError) -> str:
    """Of each wrong key where it is, what was expected and what was found; the first few of many."""
    found = error.errors()
    more = [f"and {len(found) - MAX_FINDINGS} more"] if len(found) > MAX_FINDINGS else []
    return "; ".join([_told(item) for item in found[:MAX_FINDINGS]] + more)


def _told(item: ErrorDetails) -> str:
    where = ".".join(map(str, item["loc"])) or "the file"
    if item["type"] == "missing":
        return f"{where} is missing"
    expected = f"{item['msg'][:1].lower()}{item['msg'][1:]}"
    if item["type"] in ("model_type", "dict_type"):
        expected = "expected lines of `name: value`"
    found = "nothing" if item["input"] is None else f"{item['input']!r:.60}"
    return f"{where}: {expected}, found {found}"
