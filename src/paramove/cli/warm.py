"""`paramove warm`: does once what the first run would otherwise wait for."""

from __future__ import annotations

import time
from pathlib import Path

import typer
from platformdirs import user_cache_path

app = typer.Typer(add_completion=False)


@app.command()
def warm() -> None:
    """Compile the numerical kernels and train the reaching model; both are kept on disk, and again costs seconds."""
    began_s = time.perf_counter()
    typer.echo("compiling the kernels of hidden Markov models and time warping ...")
    _compile()
    compiled_s = time.perf_counter()
    typer.echo(f"  {compiled_s - began_s:.1f} s; kept beside the installed package")
    cache = user_cache_path("paramove")
    typer.echo(f"training the reaching model from synthetic demonstrations (kept in {cache}) ...")
    trained = _train()
    typer.echo(f"  {time.perf_counter() - compiled_s:.1f} s{'' if trained else ', it was there already'}")


def _compile() -> None:
    """Runs everything compiled once, with the types that are used."""
    import numpy as np

    from paramove.alignment import warp
    from paramove.hmm import GaussianHMM, LeftRightHMM, TrainingOptions
    from paramove.phmm import InterpolativePHMM, QuadraticPHMM

    rng = np.random.default_rng(0)
    line = np.linspace(0.0, 1.0, 30)[:, None] + [0.0, 1.0]
    sequences = [line + 0.01 * rng.standard_normal(line.shape) for _ in range(3)]
    model = LeftRightHMM(n_states=5, d_min=2, d_max=8).fit(sequences)
    model.log_likelihood(sequences[0])
    model.decode(sequences[0])
    once = TrainingOptions(max_iterations=1)
    GaussianHMM(n_states=5, finish_state=True, options=once).fit(sequences).decode(sequences[0])
    GaussianHMM(n_states=2, topology="ergodic", options=once).fit(sequences)
    warp(sequences[0], sequences[1], "A")
    warp(sequences[0], sequences[1], "B")
    theta = [0.0, 0.5, 1.0]
    QuadraticPHMM(5, 2, 8, options=once).fit(sequences, theta).estimate(sequences[0])
    frames = QuadraticPHMM(5, 2, 8, options=once, residuals="independent").fit(sequences, theta)
    frames.estimate(sequences[0])
    InterpolativePHMM(5, 2, 8, options=once).fit(sequences, theta).estimate(sequences[0])


def _train() -> bool:
    """True if the model was trained now."""
    from paramove.imitation.setup import MovementSource

    cache: Path = user_cache_path("paramove")
    before = {path: path.stat().st_mtime_ns for path in cache.glob("reaching_*.npz")}
    MovementSource().trained()
    return {path: path.stat().st_mtime_ns for path in cache.glob("reaching_*.npz")} != before


if __name__ == "__main__":
    app()
