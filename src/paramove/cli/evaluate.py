"""`paramove evaluate`: repeats experiments and measures their success."""

from __future__ import annotations

import signal
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any

import typer
from rich.console import Console
from rich.progress import Progress
from rich.table import Table

from paramove.cli import completions
from paramove.cli.evaluation_io import PROGRESS, JsonFileOption, seeds_in, write_numbers
from paramove.cli.output import ended
from paramove.documents import exit_codes
from paramove.workspace import Workspace

app = typer.Typer(name="evaluate", help="Repeat experiments and measure their success.", no_args_is_help=True)
STUDIES = ("kills", "faults", "imitation", "real", "peers", "chapter2", "chapter4", "chapter6", "real-images")
"""Commands of release 0.1.0 that are programs of the clone now."""

RUNS = Path("runs/evaluation")

RunsOption = Annotated[
    Path | None,
    typer.Option(help="where runs and results are stored (default: runs/evaluation); finished ones are used"),
]
SetOption = Annotated[
    list[str] | None, typer.Option("--set", metavar="NODE.PARAM=VALUE", help="as in paramove launch; may be repeated")
]
WithOption = Annotated[
    list[str] | None,
    typer.Option("--with", metavar="OVERLAY", help="as in paramove launch: --with sim --with real_time"),
]
JobsOption = Annotated[int, typer.Option(min=1, help="runs at the same time; each uses about two cores")]
AgainOption = Annotated[bool, typer.Option("--again", help="run every seed again, also those with a result")]


@app.command("rule_learning")
def rule_learning(
    seeds: Annotated[str, typer.Option(help="worlds: 7, 0-9 or 3,5,10-12")] = "0-9",
    jobs: JobsOption = 1,
    json_file: JsonFileOption = None,
    runs: RunsOption = None,
    settings: SetOption = None,
    overlays: WithOption = None,
    robot: completions.RobotOption = None,
    again: AgainOption = False,
    video: Annotated[bool, typer.Option("--video", help="with video and report of every run; slower")] = False,
    drop_recordings: Annotated[
        bool, typer.Option("--drop-recordings", help="delete the recording of a successful run (about 0.5 GB each)")
    ] = False,
) -> None:
    """Run the rule-learning demo once per seed, headless, and judge every run by the ground truth.

    Ctrl-C and the same command again: continues with the missing seeds. Exit codes: 0 at least 9 of 10 runs
    succeeded; 3 fewer did; 130 interrupted.
    """
    console = Console(highlight=False, emoji=False)
    results = _batch(console, seeds, jobs, runs, settings or [], overlays or (), robot, again, video, drop_recordings)
    from paramove.runs import LEGEND, TABLE_WIDTH, enough, table_of, totals_of

    wide = Console(highlight=False, emoji=False, width=max(console.width, TABLE_WIDTH))
    wide.print(table_of(results))
    console.print(LEGEND, style="dim")
    for result in results:
        if not result.get("success"):
            console.print(
                f"seed {result['seed']}: {result.get('reason') or 'failed'} ({result['run_folder']})", markup=False
            )
    write_numbers(json_file, {"results": results, "totals": totals_of(results)}, console)
    raise typer.Exit(exit_codes.OK if enough(results) else exit_codes.JUDGED_A_FAILURE)


