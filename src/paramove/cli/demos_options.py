"""Options, tables and errors that the commands of `paramove demos` share."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Annotated, Any

import typer
from rich.console import Console
from rich.table import Table

from paramove.documents import InputError, exit_codes, printable
from paramove.recording import RecordingExistsError

SetArgument = Annotated[Path, typer.Argument(metavar="SET", help="folder of a demonstration set")]
ActionOption = Annotated[str | None, typer.Option(help="only this action")]
SubjectOption = Annotated[str | None, typer.Option(help="only this person")]
LabelActionOption = Annotated[str | None, typer.Option("--action", help="what is done, such as reaching")]
ThetaOption = Annotated[
    str, typer.Option("--theta", metavar="NUMBERS", help="the movement's parameters, such as 0.45,0.1,-0.2")
]
ParametersOption = Annotated[
    str | None,
    typer.Option("--parameters", metavar="NAMES", help="names of the parameters (default of three: target_x,…)"),
]
LabelSubjectOption = Annotated[str, typer.Option("--subject", help="who it is")]
PointOption = Annotated[str | None, typer.Option("--point", help="body point (default: index, else the last)")]


@contextlib.contextmanager
def one_line() -> Iterator[None]:
    """Ends the command with what is wrong on standard error, and an exit code, instead of a traceback."""
    try:
        yield
    except InputError as error:
        raise ended(str(error), error.exit_code) from error
    except RecordingExistsError as error:
        raise ended(str(error), exit_codes.USAGE) from error
    except OSError as error:
        raise ended(f"{error.filename or ''}: {error.strerror or error}".lstrip(": "), exit_codes.PERMISSION) from error


def ended(text: str, code: int) -> typer.Exit:
    """The exception that ends a command; prints its lines to standard error."""
    for line in text.splitlines():
        typer.echo(printable(line), err=True)
    return typer.Exit(code)


def numbers(text: str, option: str) -> tuple[float, ...]:
    """Finite numbers separated by commas; other text is a wrong use of the command."""
    try:
        values = tuple(float(part) for part in text.split(",") if part.strip())
    except ValueError:
        values = (float("nan"),)
    if any(value - value != 0.0 for value in values):
        raise typer.BadParameter(f"expected numbers such as 0.45,0.1,-0.2, found {text!r}", param_hint=option)
    return values


def words(text: str | None) -> tuple[str, ...] | None:
    """Names separated by commas; None for none."""
    return None if text is None else tuple(part.strip() for part in text.split(",") if part.strip())


def table_of(rows: Sequence[dict[str, Any]], title: str = "") -> None:
    """Prints rows that have the same keys; numbers to the right."""
    if not rows:
        return
    table = Table(title=title or None, title_justify="left", show_edge=False, pad_edge=False, box=None)
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
