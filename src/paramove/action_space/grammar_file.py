"""Grammars as YAML.

begin: point(a)
after:
  point(a):
    - redirect(a, b)               # a is handed over, b is new
    - withdraw(a): 2               # twice as likely
  redirect(a, b): withdraw(b)
  withdraw(b): point(a)
actions: {redirect: point_further} # a step whose name is not that of its action
switching: {share: 0.2, before: 0.1}
"""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any, NamedTuple

from paramove.action_space.grammar import NEW, Follower, Grammar, Step, Switching
from paramove.documents import (
    MAX_CHARACTERS,
    Document,
    DocumentError,
    InputError,
    KeyPath,
    nearest,
    read_mapping,
    read_text,
)

EXAMPLE = "begin: point(a)"
KEYS = ("description", "begin", "after", "actions", "switching")
_CALL = re.compile(r"\s*([A-Za-z_]\w*)\s*\(\s*([A-Za-z_]\w*(?:\s*,\s*[A-Za-z_]\w*)*)\s*\)\s*")


class GrammarError(InputError):
    """A grammar that cannot be used; the message begins with file, line and column of each error."""


class _Call(NamedTuple):
    """A step as written: redirect(a, b)."""

    name: str
    places: tuple[str, ...]


def read_grammar(path: Path) -> Grammar:
    """The grammar in a file. Raises GrammarError."""
    return parsed_grammar(read_text(path, "grammar", GrammarError, 4 * MAX_CHARACTERS), str(path))


def parsed_grammar(text: str, source: str = "grammar") -> Grammar:
    """The grammar in a YAML text. Raises GrammarError with the location, the value found and what would work."""
    try:
        return _Reading(read_mapping(text, source, example=EXAMPLE)).grammar()
    except DocumentError as error:
        raise GrammarError(str(error)) from error


class _Reading:
    """One document being read; every error is raised as DocumentError with its location."""

    def __init__(self, document: Document) -> None:
        self._data, self._error = document.data, document.error
        for key in self._data:
            if key not in KEYS:
                raise self._error((key,), f"unknown key {key!r}; {nearest(key, KEYS)}")

    def grammar(self) -> Grammar:
        after = self._mapping("after")
        heads = {}
        for key in after:
            call = self._call(key, ("after", key))
            if call.name in heads:
                raise self._error(("after", key), f"step {call.name!r} is defined twice")
            heads[call.name] = call
        numbers = {name: number for number, name in enumerate(heads)}
        actions = self._actions(numbers)
        steps = [
            Step(call.name, actions.get(call.name, call.name), call.places, self._followers(key, call, heads, numbers))
            for key, call in zip(after, heads.values(), strict=True)
        ]
        begin = tuple(numbers[one.name] for one in self._begin(heads))
        return Grammar(tuple(steps), begin, self._switching())

    def _begin(self, heads: dict[str, _Call]) -> list[_Call]:
        begin = self._data.get("begin")
        if begin is None:
            raise self._error((), f"begin is missing: it names the step that starts from the base pose, as '{EXAMPLE}'")
        entries = _entries(begin, ("begin",))
        if not entries:
            raise self._error(("begin",), "begin names at least one step")
        return [self._known(one, path, heads) for one, path in entries]

    def _followers(
        self, key: str, head: _Call, heads: dict[str, _Call], numbers: dict[str, int]
    ) -> tuple[Follower, ...]:
        entries = _entries(self._data["after"][key], ("after", key))
        if not entries:
            raise self._error(("after", key), f"nothing follows {key!r}; the last step of a movement leads to begin")
        followers = []
        for entry, where in entries:
            text, weight = self._weighted(entry, where)
            call = self._known(text, where, heads)
            binding = tuple(head.places.index(place) if place in head.places else NEW for place in call.places)
            followers.append(Follower(numbers[call.name], weight, binding))
        return tuple(followers)

    def _weighted(self, entry: Any, where: KeyPath) -> tuple[Any, float]:
        if not isinstance(entry, dict):
            return entry, 1.0
        if len(entry) != 1:
            raise self._error(where, f"expected one step with its weight, as 'withdraw(a): 2', found {entry!r:.80}")
        ((text, weight),) = entry.items()
        if isinstance(weight, bool) or not isinstance(weight, int | float) or not weight > 0.0:
            raise self._error(where, f"the weight of {text!r} is a positive number, found {weight!r:.80}")
        return text, float(weight)

    def _known(self, text: Any, where: KeyPath, heads: dict[str, _Call]) -> _Call:
        call = self._call(text, where)
        if call.name not in heads:
            message = f"step {call.name!r} is not defined under 'after', so nothing could follow it"
            raise self._error(where, f"{message}; {nearest(call.name, heads)}")
        expected = heads[call.name].places
        if len(call.places) != len(expected):
            raise self._error(
                where, f"{call.name} has {len(expected)} place(s) ({', '.join(expected)}), found {len(call.places)}"
            )
        return call

    def _call(self, text: Any, where: KeyPath) -> _Call:
        match = _CALL.fullmatch(text) if isinstance(text, str) else None
        if match is None:
            raise self._error(where, f"expected a step with its places, such as 'point(a)', found {text!r:.80}")
        places = tuple(place.strip() for place in match[2].split(","))
        if len(set(places)) < len(places):
            raise self._error(where, f"two places of {text!r} have the same name")
        return _Call(match[1], places)

    def _actions(self, numbers: dict[str, int]) -> dict[str, str]:
        actions = self._mapping("actions", {})
        for step, action in actions.items():
            if step not in numbers:
                raise self._error(("actions", step), f"there is no step {step!r}; {nearest(step, numbers)}")
            if not isinstance(action, str):
                raise self._error(("actions", step), f"expected the name of an action, found {action!r:.80}")
        return actions

    def _switching(self) -> Switching:
        values = self._mapping("switching", {})
        known = ("share", "before")
        for key, value in values.items():
            if key not in known:
                raise self._error(("switching", key), f"unknown key {key!r}; {nearest(key, known)}")
            if isinstance(value, bool) or not isinstance(value, int | float):
                raise self._error(("switching", key), f"expected a number, found {value!r:.80}")
        try:
            return Switching(**{key: float(value) for key, value in values.items()})
        except InputError as error:
            raise self._error(("switching",), str(error)) from error

    def _mapping(self, key: str, default: dict[str, Any] | None = None) -> dict[str, Any]:
        value = self._data.get(key, default)
        if not isinstance(value, dict) or (default is None and not value):
            message = f"expected {key} as a mapping, found {value!r:.80}" if value else f"{key} is missing"
            raise self._error((key,), f"{message}; it lists what may follow each step, such as 'point(a): withdraw(a)'")
        return value


def _entries(value: Any, path: KeyPath) -> list[tuple[Any, KeyPath]]:
    """The elements of a list, or the value alone, each with its path."""
    if not isinstance(value, list):
        return [(value, path)]
    return [(entry, (*path, str(index))) for index, entry in enumerate(value)]
