"""YAML 1.2 read as plain data that remembers where every value stood."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from ruamel.yaml import YAML
from ruamel.yaml.error import MarkedYAMLError, YAMLError
from ruamel.yaml.events import (
    AliasEvent,
    CollectionEndEvent,
    CollectionStartEvent,
    DocumentStartEvent,
    NodeEvent,
    ScalarEvent,
)

MAX_CHARACTERS = 1_000_000
MAX_DEPTH = 20

KeyPath = tuple[str, ...]


@dataclass(frozen=True)
class Position:
    """Where a value was written: a file (or a command-line argument), line and column from 1; line 0 is all of it."""

    source: str
    line: int = 0
    column: int = 0

    def __str__(self) -> str:
        return f"{self.source}:{self.line}:{self.column}" if self.line else self.source


class LaunchFileError(ValueError):
    """Something in a launch file is wrong. The message begins with its position."""

    def __init__(self, position: Position, message: str) -> None:
        super().__init__(f"{position}: {message}")
        self.position = position
        self.message = message


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

    def overlaid(self, top: Document) -> Document:
        """This document with `top` laid over it: mappings merge, all else is replaced, null removes a key."""
        merged = Document(dict(self.data), dict(self.positions))
        for path, position in top.positions.items():
            merged.positions[path] = position
        merged.data = _merged(self.data, top.data)
        return merged


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


def read_mapping(text: str, source: str) -> Document:
    """Reads a YAML text whose top level is a mapping.

    Tags, anchors, aliases, duplicate keys, keys that are no strings, more than one document, more than
    1 000 000 characters and more than 20 levels are refused.

    Raises LaunchFileError with the position.
    """
    loaded = _load(text, source)
    start = Position(source, 1, 1)
    if loaded is None:
        raise LaunchFileError(start, "the file is empty; expected a mapping such as 'nodes: {camera: {...}}'")
    if not isinstance(loaded, dict):
        raise LaunchFileError(start, f"expected a mapping at the top level, found {type(loaded).__name__}")
    document = Document({}, {(): start})
    document.data = _plain(loaded, (), document.positions, source)
    return document


def read_value(text: str, source: str) -> Any:
    """Reads one YAML value, such as the right side of `--set camera.rate_hz=15`."""
    loaded = _load(text, source)
    return _plain(loaded, (), {(): Position(source)}, source)


def _load(text: str, source: str) -> Any:
    if len(text) > MAX_CHARACTERS:
        raise LaunchFileError(Position(source), f"{len(text)} characters; at most {MAX_CHARACTERS} are read")
    try:
        _refuse_unwanted(text, source)
        return _yaml().load(text)
    except MarkedYAMLError as error:
        mark = error.problem_mark or error.context_mark
        where = Position(source, mark.line + 1, mark.column + 1) if mark else Position(source)
        problem = str(error.problem or "")
        if not problem or problem.startswith("but "):
            problem = f"{error.context or 'cannot be read as YAML'} {problem}"
        raise LaunchFileError(where, " ".join(problem.split())) from error
    except (YAMLError, RecursionError) as error:
        raise LaunchFileError(Position(source), f"cannot be read as YAML: {' '.join(str(error).split())}") from error


def _yaml() -> YAML:
    yaml = YAML(typ="rt", pure=True)
    yaml.version = (1, 2)
    yaml.allow_duplicate_keys = False
    return yaml


def _refuse_unwanted(text: str, source: str) -> None:
    """Refuses what a launch file never needs, before anything is built from the text."""
    depth = 0
    for event in _yaml().parse(text):
        where = Position(source, event.start_mark.line + 1, event.start_mark.column + 1)
        if isinstance(event, DocumentStartEvent) and (event.version or event.tags):
            raise LaunchFileError(where, "'%' directives are refused: a launch file is YAML 1.2")
        if isinstance(event, AliasEvent):
            raise LaunchFileError(where, "aliases are refused: write the value out")
        if isinstance(event, NodeEvent) and event.anchor is not None:
            raise LaunchFileError(where, f"anchor '&{event.anchor}' is refused: write the value out")
        if isinstance(event, ScalarEvent | CollectionStartEvent) and event.ctag is not None:
            raise LaunchFileError(where, f"tag '{event.ctag}' is refused: launch files hold plain values only")
        if isinstance(event, ScalarEvent) and event.value == "<<" and event.style is None:
            raise LaunchFileError(where, "merge keys '<<' are refused: write the values out")
        depth += isinstance(event, CollectionStartEvent)
        depth -= isinstance(event, CollectionEndEvent)
        if depth > MAX_DEPTH:
            raise LaunchFileError(where, f"more than {MAX_DEPTH} levels of nesting")


def _plain(value: Any, path: KeyPath, positions: dict[KeyPath, Position], source: str) -> Any:
    """Builtin data of a loaded value; fills in `positions`."""
    if isinstance(value, dict):
        result = {}
        for key, item in value.items():
            line, column = value.lc.key(key)  # type: ignore[attr-defined]
            where = Position(source, line + 1, column + 1)
            if not isinstance(key, str):
                raise LaunchFileError(where, f"key {key!r} is no string; write it in quotes")
            positions[*path, str(key)] = where
            result[str(key)] = _plain(item, (*path, str(key)), positions, source)
        return result
    if isinstance(value, list):
        for index in range(len(value)):
            line, column = value.lc.item(index)  # type: ignore[attr-defined]
            positions[*path, str(index)] = Position(source, line + 1, column + 1)
        return [_plain(item, (*path, str(index)), positions, source) for index, item in enumerate(value)]
    if value is None or isinstance(value, bool):
        return value
    for builtin in (int, float, str):
        if isinstance(value, builtin):
            return builtin(value)
    raise LaunchFileError(
        next((positions[path[:n]] for n in range(len(path), -1, -1) if path[:n] in positions), Position(source)),
        f"{type(value).__name__} values are not taken; write it in quotes",
    )
