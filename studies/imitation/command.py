"""`python -m studies imitation`: the experiment of thesis 5.2.7."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from platformdirs import user_cache_path
from rich.console import Console
from rich.table import Table

from paramove.cli import seeds_in
from paramove.documents import exit_codes
from paramove.workspace import Workspace

if TYPE_CHECKING:
    from studies.imitation.thesis import Compared

FOLDER = Path("runs/evaluation/imitation")


def imitation(
    seeds: Annotated[str, typer.Option(help="synthetic demonstrators: 7, 0-4 or 0,3,5-7")] = "0-4",
    repetitions: Annotated[int, typer.Option(min=2, help="demonstrations that a reference averages")] = 40,
    grid: Annotated[bool, typer.Option("--grid/--no-grid", help="also targets all over the table")] = True,
    raster: Annotated[bool | None, typer.Option("--raster/--no-raster", hidden=True)] = None,
    report: Annotated[
        Path | None, typer.Option(metavar="FOLDER", help="where the report goes (default: runs/evaluation/imitation)")
    ] = None,
) -> None:
    """Compare the robot's reaching with the person's: errors of gripper and elbow, compared with thesis 5.2.7.

    Writes report.html, imitation.json and the plots. Exit codes: 0 every goal is met; 3 some are not, and the report
    shows in which states and why.
    """
    from studies.imitation.experiment import Setup, run_experiment
    from studies.imitation.report import write_results
    from studies.imitation.thesis import compared

    if raster is not None:  # the spelling until 0.2
        old, new = ("--raster", "--grid") if raster else ("--no-raster", "--no-grid")
        typer.echo(f"{old} is now {new}; the old spelling works for one more release", err=True)
        grid = raster
    console = Console(highlight=False, emoji=False)
    workspace = Workspace.here().root
    cache = user_cache_path("paramove")
    cache.mkdir(parents=True, exist_ok=True)
    setup = Setup(Path("hoap3"), tuple(seeds_in(seeds)), repetitions, grid, cache)
    with console.status("training") as status:
        experiment = run_experiment(setup, status.update)
        folder = (report or workspace / FOLDER).resolve()
        numbers = write_results(experiment, folder)
    rows = compared(numbers)
    Console(highlight=False, emoji=False, width=max(console.width, 100)).print(_table(rows))
    for message in numbers["why"]:
        console.print(f"\n{message}", markup=False)
    console.print(f"\nreport: {folder / 'report.html'}", markup=False, soft_wrap=True)
    raise typer.Exit(exit_codes.OK if all(one.met is not False for one in rows) else exit_codes.JUDGED_A_FAILURE)


def _table(rows: list[Compared]) -> Table:
    table = Table(title="largest error in states 20-60, mm, at the robot's scale", show_edge=False, pad_edge=False)
    table.add_column("error")
    table.add_column("target")
    for heading in ("thesis", "median", "largest", "goal"):
        table.add_column(heading, justify="right")
    table.add_column("")
    for one in rows:
        mark = {True: "[green]met[/]", False: "[red]not met[/]", None: ""}[one.met]
        goal = "" if one.row.goal is None else f"≤ {one.row.goal:g}"
        values = ["–" if value is None else f"{value:.1f}" for value in (one.median, one.largest)]
        table.add_row(one.row.text, one.row.target.name, one.row.thesis or "", *values, goal, mark)
    return table
