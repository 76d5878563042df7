"""`python -m studies chapter4`: the experiments of the thesis on parametric HMMs."""

from __future__ import annotations

from collections.abc import Sequence
from importlib.util import find_spec
from pathlib import Path
from typing import Annotated, Any

import typer
from platformdirs import user_cache_path
from rich.console import Console
from rich.table import Table

from paramove.cli import JsonFileOption, seeds_in, write_numbers
from paramove.documents import exit_codes
from studies.terminal import marked, stored_results

FOLDER = Path("runs/evaluation/chapter4")


def chapter4(
    seeds: Annotated[str, typer.Option(help="of the synthetic demonstrator: 7, 0-4 or 3,5,10-12")] = "0-4",
    jobs: Annotated[int, typer.Option(min=1, help="processes at the same time")] = 1,
    out: Annotated[Path, typer.Option(metavar="DIR", help="where the report goes")] = FOLDER,
    json_file: JsonFileOption = None,
    quick: Annotated[
        bool, typer.Option("--quick", help="one seed, small models, few tests, no hmmlearn: half a minute")
    ] = False,
    scheduler: Annotated[
        str | None, typer.Option(metavar="ADDRESS", help="compute on the cluster of this Dask scheduler")
    ] = None,
) -> None:
    """Repeat thesis chapter 4: parametric HMMs of pointing and reaching, what they synthesise and recognise.

    Writes report.html and chapter4.json, and prints which goals are met. Ctrl-C and the same command again: goes on
    where it was. Exit codes: 0 all goals are met; 3 not all; 66 no cluster; 130 interrupted.
    """
    from studies.chapter4.experiments import QUICK, Scale, experiments
    from studies.chapter4.report import plain, write_results

    console = Console(highlight=False, emoji=False)
    chosen_seeds = seeds_in(seeds)[:1] if quick else seeds_in(seeds)
    with_hmmlearn = find_spec("hmmlearn") is not None and not quick
    if not with_hmmlearn and not quick:
        console.print("hmmlearn is not installed: its plain HMM is left out (install it with: pip install hmmlearn)")
    work = experiments(chosen_seeds, QUICK if quick else Scale(), with_hmmlearn=with_hmmlearn)
    cache = user_cache_path("paramove") / "chapter4"
    keys = [one.key() for one in work]
    results = stored_results(work, keys, cache, "experiments", console, jobs=jobs, scheduler=scheduler)
    folder = out.resolve()
    numbers, targets = write_results(results, folder)
    for title, heads, rows in (
        (
            "compared with the thesis",
            ("where", "here", "the same"),
            [(f[0], f[2], f[3]) for f in _rows(numbers["findings"])],
        ),
        (
            "goals",
            ("target", "required", "measured", "of", "met"),
            [(*t[:4], "yes" if t.met else "no") for t in targets],
        ),
    ):
        table = Table(title=title, show_edge=False, pad_edge=False, show_lines=title != "goals")
        for head in heads:
            table.add_column(head)
        for *cells, verdict in rows:
            table.add_row(*cells, marked(verdict))
        console.print(table)
    write_numbers(json_file, plain(numbers), console)
    console.print(f"report: {folder / 'report.html'}", markup=False, soft_wrap=True)
    raise typer.Exit(exit_codes.OK if all(target.met for target in targets) else exit_codes.JUDGED_A_FAILURE)


def _rows(findings: Sequence[dict[str, Any]]) -> list[tuple[str, ...]]:
    return [tuple(one.values()) for one in findings]
