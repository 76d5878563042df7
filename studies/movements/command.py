"""`python -m studies real` and `peers`: movement models on recorded people, and compared with other methods."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from platformdirs import user_cache_path
from rich.console import Console
from rich.table import Table

from paramove.cli import JsonFileOption, write_numbers
from paramove.documents import exit_codes
from paramove.workspace import Workspace
from studies.terminal import print_error, stored_results

if TYPE_CHECKING:
    from studies.movements.sweep import Row
    from studies.movements.tasks import Fold

FOLDER = Path("runs/evaluation")
TABLE_COLUMNS = (
    *("dtw", "end", "theta", "covered_50", "covered", "covered_set", "below_1", "auroc_aborted", "auroc_stopped"),
    *("correct", "correct_25", "correct_50", "correct_75", "correct_100"),
)


class Scope(StrEnum):
    """On what the peers are compared."""

    RASTER = "raster"
    REAL = "real"
    FEW = "few"
    ALL = "all"


DataOption = Annotated[
    Path | None,
    typer.Option(metavar="FOLDER", help="recordings (default: $PARAMOVE_DATA, or shared/data next to the clone)"),
]
OutOption = Annotated[Path | None, typer.Option(metavar="FOLDER", help="where report.html and movements.json go")]
JobsOption = Annotated[int, typer.Option(min=1, help="processes at the same time")]
SchedulerOption = Annotated[
    str | None, typer.Option(metavar="ADDRESS", help="compute on the cluster of this Dask scheduler: tcp://host:8786")
]
MethodsOption = Annotated[
    list[str] | None, typer.Option("--method", metavar="TEXT", help="only methods whose name has this; may be repeated")
]
TasksOption = Annotated[
    list[str] | None, typer.Option("--task", metavar="TEXT", help="only tasks whose name has this; may be repeated")
]


def real(
    data: DataOption = None,
    out: OutOption = None,
    json_file: JsonFileOption = None,
    jobs: JobsOption = 1,
    scheduler: SchedulerOption = None,
    methods: MethodsOption = None,
    tasks: TasksOption = None,
) -> None:
    """Measure this project's movement models on recorded people: pointing, and movements at a table.

    Whole directions and persons are left out. Ctrl-C and the same command again: goes on where it was. Exit codes: 0
    measured; 66 no recordings or no cluster; 130 interrupted.
    """
    from studies.movements.ours import our_rows

    rows = _chosen(our_rows(), methods)
    folds = _tasks(Scope.REAL, data, tasks)
    _compare("Movement models on recorded people", rows, folds, out, "real", json_file, jobs, scheduler, ())


def peers(
    on: Annotated[
        Scope, typer.Option(help="synthetic demonstrator, recorded people, few or tidy synthetic movements, or all")
    ] = Scope.ALL,
    data: DataOption = None,
    out: OutOption = None,
    json_file: JsonFileOption = None,
    jobs: JobsOption = 1,
    scheduler: SchedulerOption = None,
    methods: MethodsOption = None,
    tasks: TasksOption = None,
) -> None:
    """Measure this project's movement models and compare them with other methods, by the same folds and resampling.

    Needs `pip install 'paramove[peers]'`; methods whose library is missing are named and left out. Ctrl-C and the same
    command again: goes on where it was. Exit codes: 0 measured; 66 no recordings, cluster or peer; 130 interrupted.
    """
    from studies.movements.ours import our_rows
    from studies.movements.sweep import missing_libraries
    from studies.peers.catalogue import peer_rows

    theirs = peer_rows()
    absent = {row.name: missing_libraries(row) for row in theirs}
    without = sorted({library for names in absent.values() for library in names})
    left_out = [name for name, names in absent.items() if names]
    notes = [f"not installed: {', '.join(without)}; left out: {', '.join(left_out)}"] if left_out else []
    for note in notes:
        print_error(f"{note}. pip install 'paramove[peers]' brings them")
    if len(left_out) == len(theirs):
        print_error("no peer is installed: pip install 'paramove[peers]' brings them")
        raise typer.Exit(exit_codes.INPUT_MISSING)
    rows = _chosen([*our_rows(), *(row for row in theirs if not absent[row.name])], methods)
    folds = _tasks(on, data, tasks)
    _compare(
        "Movement models compared with other methods", rows, folds, out, "peers", json_file, jobs, scheduler, notes
    )


def _chosen(rows: Sequence[Row], methods: list[str] | None) -> list[Row]:
    chosen = [row for row in rows if not methods or any(text in row.name for text in methods)]
    if not chosen:
        raise typer.BadParameter(f"methods are {', '.join(row.name for row in rows)}", param_hint="--method")
    return chosen


def _tasks(on: Scope, data: Path | None, names: list[str] | None) -> dict[str, list[Fold]]:
    from paramove.demonstrations import RecordingsError
    from studies.movements.tasks import few_tasks, grid_tasks, real_tasks

    folds: dict[str, list[Fold]] = {}
    try:
        if on in (Scope.REAL, Scope.ALL):
            folds |= real_tasks(data)
        if on in (Scope.RASTER, Scope.ALL):
            folds |= grid_tasks()
        if on in (Scope.FEW, Scope.ALL):
            folds |= few_tasks()
    except RecordingsError as error:
        print_error(str(error))
        raise typer.Exit(exit_codes.INPUT_MISSING) from error
    if not folds:
        print_error("these recordings are of one person, or of one target: cross-validation needs at least two")
        raise typer.Exit(exit_codes.INPUT_MISSING)
    chosen = {name: own for name, own in folds.items() if not names or any(text in name for text in names)}
    if not chosen:
        raise typer.BadParameter(f"tasks are {', '.join(folds)}", param_hint="--task")
    return chosen


def _compare(
    title: str,
    rows: list[Row],
    folds: Mapping[str, list[Fold]],
    out: Path | None,
    name: str,
    json_file: Path | None,
    jobs: int,
    scheduler: str | None,
    notes: Sequence[str],
) -> None:
    from studies.movements.report import plain, write_report
    from studies.movements.summary import summarised
    from studies.movements.sweep import jobs_of, keys_of

    console = Console(highlight=False, emoji=False)
    folder = (out or Workspace.here().root / FOLDER / name).resolve()
    cache = user_cache_path("paramove") / "movements"
    work = jobs_of(rows, folds)
    results = stored_results(work, keys_of(work), cache, "folds", console, jobs=jobs, scheduler=scheduler)
    summary = summarised(results)
    wide = Console(highlight=False, emoji=False, width=max(console.width, 150))
    for task, rows_of_task in summary.items():
        wide.print(_table(task, rows_of_task))
    page = write_report(summary, folder, title=title, ours=frozenset(row.name for row in rows if row.ours), notes=notes)
    console.print(f"report: {page}", markup=False, soft_wrap=True)
    write_numbers(json_file, plain(summary), console)


def _table(task: str, rows: dict[str, dict[str, Any]]) -> Table:
    from studies.movements.report import formatted, heading, leading, quantities_of

    table = Table(title=task, show_edge=False, pad_edge=False, title_justify="left")
    table.add_column("method", no_wrap=True)
    quantities = [quantity for quantity in quantities_of(rows) if quantity.name in TABLE_COLUMNS]
    for quantity in quantities:
        table.add_column(heading(quantity, task), justify="right")
    table.add_column("learn, s", justify="right")
    best = {quantity.name: leading(rows, quantity) for quantity in quantities}
    for name, row in rows.items():
        cells = [formatted(quantity, row["measures"].get(quantity.name)) for quantity in quantities]
        marked = [
            f"[bold]{cell}[/]" if name in best[q.name] else cell for cell, q in zip(cells, quantities, strict=True)
        ]
        table.add_row(name, *marked, f"{row['seconds']['fit']:.2f}")
    return table
