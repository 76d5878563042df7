"""`paramove recover`: a finished recording out of one whose writer was killed or whose bytes are damaged."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated, Any

import typer

from paramove.cli.output import JsonOption, ended, one_line
from paramove.documents import exit_codes, printable
from paramove.recording import RecordingExistsError, Recovery, StillWrittenError, recover

app = typer.Typer(add_completion=False)

MAX_DAMAGES = 20


@app.command("recover")
def recover_recording(
    file: Annotated[Path, typer.Argument(help="a recording, RUN.mcap.part or RUN.mcap")],
    output: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="default: RUN.mcap of RUN.mcap.part, RUN.recovered.mcap of RUN.mcap"),
    ] = None,
    as_json: JsonOption = False,
) -> None:
    """Rebuild a finished recording from one whose writer was killed or whose bytes are damaged.

    Everything readable is recovered; the file itself is only read, and no file is overwritten.

    Exit codes: 0 recovered, or nothing to recover; 2 the output exists; 66 no such file; 75 it is being written;
    78 nothing in it can be read.
    """
    with one_line():
        try:
            result = recover(file, output)
        except StillWrittenError as error:
            raise ended(str(error), exit_codes.TEMPORARY) from error
        except RecordingExistsError as error:
            raise ended(f"{error} with --output", exit_codes.USAGE) from error
    if as_json:
        typer.echo(json.dumps(_facts(result), indent=2))
    else:
        typer.echo("\n".join(_lines(result)))


def _facts(result: Recovery) -> dict[str, Any]:
    return {
        "source": str(result.source),
        "destination": str(result.destination) if result.destination else None,
        "messages_kept": result.kept,
        "messages_lost": result.lost,
        "messages_lost_is_exact": result.lost_is_exact,
        "seconds_kept": result.seconds_kept,
        "seconds_lost": result.seconds_lost,
        "known_until_s": result.known_until_s,
        "last_written": result.last_written.isoformat(),
        "damages": [{"begin": one.begin, "end": one.end, "what": one.what} for one in result.damages],
    }


def _lines(result: Recovery) -> list[str]:
    kept = f"{result.kept} messages, {result.seconds_kept:.3f} s"
    if result.destination is None:
        return [f"{result.source} is whole ({kept}): nothing to recover"]
    counted = f"{result.lost} messages, {result.seconds_lost:.3f} s"
    if not result.lost_is_exact:
        counted = f"at least {counted}, and the content of these bytes" if result.lost else "the content of these bytes"
    lines = [f"{result.destination}: recovered {kept}", f"lost {counted}{':' if result.damages else ''}"]
    lines += [f"  bytes {one.begin}-{one.end}: {one.what}" for one in result.damages[:MAX_DAMAGES]]
    if len(result.damages) > MAX_DAMAGES:
        lines.append(f"  and {len(result.damages) - MAX_DAMAGES} more")
    if result.known_until_s is not None:
        lines += [
            f"unknown: whether messages followed that of {result.known_until_s:.3f} s, as its writer never finished it",
            f"  it wrote last at {result.last_written.isoformat(timespec='seconds')}; a recorder that was killed takes "
            "0.5 s with it at most, a power failure may cost 2 s",
        ]
    return [printable(line) for line in lines]
