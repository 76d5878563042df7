"""YAML 1.2 read as plain data with the position of every value."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from ruamel.yaml import YAML
from ruamel.yaml.error import MarkedYAMLError, YAMLError
from ruamel.yaml.events import (
    AliasEvent,
    CollectionEndEvent,
    CollectionStartEvent,
    DocumentStartEvent,
    Event,
    MappingStartEvent,
    NodeEvent,
    ScalarEvent,
)
from ruamel.yaml.nodes import ScalarNode
from ruamel.yaml.reader import ReaderError

from paramove.documents.files import read_text
from paramove.documents.input_error import InputError
from paramove.documents.wording import printable

MAX_CHARACTERS = 100_000
MAX_DEPTH = 20
MAX_FINDINGS = 20
"""Maximum number of findings in one message."""

KeyPath = tuple[str, ...]

_CONTROL = re.compile(r"[\x00-\x08\x0b-\x1f\x7f-\x9f\ud800-\udfff]")


@dataclass(frozen=True)
class Position:
    """Position of a value: a file (or a command-line argument), line and column from 1; line 0 means the whole."""

    source: str
    line: int = 0
    column: int = 0

    def __str__(self) -> str:
        source = printable(self.source)
        return f"{source}:{self.line}:{self.column}" if self.line else source


class DocumentError(InputError):
    """Faults in a launch file: one finding per line, each with its position.

    Attributes:
        position: Of the first finding.
        message: Of the first finding, with control characters escaped.
        others: Further findings.
    """

    def __init__(self, position: Position, message: str, others: Sequence[DocumentError] = ()) -> None:
        super().__init__(message)
        self.args = (position, message)  # what a copy in another process is made from
        self.position = position
        self.message = printable(message)
        self.others = tuple(others)

    def __str__(self) -> str:
        lines = [f"{error.position}: {error.message}" for error in self]
        hidden = len(lines) - MAX_FINDINGS
        return "\n".join(lines[:MAX_FINDINGS] + ([f"and {hidden} more"] if hidden > 0 else []))

    def __iter__(self) -> Iterator[DocumentError]:
        """Each finding."""
        return iter((self, *self.others))

    @classmethod
    def of(cls, findings: Sequence[DocumentError]) -> DocumentError:
        """One error with all findings, each once, in the order of each file; at least one is needed."""
        flat = {(one.position, one.message): one for finding in findings for one in finding}
        sources = list(dict.fromkeys(position.source for position, _ in flat))
        keys = sorted(flat, key=lambda key: (sources.index(key[0].source), key[0].line, key[0].column))
        first, *others = (flat[key] for key in keys)
        return cls(first.position, first.message, others)


def raise_any(findings: Sequence[DocumentError]) -> None:
    """Raises one DocumentError with all findings; nothing if there are none."""
    if findings:
        raise DocumentError.of(findings)


@dataclass
class Document:
    """Plain data (dict, list, scalars) and the position of every key and list element."""

    data: dict[str, Any]
    positions: dict[KeyPath, Position] = field(default_factory=dict)

    def position(self, path: KeyPath) -> Position:
        """Position of `path`, or of its nearest ancestor that was written down."""
        for length in range(len(path), -1, -1):
            if path[:length] in self.positions:
                return self.positions[path[:length]]
        return Position("launch file")

    def error(self, path: KeyPath, message: str) -> DocumentError:
        """An error at the position of `path`."""
        return DocumentError(self.position(path), message)

    def overlaid(self, top: Document) -> Document:
        """This document with `top` laid over it: mappings merge, all else is replaced, null removes a key."""
        # What is missing at the top level is missing in the launch file.
        positions = {path: position for path, position in top.positions.items() if path}
        return Document(_merged(self.data, top.data), self.positions | positions)


def _merged(base: dict[str, Any], top: dict[str, Any]) -> dict[str, Any]:
    result = dict(base)
    for key, value in top.items():
        if value is None:
            result.pop(key, None)
        elif isinstance(value, dict):
            beneath = base.get(key)
            result[key] = _merged(beneath if isinstance(beneath, dict) else {}, value)
        else:
            result[key] = value
    return result


EXAMPLE = "nodes: {camera: {...}}"


def read_mapping(text: str, source: str, *, max_characters: int = MAX_CHARACTERS, example: str = EXAMPLE) -> Document:
    """Reads a YAML text whose top level is a mapping, such as `example`.

    Tags, anchors, aliases, duplicate keys, keys that are no strings, numbers that are not finite, control characters,
    more than one document, more than `max_characters` and more than 20 levels are rejected.

    Raises DocumentError with the positions of everything that is rejected; a syntax error ends the search.
    """
    start = Position(source, 1, 1)
    data, positions = _read(text, source, max_characters)
    if data is None:
        raise DocumentError(start, f"the file is empty; expected a mapping such as '{example}'")
    if not isinstance(data, dict):
        kind = "list" if isinstance(data, list) else "single value"
        raise DocumentError(start, f"expected a mapping at the top level, found a {kind}")
    return Document(data, {(): start} | positions)


def read_document(path: Path, kind: str, raising: type[InputError] = InputError, remedy: str = "") -> Document:
    """The mapping in a YAML file; arguments as of `read_text`.

    Raises `raising` for a file that cannot be read and for what `read_mapping` rejects.
    """
    text = read_text(path, kind, raising, 4 * MAX_CHARACTERS, remedy)
    try:
        return read_mapping(text, str(path), example="name: value")
    except DocumentError as error:
        raise raising(f"{error}; expected a {kind} in YAML" + (f"; {remedy}" if remedy else "")) from error


def read_value(text: str, source: str) -> Any:
    """Reads one YAML value, such as the right side of `--set camera.rate_hz=15`; raises DocumentError."""
    try:
        return _read(text, source, MAX_CHARACTERS)[0]
    except DocumentError as error:  # lines and columns of an argument would only confuse
        raise DocumentError.of([DocumentError(Position(source), one.message) for one in error]) from error


def _read(text: str, source: str, max_characters: int) -> tuple[Any, dict[KeyPath, Position]]:
    """The value of a text, None of an empty one, and the positions of its keys and elements; raises DocumentError."""
    if len(text) > max_characters:
        raise DocumentError(Position(source), f"{len(text)} characters; at most {max_characters} are read")
    reader = _Reader(text, source)
    try:
        data = reader.document()
    except ReaderError as error:
        before = text[: error.position]
        where = Position(source, before.count("\n") + 1, len(before) - before.rfind("\n"))
        letter = text[error.position : error.position + 1]
        raise DocumentError.of([*reader.rejected, DocumentError(where, f"control character {letter!r}")]) from error
    except MarkedYAMLError as error:
        mark = error.problem_mark or error.context_mark
        where = Position(source, mark.line + 1, mark.column + 1) if mark else Position(source)
        raise DocumentError.of([*reader.rejected, DocumentError(where, _explained(error))]) from error
    except (YAMLError, RecursionError, ValueError, LookupError) as error:
        if isinstance(error, DocumentError):
            raise
        raise DocumentError(Position(source), f"cannot be read as YAML: {' '.join(str(error).split())}") from error
    raise_any(reader.rejected or reader.findings)
    return data, reader.positions


_SECOND = "expected a single document in the stream but found another document"
_EXPLANATIONS = (
    (r"found character '\\t'", "a tab: indent with spaces"),
    (r"mapping values are not allowed here", "no ': ' can stand here: wrong indentation, or a text that needs quotes"),
    (r"found character '(.)' that cannot start", r"a value that begins with '\1' needs quotes"),
    (r"found unexpected end of stream", "it ends inside quotes"),
    (r"(found unknown escape character .*)", r"\1: in double quotes write '\\\\' for '\\', or use single quotes"),
    (r"expected <block end>, but found", "wrong indentation: this line belongs to nothing above it"),
    (r"expected ',' or '(.)', but got '<stream end>'", r"it ends before a '\1'"),
)


def _explained(error: MarkedYAMLError) -> str:
    """The parser's message, for readers who do not know the grammar of YAML."""
    problem = " ".join(str(error.problem or "").split())
    for pattern, explanation in _EXPLANATIONS:
        match = re.match(pattern, problem)
        if match:
            return match.expand(explanation)
    if not problem or problem.startswith("but "):
        problem = f"{error.context or 'cannot be read as YAML'} {problem}"
    return " ".join(problem.split())


