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

    Writes report.html and real_images.json: numbers and plots, never a picture. Exit codes: 0 all goals are met; 3 some
    are missed; 66 the recording, a part of it or the pose network is missing.
    """
    from paramove.documents import InputError
    from paramove.observation import stored_network
    from studies.real_images import seated_person
    from studies.real_images.experiment import numbers_of, recording_folder, run_all
    from studies.real_images.replay import detected_key_points
    from studies.real_images.report import write_report
    from studies.real_images.scores import read_reference

    console = Console(highlight=False, emoji=False)
    try:
        folder = recording_folder(data)
        camera = seated_person.camera(folder)
        with console.status("detecting key points") as status:
            key_points = detected_key_points(folder, stored_network())
            reference = read_reference(folder, camera, key_points)
            replays = run_all(folder, key_points, reference, done=status.update)
        numbers = numbers_of(replays, key_points, reference, camera)
        page = write_report(replays, numbers, reference, camera, out.resolve())
    except InputError as error:
        Console(stderr=True, highlight=False, markup=False).print(str(error), soft_wrap=True)
        raise typer.Exit(exit_codes.INPUT_MISSING if error.missing else exit_codes.USAGE) from error
    _print(numbers, console)
    write_numbers(json_file, numbers, console)
    console.print(f"report: {page}", markup=False, soft_wrap=True)
    raise typer.Exit(exit_codes.OK if numbers["met"] else exit_codes.JUDGED_A_FAILURE)


def _print(numbers: dict[str, Any], console: Console) -> None:
    from studies.real_images.report import HEADS, row_of

    table = Table(title="means of the seeds", show_edge=False, pad_edge=False)
    table.add_column("", no_wrap=True)
    for head in numbers["cases"]:
        table.add_column(head)
    for row in zip(HEADS, *(row_of(runs) for runs in numbers["cases"].values()), strict=True):
        table.add_row(*row)
    console.print(table)
    for goal in numbers["goals"]:
        verdict = "[green]met[/]" if goal["met"] else "[red]missed[/]"
        console.print(
            f"{goal['case']}, {goal['frames']}, {goal['number']}: {goal['mean']}, goal {goal['goal']:g} {verdict}"
        )
