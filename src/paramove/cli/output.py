"""What commands print: tables, JSON, and an error as a line with an exit code."""

from __future__ import annotations

import contextlib
import json
from collections.abc import Callable, Iterable, Iterator, Sequence
from pathlib import Path
from typing import Annotated, Any

import typer

from paramove.documents import InputError, exit_codes, printable

JsonOption = Annotated[bool, typer.Option("--json", help="print JSON")]


@contextlib.contextmanager
def one_line() -> Iterator[None]:
    """Ends the command with what is wrong on standard error, and an exit code, instead of a traceback."""
    try:
        yield
    except InputError as error:
        raise ended(str(error), error.exit_code) from error
    except OSError as error:
        from paramove.recording import RecordingExistsError  # not before: help pages need none of it

        code = exit_codes.USAGE if isinstance(error, RecordingExistsError) else exit_codes.PERMISSION
        raise ended(f"{error.filename or ''}: {error.strerror or error}".lstrip(": "), code) from error


def ended(text: str, code: int) -> typer.Exit:
    """The exception that ends a command; prints its lines to standard error."""
    for line in text.splitlines():
        typer.echo(printable(line), err=True)
    return typer.Exit(code)


def list_of(files: Iterable[Path], row: Callable[[Path], dict[str, Any]], as_json: bool) -> None:
    """Prints the row of each file; ends the command with what is wrong with those that cannot be used."""
    rows, wrong = [], []
    for file in files:
        try:
            rows.append(row(file))
        except InputError as error:
            wrong.append(str(error))
    if as_json:
        typer.echo(json.dumps(rows, indent=2, ensure_ascii=False))
    else:
        table_of(rows)
    if wrong:
        raise ended("\n".join(wrong), exit_codes.CONFIGURATION)


def aligned(rows: Sequence[Sequence[str]]) -> list[str]:
    """Rows of texts as lines in which the columns begin at the same place."""
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    return ["  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)).rstrip() for row in rows]


def table_of(rows: Sequence[dict[str, Any]]) -> None:
    """Prints rows that have the same keys; numbers to the right."""
    if not rows:
        return
    from rich.console import Console
    from rich.table import Table

    table = Table(show_edge=False, pad_edge=False, box=None)
    for key, value in rows[0].items():
        right = isinstance(value, int | float) and not isinstance(value, bool)
        table.add_column(key, justify="right" if right else "left", overflow="fold")
    for row in rows:
        table.add_row(*(_cell(value) for value in row.values()))
    console = Console(highlight=False, emoji=False, markup=False)
    wide = 200 if not console.is_terminal else max(console.width, 60)
    Console(highlight=False, emoji=False, markup=False, width=wide).print(table)


def _cell(value: object) -> str:
    if value is None or value == "":
        return "–"
    if isinstance(value, float):
        return f"{value:.4g}"
    if isinstance(value, list | tuple):
        return ", ".join(_cell(one) for one in value) or "–"
    return printable(str(value))