def _reason_to_reject(event: Event) -> str:
    if isinstance(event, DocumentStartEvent) and (event.version or event.tags):
        return "'%' directives are rejected: YAML 1.2 is expected"
    if isinstance(event, AliasEvent):
        return f"alias '*{event.anchor}' is rejected: write the value out"
    if isinstance(event, NodeEvent) and event.anchor is not None:
        return f"anchor '&{event.anchor}' is rejected: write the value out"
    if isinstance(event, ScalarEvent | CollectionStartEvent) and event.ctag is not None:
        tag = str(event.ctag).replace("tag:yaml.org,2002:", "!!")
        return f"tag '{tag}' is rejected: only plain values are accepted"
    if isinstance(event, ScalarEvent) and event.value == "<<" and event.style is None:
        return "merge keys '<<' are rejected: write the values out"
    return ""


class _Reader:
    """Builds plain data from the events of a text; `rejected` takes precedence over all other findings."""

    def __init__(self, text: str, source: str) -> None:
        self.positions: dict[KeyPath, Position] = {}
        self.rejected: list[DocumentError] = []
        self.findings: list[DocumentError] = []
        self._source = source
        self._yaml = YAML(typ="safe", pure=True)
        self._yaml.version = (1, 2)
        self._events: Iterator[Event] = self._yaml.parse(text)
        self._depth = 0

    def document(self) -> Any:
        """The value of the only document; None if there is none."""
        value, documents = None, 0
        for event in self._events:
            if isinstance(event, DocumentStartEvent):
                documents += 1
                if documents > 1:
                    raise DocumentError.of([*self.rejected, DocumentError(self._at(event), _SECOND)])
                self._check_allowed(event)
            elif isinstance(event, NodeEvent):
                value = self._value(event, ())
        return value

    def _value(self, event: Event, path: KeyPath) -> Any:
        """The value that begins with an event."""
        self._check_allowed(event)
        if not isinstance(event, CollectionStartEvent):
            return self._scalar(event) if isinstance(event, ScalarEvent) else None
        self._depth += 1
        if self._depth > MAX_DEPTH:
            raise DocumentError(self._at(event), f"more than {MAX_DEPTH} levels of nesting")
        value = self._mapping(path) if isinstance(event, MappingStartEvent) else self._list(path)
        self._depth -= 1
        return value

    def _list(self, path: KeyPath) -> list[Any]:
        result: list[Any] = []
        while not isinstance(event := next(self._events), CollectionEndEvent):
            child = (*path, str(len(result)))
            self.positions[child] = self._at(event)
            result.append(self._value(event, child))
        return result

    def _mapping(self, path: KeyPath) -> dict[str, Any]:
        result: dict[str, Any] = {}
        while not isinstance(event := next(self._events), CollectionEndEvent):
            key = event.value if isinstance(event, ScalarEvent) else ""
            where, child = self._at(event), (*path, key)
            self._check_allowed(event)
            if not isinstance(event, ScalarEvent) or self._tag(event) != "str":
                if isinstance(event, CollectionStartEvent):
                    self._value(event, child)
                kind = "a mapping" if isinstance(event, MappingStartEvent) else "a list"
                described = f"'{key}'" if isinstance(event, ScalarEvent) else kind
                self.findings.append(DocumentError(where, f"key {described} is no string; write it in quotes"))
            elif _CONTROL.search(key):
                self.findings.append(DocumentError(where, f"control characters in the key {key[:80]!r}"))
            elif key in result:
                first = self.positions[child]
                self.findings.append(DocumentError(where, f"duplicate key '{key}': it is in line {first.line} too"))
            else:
                self.positions[child] = where
            value = self._value(next(self._events), child)
            result.setdefault(key, value)
        return result

    def _check_allowed(self, event: Event) -> None:
        message = _reason_to_reject(event)
        if message:
            self.rejected.append(DocumentError(self._at(event), message))

    def _scalar(self, event: ScalarEvent) -> Any:
        tag = self._tag(event)
        if tag not in ("str", "int", "float", "bool", "null"):
            self._find(event, f"'{event.value}' would be a {tag}, which is not accepted; write it in quotes")
            return None
        value = event.value
        if tag != "str":
            node = ScalarNode(f"tag:yaml.org,2002:{tag}", event.value, event.start_mark, event.end_mark)
            try:
                value = self._yaml.constructor.construct_object(node, deep=True)
            except ValueError:  # more digits than Python converts
                self._find(event, f"a number of {len(event.value)} characters is rejected")
                return None
        if isinstance(value, float) and not math.isfinite(value):
            self._find(event, f"'{event.value}' is rejected: numbers are finite")
        if isinstance(value, str) and _CONTROL.search(value):
            self._find(event, f"control characters in {value[:80]!r}")
        return value

    def _tag(self, event: ScalarEvent) -> str:
        """`int` of `tag:yaml.org,2002:int`."""
        if event.ctag is not None and str(event.ctag) != "!":
            return "str"  # it is rejected elsewhere
        tag = self._yaml.resolver.resolve(ScalarNode, event.value, event.implicit)
        return str(tag).rpartition(":")[2]

    def _find(self, event: Event, message: str) -> None:
        self.findings.append(DocumentError(self._at(event), message[:300]))

    def _at(self, event: Event) -> Position:
        return Position(self._source, event.start_mark.line + 1, event.start_mark.column + 1)
