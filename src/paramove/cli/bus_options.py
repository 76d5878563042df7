"""Options and output that the commands about the bus share."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any

import typer

from paramove.bus import Topic, running_folder, topics
from paramove.cli import completions
from paramove.cli.output import aligned, ended
from paramove.documents import InputError, exit_codes, nearest

NamespaceOption = Annotated[
    str | None,
    typer.Option(
        "--namespace", metavar="NAME", help="of the arm, where several run", autocompletion=completions.namespaces
    ),
]
DomainOption = Annotated[
    str | None,
    typer.Option(
        "--domain",
        help="domain of the bus; default $PARAMOVE_DOMAIN, else 'default'",
        autocompletion=completions.domains,
    ),
]


def bus_folder(domain: str | None) -> Path:
    """Folder of the domain's sockets; ends the command if there is none, since nothing runs there."""
    try:
        return running_folder(domain)
    except InputError as error:
        if not error.missing:
            raise
        raise ended(str(error), exit_codes.FAILURE) from error


def topic_named(name: str) -> Topic:
    """Row of the table; ends the command with the nearest names if there is none."""
    try:
        return topics.named(name)
    except topics.UnknownTopicError as error:
        raise ended(str(error), exit_codes.USAGE) from None


OLD_KEYS = {"publisher": "said by", "published": "said so far", "received": "heard"}
"""Key of a row -> its name in the release before, which JSON has too for one release."""


def with_old_keys(row: dict[str, Any]) -> dict[str, Any]:
    """A row for JSON, with the values of renamed keys by both names."""
    return row | {old: row[key] for key, old in OLD_KEYS.items() if key in row}


def arm_in(folder: Path, namespace: str | None) -> str:
    """Namespace of the arm that a person means; ends the command if several run and none is named, or not that one."""
    from paramove.bus import inspection  # not before: it loads ZeroMQ, and a stop waits for nothing

    gates = inspection.gates(folder)
    if namespace is None:
        if len(gates) > 1:
            named = " or ".join(f"--namespace {name}" for name in gates if name)
            raise ended(f"{len(gates)} arms run here; which one? {named}", exit_codes.USAGE)
        return next(iter(gates), "")
    if namespace not in gates:
        raise ended(f"no arm in the namespace {namespace!r}; {nearest(namespace, gates)}", exit_codes.USAGE)
    return namespace


def show(rows: Sequence[dict[str, Any]], as_json: bool) -> None:
    """Prints rows that have the same keys, as JSON or as a table."""
    if as_json:
        typer.echo(json.dumps([with_old_keys(row) for row in rows], indent=2))
        return
    if not rows:
        return
    texts = [[str(key) for key in rows[0]], *([_text(value) for value in row.values()] for row in rows)]
    for line in aligned(texts):
        typer.echo(line)


def _text(value: object) -> str:
    if value is None or value == "":
        return "-"
    if isinstance(value, bool):
        return "yes" if value else "no"
    # What others have written may hold control characters that a terminal would obey.
    return "".join(letter if letter.isprintable() else "?" for letter in str(value))