@app.command("homography")
def homography(
    run_folder: Annotated[
        Path | None, typer.Argument(help="folder of a run; or give --seeds", autocompletion=completions.run_folders)
    ] = None,
    seeds: Annotated[str | None, typer.Option(help="worlds to run, or to take from --runs: 0-9")] = None,
    jobs: JobsOption = 1,
    json_file: JsonFileOption = None,
    runs: RunsOption = None,
    settings: SetOption = None,
) -> None:
    """Measure the robot's own camera calibration against the true camera, over its working area.

    Exit codes: 0 median error of every run at most 3 mm; 3 larger, or a run never calibrated; 66 no such run.
    """
    from paramove.runs import GOAL_MM, RunFolderError, accuracy_of, load_run

    console = Console(highlight=False, emoji=False)
    if (run_folder is None) == (seeds is None):
        raise typer.BadParameter("give either a run folder or --seeds")
    if run_folder is not None:
        folders = [run_folder]
    else:
        results = _batch(console, str(seeds), jobs, runs, settings or [])
        folders = [Path(result["run_folder"]) for result in results]
    try:
        rows = [accuracy_of(load_run(folder)) for folder in folders]
    except RunFolderError as error:
        raise ended(str(error), exit_codes.INPUT_MISSING) from error
    console.print(_homography_table(rows))
    write_numbers(json_file, rows, console)
    good = all(row["grid_mm"]["median"] is not None and row["grid_mm"]["median"] <= GOAL_MM for row in rows)
    raise typer.Exit(exit_codes.OK if good else exit_codes.JUDGED_A_FAILURE)


def _moved(context: typer.Context) -> None:
    raise ended(f"this is now: python -m studies {context.info_name} (from the root of a clone)", exit_codes.USAGE)


for _name in STUDIES:
    app.command(_name, hidden=True, context_settings={"allow_extra_args": True, "ignore_unknown_options": True})(_moved)


def _homography_table(rows: list[dict[str, Any]]) -> Table:
    table = Table(title="error of the robot's own homography, mm", show_edge=False, pad_edge=False)
    table.add_column("seed", justify="right")
    for heading in ("grid median", "95 %", "max", "objects detected at rest: median", "max", "number"):
        table.add_column(heading, justify="right")
    for row in rows:
        grid, at_rest = row["grid_mm"], row["seen_at_rest_mm"]
        values = (grid["median"], grid["p95"], grid["max"], at_rest["median"], at_rest["max"])
        cells = ["–" if value is None else f"{value:.2f}" for value in values]
        table.add_row(str(row["seed"]), *cells, str(at_rest["samples"]))
    return table


def _batch(
    console: Console,
    seeds: str,
    jobs: int,
    runs: Path | None,
    settings: Sequence[str],
    overlays: Sequence[str] = (),
    robot: str | None = None,
    again: bool = False,
    video: bool = False,
    drop_recordings: bool = False,
) -> list[dict[str, Any]]:
    from paramove.runs import BatchOptions, finished, run_batch
    from paramove.supervision import check, load

    requested, workspace = seeds_in(seeds), Workspace.here()
    # Reports errors before the first run.
    check(load(workspace, "rule_learning", overlays or None, settings, robot=robot), workspace)
    folder = (runs or workspace.root / RUNS).resolve()
    options = BatchOptions(
        workspace.root, folder, jobs, video, not drop_recordings, tuple(settings), tuple(overlays), robot
    )
    results = {} if again else finished(requested, options)
    if results:
        console.print(f"results of {len(results)} seeds are taken from {folder} (--again repeats them)", soft_wrap=True)
    missing = [seed for seed in requested if seed not in results]
    with Progress(*PROGRESS, console=console, disable=not missing) as progress:
        task = progress.add_task("runs", total=len(missing))
        running: list[int] = []

        def begun(seed: int) -> None:
            running.append(seed)
            progress.update(task, description=f"seed {', '.join(map(str, running))}")

        def judged(result: dict[str, Any]) -> None:
            running.remove(result["seed"])
            results[result["seed"]] = result
            verdict = "[green]success[/]" if result.get("success") else "[red]failed[/]"
            progress.console.print(f"seed {result['seed']}: {verdict}, {result.get('objects_placed', 0)} placed")
            progress.advance(task)

        signal.signal(signal.SIGTERM, signal.default_int_handler)  # as Ctrl-C: the runs under way end in order
        try:
            run_batch(missing, options, begun, judged)
        except KeyboardInterrupt:
            console.print(
                f"interrupted; {len(results)} of {len(requested)} results are stored in {folder}", soft_wrap=True
            )
            raise typer.Exit(exit_codes.CTRL_C) from None
    return [results[seed] for seed in requested]
