"""`paramove warm`: does once what the first run would otherwise wait for."""

from __future__ import annotations

import time
from pathlib import Path

import typer
from platformdirs import user_cache_path

app = typer.Typer(add_completion=False)


@app.command()
def warm() -> None:
    """Compile the numerical kernels and train the models of the demonstrations; both are kept on disk."""
    began_s = time.perf_counter()
    typer.echo("compiling the kernels of hidden Markov models, time warping and tracking ...")
    _compile()
    compiled_s = time.perf_counter()
    typer.echo(f"  {compiled_s - began_s:.1f} s; kept beside the installed package")
    cache = user_cache_path("paramove")
    typer.echo(f"training reaching and pointing from synthetic demonstrations (kept in {cache}) ...")
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
    _track()


def _track() -> None:
    """A tracker of one camera sees one image."""
    import tempfile

    import numpy as np

    from paramove.action_space.setup import TrackingSetup
    from paramove.observation.cameras import CalibratedCamera, write_cameras

    place = np.array([[0.0, -1.0, 0.0, -0.2], [0.0, 0.0, -1.0, 0.2], [1.0, 0.0, 0.0, 1.5], [0.0, 0.0, 0.0, 1.0]])
    lens = np.array([[300.0, 0.0, 159.5], [0.0, 300.0, 119.5], [0.0, 0.0, 1.0]])
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "cameras.yaml"
        write_cameras(path, [CalibratedCamera("camera", 320, 240, lens, np.zeros(4), place)])
        TrackingSetup(cameras=path).video_tracker()


def _train() -> bool:
    """True if the model was trained now."""
    from paramove.action_space.training import table_action
    from paramove.imitation.setup import MovementSource

    cache: Path = user_cache_path("paramove")
    before = _kept(cache)
    MovementSource().trained()
    table_action("pointing")
    return _kept(cache) != before


def _kept(cache: Path) -> dict[Path, int]:
    return {path: path.stat().st_mtime_ns for path in (*cache.glob("reaching_*.npz"), *cache.glob("actions/*.npz"))}


if __name__ == "__main__":
    app()
