"""`python -m studies real-images`: tracking in action space on pictures of a real camera."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer
from rich.console import Console
from rich.table import Table

from paramove.cli import JsonFileOption, write_numbers
from paramove.documents import exit_codes

REAL_IMAGES_FOLDER = Path("runs/evaluation/real_images")


def real_images(
    data: Annotated[
        Path | None, typer.Option(metavar="FOLDER", help="recordings (default: $PARAMOVE_DATA, or shared/data)")
    ] = None,
    json_file: JsonFileOption = None,
    out: Annotated[Path, typer.Option(metavar="DIR", help="where the report goes")] = REAL_IMAGES_FOLDER,
) -> None:
    """Track the arm of a person before a real camera: a replay through camera, tracker and overlay, about a minute.

    Writes report.html and real_images.json: numbers and plots, never a picture. Exit codes: 0 the median distance of
    the hand is at most 25 px in both ranges of frames with every seed; 3 it is not; 66 the recording or a part of it
    is missing.
    """
    from paramove.documents import InputError
    from studies.real_images import seated_person
    from studies.real_images.experiment import numbers_of, recording_folder, resting_numbers, run_all
    from studies.real_images.report import write_report
    from studies.real_images.scores import read_reference

    console = Console(highlight=False, emoji=False)
    try:
        folder = recording_folder(data)
        with console.status("learning how one points") as status:
            replays = run_all(folder, done=status.update)
        numbers = numbers_of(replays) | {"hand left on the knee": resting_numbers(folder)}
        page = write_report(replays, numbers, read_reference(folder), seated_person.camera(folder), out.resolve())
    except InputError as error:
        Console(stderr=True, highlight=False, markup=False).print(str(error), soft_wrap=True)
        raise typer.Exit(exit_codes.INPUT_MISSING if error.missing else exit_codes.USAGE) from error
    _print(numbers, console)
    write_numbers(json_file, numbers, console)
    console.print(f"report: {page}", markup=False, soft_wrap=True)
    raise typer.Exit(exit_codes.OK if numbers["met"] else exit_codes.JUDGED_A_FAILURE)


def _print(numbers: dict[str, Any], console: Console) -> None:
    from studies.real_images.scores import RANGES

    table = Table(title="median distance of the hand, px, of the seeds", show_edge=False, pad_edge=False)
    for head in ("replay", *RANGES, "within 25 px"):
        table.add_column(head)
    for name, case in numbers["cases"].items():
        medians = [[run[one]["median_px"] for run in case["runs"]] for one in RANGES]
        cells = [" ".join("–" if value is None else f"{value:.0f}" for value in one) for one in medians]
        table.add_row(name, *cells, "[green]yes[/]" if case["met"] else "[red]no[/]")
    resting = [numbers["hand left on the knee"][one]["median_px"] for one in RANGES]
    table.add_row("hand left on the knee", *(f"{value:.0f}" for value in resting), "")
    console.print(table)
    console.print(f"goal {'met' if numbers['met'] else 'missed'}, judged by {numbers['judged']!r}", markup=False)
