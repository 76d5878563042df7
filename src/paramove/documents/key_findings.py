"""Describes pydantic's validation errors of a YAML file, key by key."""

from __future__ import annotations

from pydantic import ValidationError
from pydantic_core import ErrorDetails

MAX_FINDINGS = 5


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
