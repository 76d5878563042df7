"""`python -m studies kills` and `python -m studies faults`: what happens when something goes wrong."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated, Any

import typer
from rich.console import Console
from rich.progress import Progress
from rich.table import Table
from rich.text import Text

from paramove.cli import PROGRESS, JsonFileOption, write_numbers
from paramove.documents import exit_codes
from paramove.workspace import Workspace

RUNS = Path("runs/kills")
WIDTH = 130

ListOption = Annotated[str, typer.Option(metavar="A,B", help="only these; default: all")]


def kills(
    nodes: ListOption = "",
    signals: ListOption = "",
    moments: ListOption = "",
    jobs: Annotated[int, typer.Option(min=1, help="runs at the same time; times are only of worth with 1")] = 1,
    json_file: JsonFileOption = None,
    runs: Annotated[
        Path | None,
        typer.Option(help="where runs and results are stored (default: runs/kills); finished ones are used"),
    ] = None,
    seed: Annotated[int, typer.Option(min=0, help="world of all runs")] = 0,
    pace: Annotated[
        float, typer.Option(min=0.1, max=1.0, help="simulated seconds per second; less for a machine that is too slow")
    ] = 1.0,
    again: Annotated[bool, typer.Option("--again", help="every case again, also those with a result")] = False,
) -> None:
    """Kill (KILL) and stop (STOP) every process of the running demo, the launcher too, in three phases each.

    Each run is the real launch in real time. Phases: moving, rest, holding. Measured: when it is reported, when the
    process is back, whether the arm ever jumped, how the run ends, what is left over. Ctrl-C and the same command
    again: goes on with the cases that are missing. Exit codes: 0 all passed; 3 not all did; 130 interrupted.
    """
    from paramove.supervision import load
    from studies.faults.kill_batch import KillOptions, finished
    from studies.faults.kill_cases import CaseError, cases_of
    from studies.faults.kill_table import LEGEND, problems_of, table_of
    from studies.faults.live_run import APPLICATION

    console = Console(highlight=False, emoji=False)
    workspace = Workspace.here()
    file = load(workspace, APPLICATION, ["sim", "real_time"]).file
    try:
        cases = cases_of(file, _names(nodes), _names(signals), _names(moments))
    except CaseError as error:
        raise typer.BadParameter(str(error)) from error
    options = KillOptions(workspace.root, (runs or workspace.root / RUNS).resolve(), jobs, seed, pace)
    results = {} if again else finished(options.folder, cases)
    if results:
        console.print(f"results of {len(results)} cases are taken from {options.folder} (--again makes them anew)")
    _perform([case for case in cases if case.name not in results], options, results, console)
    ordered = [results[case.name] for case in cases]
    Console(highlight=False, emoji=False, width=max(console.width, WIDTH)).print(table_of(ordered))
    console.print(LEGEND, style="dim")
    for line in problems_of(ordered):
        console.print(Text(line, style="red"), soft_wrap=True)
    write_numbers(json_file, {"cases": ordered}, console)
    raise typer.Exit(exit_codes.OK if all(result["passed"] for result in ordered) else exit_codes.JUDGED_A_FAILURE)


def faults(
    section: Annotated[str, typer.Option(metavar="P,G", help="only these sections; default: all")] = "",
    jobs: Annotated[int, typer.Option(min=1, help="tests at the same time")] = 1,
    json_file: JsonFileOption = None,
) -> None:
    """Run the test of every row of docs/faults.md and print the table with the results.

    Exit codes: 0 none failed; 3 a test failed or does not exist; 66 no such page; 78 the page cannot be read.
    """
    from studies.faults.fault_page import PAGE, FaultPageError, read_page
    from studies.faults.fault_tests import TestsNotRunError, run_tests

    console = Console(highlight=False, emoji=False)
    workspace = Workspace.here().root
    try:
        rows = read_page(workspace / PAGE)
    except (FileNotFoundError, FaultPageError) as error:
        Console(stderr=True, highlight=False, markup=False).print(str(error), soft_wrap=True)
        code = exit_codes.INPUT_MISSING if isinstance(error, FileNotFoundError) else exit_codes.CONFIGURATION
        raise typer.Exit(code) from error
    chosen = _names(section)
    known = sorted({row.id[0] for row in rows})
    if unknown := [letter for letter in chosen if letter not in known]:
        raise typer.BadParameter(f"no section {', '.join(unknown)} with rows; there are {', '.join(known)}")
    rows = [row for row in rows if not chosen or row.id[0] in chosen]
    with Progress(*PROGRESS, console=console) as progress:
        task = progress.add_task("tests", total=None)
        try:
            results = run_tests(
                rows, workspace, lambda done, total: progress.update(task, completed=done, total=total or None), jobs
            )
        except TestsNotRunError as error:
            Console(stderr=True, highlight=False, markup=False).print(str(error), soft_wrap=True)
            raise typer.Exit(exit_codes.FAILURE) from error
        except KeyboardInterrupt:
            raise typer.Exit(130) from None
    console.print(_fault_table(results))
    for result in results:
        if result.outcome in ("failed", "missing"):
            console.print(Text(f"{result.row.id}: {result.message} ({', '.join(result.row.tests)})", style="red"))
    write_numbers(json_file, [result.as_json() for result in results], console)
    bad = any(result.outcome in ("failed", "missing") for result in results)
    raise typer.Exit(exit_codes.JUDGED_A_FAILURE if bad else exit_codes.OK)


def _perform(missing: list[Any], options: Any, results: dict[str, dict[str, Any]], console: Console) -> None:
    from studies.faults.kill_batch import run_cases

    with Progress(*PROGRESS, console=console, disable=not missing) as progress:
        task = progress.add_task("cases", total=len(missing))

        def begun(group: Any) -> None:
            progress.update(task, description=f"{group[0].name}{f' and {len(group) - 1} more' if group[1:] else ''}")

        def ended(result: Any) -> None:
            results[result.case.name] = json.loads(json.dumps(result.as_json()))
            verdict = (
                "[green]passed[/]"
                if result.passed
                else f"[red]failed[/] {'; '.join((*result.problems, *result.late, result.not_sent))}"
            )
            progress.console.print(f"{result.case.name}: {verdict}", soft_wrap=True)
            progress.advance(task)

        try:
            run_cases(missing, options, begun, ended)
        except KeyboardInterrupt:
            console.print(f"interrupted; {len(results)} results are stored in {options.folder}", soft_wrap=True)
            raise typer.Exit(130) from None


def _fault_table(results: list[Any]) -> Table:
    counts = {name: sum(result.outcome == name for result in results) for name in _STYLES}
    summary = ", ".join(f"{count} {name}" for name, count in counts.items() if count)
    table = Table(show_edge=False, pad_edge=False, show_footer=True)
    table.add_column("id")
    table.add_column("fault", footer=f"{len(results)} faults: {summary}")
    table.add_column("what happens")
    table.add_column("tests", justify="right", footer=str(sum(r.passed + r.failed + r.skipped for r in results)))
    table.add_column("result")
    section = ""
    for result in results:
        if result.row.section != section:
            section = result.row.section
            table.add_row("", Text(section, style="bold"))
        ran = str(result.passed + result.failed + result.skipped)
        verdict = Text(result.outcome, style=_STYLES[result.outcome])
        table.add_row(result.row.id, Text(result.row.fault), Text(result.row.answer), ran, verdict)
    return table


_STYLES = {"passed": "green", "failed": "red", "skipped": "yellow", "missing": "red"}


def _names(text: str) -> list[str]:
    return [name.strip() for name in text.split(",") if name.strip()]
