"""`paramove doctor`: checks the machine, its installation and connected hardware, and prints how to fix a fault."""

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
    only: Annotated[list[Part] | None, typer.Option(help="check this part only; may be repeated")] = None,
    by_id: Annotated[
        Path | None,
        typer.Option(
            "--by-id",
            metavar="FOLDER",
            envvar=BY_ID_VARIABLE,
            help="check only the serial ports that it has links to; default: those of all USB adapters",
        ),
    ] = None,
    baud: Annotated[
        list[int] | None,
        typer.Option(min=1, metavar="BIT/S", help="at which servos are pinged; default: the usual rates"),
    ] = None,
    fix: Annotated[bool, typer.Option("--fix", help="offer to fix what can be fixed without being root")] = False,
    yes: Annotated[bool, typer.Option("--yes", help="with --fix: fix without asking")] = False,
    as_json: Annotated[bool, typer.Option("--json", help="print JSON")] = False,
) -> None:
    """Check this machine, its installation, cameras, serial ports and servos; print how to fix what is wrong.

    Servos are only read: no motor moves and nothing is written to them. A port that another program has open is left
    alone.

    Exit codes: 0 nothing is wrong (there may be warnings); 3 something is wrong.
    """
    if fix and as_json and not yes:
        raise typer.BadParameter("--fix asks, which --json cannot: add --yes")
    machine = Machine(by_id=by_id, baud_rates=tuple(baud or ()))
    findings_of = {part: _check(part, machine, fix, yes, as_json) for part in (only or Part)}
    if as_json:
        typer.echo(
            json.dumps([_row(part, one) for part, findings in findings_of.items() for one in findings], indent=2)
        )
    wrong = [one for findings in findings_of.values() for one in findings if one.level is Level.PROBLEM]
    if wrong:
        raise typer.Exit(exit_codes.JUDGED_A_FAILURE)


def _check(part: Part, machine: Machine, fix: bool, yes: bool, as_json: bool) -> Sequence[Finding]:
    """Checks a part and prints the findings; checks again after a fix."""
    from rich.console import Console

    from paramove.diagnosis import examined

    output, progress = Console(highlight=False), Console(stderr=True)
    with progress.status(f"checking {part.value}"):
        findings = examined(part, machine)
    if not as_json:
        _show(output, findings)
    if fix and sum(_mended(one, yes) for one in findings):
        findings = examined(part, machine)
        if not as_json:
            _show(output, findings)
    return findings


def _mended(finding: Finding, yes: bool) -> bool:
    """Asks and applies the fix; returns whether it was tried."""
    if finding.fix is None or not (yes or typer.confirm(f"{finding.subject}: {finding.fix.words}?")):
        return False
    try:
        finding.fix.do()
    except (OSError, InputError, subprocess.CalledProcessError) as error:
        typer.echo(f"{finding.subject}: not fixed: {error}", err=True)
    return True


def _show(console: Console, findings: Sequence[Finding]) -> None:
    """A line each, and its remedies indented below."""
    from rich.text import Text

    from paramove.documents import printable

    plain = not console.encoding.lower().startswith("utf")

    def displayed(text: str) -> str:
        return printable(text).encode(console.encoding, "replace").decode(console.encoding)

    for finding in findings:
        mark, colour = MARKS[finding.level]
        line = Text.assemble((PLAIN_MARKS[finding.level] if plain else mark, colour), " ")
        line.append(f"{finding.subject:<{SUBJECT_WIDTH}}", "bold").append(displayed(finding.detail))
        console.print(line, soft_wrap=True)
        for remedy in finding.remedy:
            console.print(Text(f"      {displayed(remedy)}", "cyan"), soft_wrap=True)


def _row(part: Part, finding: Finding) -> dict[str, Any]:
    return {
        "part": part.value,
        "subject": finding.subject,
        "level": finding.level.value,
        "sentence": finding.detail,
        "remedy": list(finding.remedy),
        "can_be_fixed": finding.fix is not None,
        "facts": dict(finding.facts),
    }
