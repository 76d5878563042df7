"""`paramove doctor`: looks at the machine, its installation and what is plugged in, and says what mends a fault."""

from __future__ import annotations

import json
import subprocess
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from paramove.diagnosis import Finding, Level, Machine, Part
from paramove.documents import InputError, exit_codes
from paramove.robots.dynamixel import BY_ID_VARIABLE

if TYPE_CHECKING:
    from rich.console import Console

app = typer.Typer(add_completion=False)

MARKS = {Level.OK: ("✓", "green"), Level.WARNING: ("!", "yellow"), Level.PROBLEM: ("✗", "red")}
PLAIN_MARKS = {Level.OK: "+", Level.WARNING: "!", Level.PROBLEM: "x"}
"""For a terminal that does not show all of Unicode."""
SUBJECT_WIDTH = 17


@app.command()
def doctor(
    only: Annotated[list[Part] | None, typer.Option(help="look at this part only; may be repeated")] = None,
    by_id: Annotated[
        Path | None,
        typer.Option(
            "--by-id",
            metavar="FOLDER",
            envvar=BY_ID_VARIABLE,
            help="look at the serial ports alone to which links in it lead; default: those of all USB adapters",
        ),
    ] = None,
    baud: Annotated[
        list[int] | None,
        typer.Option(min=1, metavar="BIT/S", help="at which servos are asked; default: the usual rates"),
    ] = None,
    fix: Annotated[bool, typer.Option("--fix", help="offer to mend what can be mended without being root")] = False,
    yes: Annotated[bool, typer.Option("--yes", help="with --fix: mend without asking")] = False,
    as_json: Annotated[bool, typer.Option("--json", help="print JSON")] = False,
) -> None:
    """Check this machine, its installation, cameras, serial ports and servos; say what mends what is wrong.

    Servos are only asked: no motor moves and nothing is written to them. A port that another program has open is left
    alone.

    Exit codes: 0 nothing is wrong (there may be warnings); 3 something is wrong.
    """
    if fix and as_json and not yes:
        raise typer.BadParameter("--fix asks, which --json cannot: add --yes")
    machine = Machine(by_id=by_id, baud_rates=tuple(baud or ()))
    found = {part: _look(part, machine, fix, yes, as_json) for part in (only or Part)}
    if as_json:
        typer.echo(json.dumps([_row(part, one) for part, findings in found.items() for one in findings], indent=2))
    wrong = [one for findings in found.values() for one in findings if one.level is Level.PROBLEM]
    if wrong:
        raise typer.Exit(exit_codes.JUDGED_A_FAILURE)


def _look(part: Part, machine: Machine, fix: bool, yes: bool, as_json: bool) -> Sequence[Finding]:
    """What is found of a part, shown; after something was mended, what is found then."""
    from rich.console import Console

    from paramove.diagnosis import examined

    shown, told = Console(highlight=False), Console(stderr=True)
    with told.status(f"looking at {part.value}"):
        findings = examined(part, machine)
    if not as_json:
        _show(shown, findings)
    if fix and sum(_mended(one, yes) for one in findings):
        findings = examined(part, machine)
        if not as_json:
            _show(shown, findings)
    return findings


def _mended(finding: Finding, yes: bool) -> bool:
    """Whether it was tried, after the question."""
    if finding.fix is None or not (yes or typer.confirm(f"{finding.subject}: {finding.fix.words}?")):
        return False
    try:
        finding.fix.do()
    except (OSError, InputError, subprocess.CalledProcessError) as error:
        typer.echo(f"{finding.subject}: not mended: {error}", err=True)
    return True


def _show(console: Console, findings: Sequence[Finding]) -> None:
    """A line each, and its remedies indented below."""
    from rich.text import Text

    from paramove.documents import printable

    plain = not console.encoding.lower().startswith("utf")

    def shown(text: str) -> str:
        return printable(text).encode(console.encoding, "replace").decode(console.encoding)

    for finding in findings:
        mark, colour = MARKS[finding.level]
        line = Text.assemble((PLAIN_MARKS[finding.level] if plain else mark, colour), " ")
        line.append(f"{finding.subject:<{SUBJECT_WIDTH}}", "bold").append(shown(finding.sentence))
        console.print(line, soft_wrap=True)
        for remedy in finding.remedy:
            console.print(Text(f"      {shown(remedy)}", "cyan"), soft_wrap=True)


def _row(part: Part, finding: Finding) -> dict[str, Any]:
    return {
        "part": part.value,
        "subject": finding.subject,
        "level": finding.level.value,
        "sentence": finding.sentence,
        "remedy": list(finding.remedy),
        "can_be_fixed": finding.fix is not None,
        "facts": dict(finding.facts),
    }


if __name__ == "__main__":
    app()
