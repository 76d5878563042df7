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
LONGEST_TEXT = 2000
_NESTING = re.compile(rb'"(?:[^"\\]++|\\.)*+"?|[\[{]|[]}]', re.DOTALL)


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
        super().__init__(printable(reason)[:LONGEST_TEXT])
        self.content = printable(content[:200].decode("utf-8", "replace"))[:80]


def _printable(value: Any) -> Any:
    return printable(value)[:LONGEST_TEXT] if isinstance(value, str) else value


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
    """

    def __init__(self, *kinds: type[Kind], max_bytes: int) -> None:
        self.max_bytes = max_bytes
        several: Any = Annotated[Union[kinds], Field(discriminator="kind")]  # noqa: UP007 (made of a tuple)
        self._adapter: TypeAdapter[Kind] = TypeAdapter(several if len(kinds) > 1 else kinds[0])

    def read(self, content: bytes) -> Kind:
        """The message; raises MessageError for anything else."""
        if len(content) > self.max_bytes:
            raise MessageError(f"{len(content)} bytes, allowed are {self.max_bytes}", content)
        if (depth := _depth(content)) > MAX_DEPTH:
            raise MessageError(f"nested {depth} deep, allowed are {MAX_DEPTH}", content)
        try:
            return self._adapter.validate_json(content)
        except ValidationError as error:
            raise MessageError(findings(error), content) from error


def _depth(content: bytes) -> int:
    """How deep lists and objects are nested; at most their number, where that is allowed already."""
    number = content.count(b"[") + content.count(b"{")
    if number <= MAX_DEPTH:
        return number
    depth = deepest = 0
    for match in _NESTING.finditer(content):
        first = match[0][:1]
        if first in b"[{":
            depth += 1
            deepest = max(deepest, depth)
        elif first in b"]}":
            depth -= 1
    return deepest
