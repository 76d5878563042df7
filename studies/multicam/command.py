"""`python -m studies multicam`: a real arm reconstructed from four cameras."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console

from paramove.cli import JsonFileOption, write_numbers
from paramove.documents import exit_codes

DATA_SET = "multicam_person"


def multicam(
    data: Annotated[
        Path | None, typer.Option(metavar="FOLDER", help="recordings (default: $PARAMOVE_DATA, or shared/data)")
    ] = None,
    json_file: JsonFileOption = None,
) -> None:
    """Reconstruct a balancing person's arm from key points of four cameras; no truth: they are judged by each other.

    With the heavy network if `paramove webcam setup --heavy` has fetched it, else with the usual one.

    Exit codes: 0 done; 66 the recording or the pose network is missing.
    """
    from paramove.demonstrations import RecordingsError, data_folder
    from paramove.documents import InputError
    from paramove.observation import has_heavy
    from studies.multicam.cameras import detected, read_calibration
    from studies.multicam.experiment import numbers_of

    console = Console(highlight=False, emoji=False)
    try:
        folder = data_folder(data) / DATA_SET
        cameras = read_calibration(folder)
        with console.status("detecting key points") as status:
            tracks = [detected(folder, camera, status.update) for camera in cameras]
            numbers = {"network": "heavy" if has_heavy() else "full", **numbers_of(cameras, tracks)}
    except (RecordingsError, InputError) as error:
        Console(stderr=True, highlight=False, markup=False).print(str(error), soft_wrap=True)
        raise typer.Exit(exit_codes.INPUT_MISSING) from error
    for name, value in numbers.items():
        console.print(f"{name}: {value}", markup=False, soft_wrap=True)
    write_numbers(json_file, numbers, console)
