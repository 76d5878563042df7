"""`python -m studies teaching`: nine movements taught before one and two cameras, simulated at the measured noise."""

from __future__ import annotations

from typing import Any

import typer
from rich.console import Console
from rich.table import Table

from paramove.cli import JsonFileOption, write_numbers
from paramove.documents import exit_codes


def teaching(json_file: JsonFileOption = None) -> None:
    """Teach a movement before one and two cameras, five simulated persons each, and reach new positions by the model.

    Exit codes: 0 the means meet the goals; 3 some do not.
    """
    import numpy as np

    from studies.teaching.experiment import GOALS_CM, SEEDS, run

    console = Console(highlight=False, emoji=False)
    runs: list[dict[str, Any]] = []
    with console.status("teaching") as status:
        for count in GOALS_CM:
            for seed in SEEDS:
                status.update(f"{count} cameras, seed {seed}")
                runs.append(run(count, seed))
    table = Table(title="medians over new positions, cm; means of the seeds", show_edge=False, pad_edge=False)
    for head in ("cameras", "movements", "fingertip at the end", "goal", "path", "goal"):
        table.add_column(head)
    rows, met = [], True
    for count, goals in GOALS_CM.items():
        own = [one for one in runs if one["cameras"] == count]
        means = {name: round(float(np.mean([one[name] for one in own])), 2) for name in ("movements", *goals)}
        met &= all(means[name] <= goal for name, goal in goals.items())
        rows.append({"cameras": count, **means, **{f"{name}_goal": goal for name, goal in goals.items()}})
        cells = (count, means["movements"], means["end"], goals["end"], means["path"], goals["path"])
        table.add_row(*(f"{cell:g}" for cell in cells))
    console.print(table)
    write_numbers(json_file, {"rows": rows, "runs": runs, "met": met}, console)
    raise typer.Exit(exit_codes.OK if met else exit_codes.JUDGED_A_FAILURE)
