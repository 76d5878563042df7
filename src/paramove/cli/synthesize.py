"""`paramove synthesize`: the movement of a model for given parameters."""

from __future__ import annotations

import sys
import warnings
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from paramove.cli.movement_options import ModelArgument, PlotOption, ThetaOption, loaded, numbers
from paramove.cli.output import one_line
from paramove.documents import printable

if TYPE_CHECKING:
    from paramove.documents import Floats
    from paramove.phmm import ParametricHMM

app = typer.Typer(add_completion=False)

RATE_HZ = 60.0
"""For models without the rate of their demonstrations."""
SECONDS = 1.0
"""For models without the duration of their demonstrations."""


@app.command()
def synthesize(
    model: ModelArgument,
    theta: ThetaOption,
    duration: Annotated[
        float | None, typer.Option(min=0.01, max=3600.0, help="s (default: the mean of the demonstrations)")
    ] = None,
    frames: Annotated[
        int | None, typer.Option(min=2, max=1_000_000, help="how many (default: at the demonstrations' rate)")
    ] = None,
    out: Annotated[
        Path | None, typer.Option(metavar="FILE", help=".csv, .npz or .mcap (default: CSV to standard output)")
    ] = None,
    plot: PlotOption = None,
) -> None:
    """Make the movement for the parameters theta.

    Exit codes: 0, also for theta outside the training range, with a warning; 2 wrong arguments or a
    recording that exists; 66 there is no model; 78 it is damaged, or theta has another number of components.
    """
    import numpy as np

    from paramove.phmm import ExtrapolationWarning
    from paramove.training import ENDINGS, Made, as_csv, write_movement

    if out is not None and out.suffix not in ENDINGS:
        raise typer.BadParameter(f"files of movements end in {', '.join(ENDINGS)}", param_hint="--out")
    with one_line():
        trained = loaded(model)
        values = np.array(numbers(theta, "--theta"))
        _check(trained, values)
        about = trained.description
        seconds = duration or (about.duration if about else 0.0) or SECONDS
        count = frames or max(2, round(seconds * ((about.rate_hz if about else 0.0) or RATE_HZ)) + 1)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", ExtrapolationWarning)  # `_check` has warned
            made = Made.by(trained, values, np.linspace(0.0, seconds, count))
        if out is not None:
            out.parent.mkdir(parents=True, exist_ok=True)
            write_movement(made, out)
            typer.echo(f"{out}: {count} frames, {seconds:.3g} s")
        if plot is not None:
            from paramove.demonstrations import write_plot
            from paramove.training import plot_synthesis

            write_plot(plot_synthesis(trained, values, made.time, made.frames), plot, f"{model.name}: theta {theta}")
            typer.echo(str(plot))
        if out is None and plot is None:
            sys.stdout.write(as_csv(made))


def _check(model: ParametricHMM, theta: Floats) -> None:
    """Ends the command for a wrong number of components; warns of values outside the training's bounds."""
    from paramove.documents import InputError
    from paramove.training import bounds, parameter_names, with_unit

    names = parameter_names(model)
    low, high = bounds(model)
    low_high = [f"{with_unit(name)}: {a:.4g} to {b:.4g}" for name, a, b in zip(names, low, high, strict=True)]
    if len(theta) != len(names):
        raise InputError(f"theta has {len(names)} components ({'; '.join(low_high)}), found {len(theta)} in --theta")
    outside = [bounds for bounds, value, minimum, maximum in zip(low_high, theta, low, high, strict=True)
               if not minimum <= value <= maximum]  # fmt: skip
    if outside:
        typer.echo(
            printable(f"theta is outside the training range, the movement is extrapolated: "
                      f"{'; '.join(outside)}"),
            err=True,
        )  # fmt: skip
