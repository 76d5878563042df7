"""`python -m studies chapter2`: the experiments of the thesis on HMMs."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console
from rich.table import Table

from paramove.cli import JsonFileOption, write_numbers
from studies.terminal import marked

FOLDER = Path("runs/evaluation/chapter2")


def chapter2(
    seed: Annotated[int, typer.Option(min=0, help="of the training sequences and random starts")] = 0,
    out: Annotated[Path, typer.Option(metavar="DIR", help="where the report goes")] = FOLDER,
    json_file: JsonFileOption = None,
) -> None:
    """Train the HMMs of thesis chapter 2 on its synthetic movement and draw figures 2.6 to 2.24.

    Writes report.html, chapter2.json and the plots, and prints for each figure what is observed and whether the
    thesis reports the same. Takes one to two minutes.
    """
    from studies.chapter2.experiment import run_experiment
    from studies.chapter2.report import write_results

    console = Console(highlight=False, emoji=False)
    with console.status("training") as status:
        experiment = run_experiment(seed, lambda step: status.update(f"training: {step}"))
        status.update("drawing")
        folder = out.resolve()
        numbers = write_results(experiment, folder)
    table = Table(title="figures of thesis 2.3", show_edge=False, pad_edge=False, show_lines=True)
    for heading in ("figure", "as in the thesis", "observed here"):
        table.add_column(heading)
    for row in numbers["figures"]:
        table.add_row(row["figure"], marked(row["as_in_the_thesis"]), row["seen"])
    console.print(table)
    write_numbers(json_file, numbers, console)
    console.print(f"report: {folder / 'report.html'}", markup=False, soft_wrap=True)
