"""Messages between processes and between hosts: objects in JSON, checked as a whole before anything uses them.

A kind of message is a class derived from `Message`. `MessageReader` bounds length and nesting before it parses, and
knows what may come; texts that came from outside are made printable here, so that none reaches a terminal as a command.
"""

from __future__ import annotations

import re
from typing import Annotated, Any, Generic, TypeVar, Union

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field, TypeAdapter, ValidationError

from paramove.documents.wording import findings, printable

MAX_DEPTH = 24
MAX_PARTS = 20_000
"""Texts, commas and brackets of a message; the largest launch file of this project has 500. Each may be an error, and
pydantic needs 10 µs and 1 kB for each."""
LONGEST_TEXT = 2000
_PARTS = re.compile(rb'"(?:[^"\\]++|\\.)*+"?|[\[{]|[]}]|,', re.DOTALL)


class Message(BaseModel):
    """One message. Other keys, other types and numbers that are not finite are rejected."""

    model_config = ConfigDict(extra="forbid", strict=True, frozen=True, allow_inf_nan=False)

    def line(self) -> bytes:
        """The message as JSON, without line breaks."""
        return self.model_dump_json().encode()


class MessageError(ValueError):
    """Something that came is no message that may come; the text is printable and says why.

    Attributes:
        content: How it begins, printable.
    """

    def __init__(self, reason: str, content: bytes = b"") -> None:
        super().__init__(_cut(reason))
        self.content = printable(content[:200].decode("utf-8", "replace"))[:80]


def _printable(value: Any) -> Any:
    return _cut(value) if isinstance(value, str) else value


def _cut(text: str) -> str:
    """The text printable, and cut before and after: an escape is longer than what it stands for."""
    return printable(text[:LONGEST_TEXT])[:LONGEST_TEXT]


def _printable_lines(value: Any) -> Any:
    return "\n".join(map(printable, value.split("\n"))) if isinstance(value, str) else value


Text = Annotated[str, BeforeValidator(_printable)]
"""A text for people: printable, and cut to `LONGEST_TEXT` characters."""
Lines = Annotated[str, BeforeValidator(_printable_lines)]
"""Lines for people: all but the line breaks is printable."""
Pid = Annotated[int, Field(ge=2, le=2**22)]
"""Of a process, or of a process group, that may get a signal; Linux gives no larger ones."""

Kind = TypeVar("Kind", bound=Message)


class MessageReader(Generic[Kind]):
    """Reads the messages of one direction of a connection.

    Args:
        kinds: Those that may come. If there are several, each has a field `kind` with a value of its own.
        max_bytes: Of a message.

    Attributes:
        kinds: As given.
    """

    def __init__(self, *kinds: type[Kind], max_bytes: int) -> None:
        self.kinds, self.max_bytes = kinds, max_bytes
        several: Any = Annotated[Union[kinds], Field(discriminator="kind")]  # noqa: UP007 (made of a tuple)
        self._adapter: TypeAdapter[Kind] = TypeAdapter(several if len(kinds) > 1 else kinds[0])

    def read(self, content: bytes) -> Kind:
        """The message; raises MessageError for anything else."""
        if len(content) > self.max_bytes:
            raise MessageError(f"{len(content)} bytes, allowed are {self.max_bytes}", content)
        fault = _form_fault(content)
        if fault:
            raise MessageError(fault, content)
        try:
            return self._adapter.validate_json(content)
        except ValidationError as error:
            raise MessageError(findings(error), content) from error


def _form_fault(content: bytes) -> str:
    """Whether lists and objects are nested too deep, or have too many parts; "" if neither."""
    if content.count(b"[") + content.count(b"{") + content.count(b",") <= MAX_DEPTH:
        return ""
    depth = 0
    for number, match in enumerate(_PARTS.finditer(content)):
        if number == MAX_PARTS:
            return f"more than {MAX_PARTS} parts"
        first = match[0][:1]
        if first in b"[{":
            depth += 1
            if depth > MAX_DEPTH:
                return f"nested more than {MAX_DEPTH} deep"
        elif first in b"]}":
            depth -= 1
    return ""
