"""`paramove warm`: does once what the first run would otherwise wait for."""

from __future__ import annotations

import os
import tempfile
import time
from concurrent.futures import Future, ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer
from platformdirs import user_cache_path

from paramove.documents import Floats

if TYPE_CHECKING:
    from paramove.cameras import CalibratedCamera

app = typer.Typer(add_completion=False)


@app.command()
def warm() -> None:
    """Compile the numerical kernels and train the models of the demonstrations, on all processors; both are stored."""
    began_s = time.perf_counter()
    processes, cache = len(os.sched_getaffinity(0)), user_cache_path("paramove")
    with ProcessPoolExecutor(processes, get_context("spawn")) as pool:
        typer.echo("compiling the kernels of hidden Markov models, time warping and tracking ...")
        images, segments = pool.submit(_images), pool.submit(_segments)
        segments.result()  # the others call its kernels, and would compile them once more
        _await([images, *(pool.submit(one) for one in (_polynomials, _interpolation, _chains, _warping))])
        compiled_s = time.perf_counter()
        typer.echo(f"  {compiled_s - began_s:.1f} s; stored with the installed package")
        typer.echo(f"training reaching and pointing from synthetic demonstrations (stored in {cache}) ...")
        before = _stored(cache)
        _await([pool.submit(_reaching), pool.submit(_tracking)])
        trained = _stored(cache) != before
    typer.echo(f"  {time.perf_counter() - compiled_s:.1f} s{'' if trained else ', it was there already'}")


def _await(work: list[Future[None]]) -> None:
    for one in work:
        one.result()


def _stored(cache: Path) -> dict[Path, int]:
    return {path: path.stat().st_mtime_ns for path in (*cache.glob("reaching_*.npz"), *cache.glob("actions/*.npz"))}


def _sequences() -> list[Floats]:
    """Three short movements."""
    import numpy as np

    rng = np.random.default_rng(0)
    line = np.linspace(0.0, 1.0, 30)[:, None] + [0.0, 1.0]
    return [line + 0.01 * rng.standard_normal(line.shape) for _ in range(3)]


def _segments() -> None:
    """Explicit durations."""
    from paramove.hmm import LeftRightHMM

    sequences = _sequences()
    model = LeftRightHMM(n_states=5, d_min=2, d_max=8).fit(sequences)
    model.log_likelihood(sequences[0])
    model.decode(sequences[0])


def _chains() -> None:
    """Plain chains."""
    from paramove.hmm import GaussianHMM, TrainingOptions

    sequences, once = _sequences(), TrainingOptions(max_iterations=1)
    GaussianHMM(n_states=5, finish_state=True, options=once).fit(sequences).decode(sequences[0])
    GaussianHMM(n_states=2, topology="ergodic", options=once).fit(sequences)


def _warping() -> None:
    from paramove.alignment import warp

    first, second, _ = _sequences()
    warp(first, second, "A")
    warp(first, second, "B")


def _polynomials() -> None:
    from paramove.hmm import TrainingOptions
    from paramove.phmm import QuadraticPHMM

    sequences, theta = _sequences(), [0.0, 0.5, 1.0]
    options: dict[str, Any] = {"options": TrainingOptions(max_iterations=1)}
    for residuals in ("correlated", "independent"):
        QuadraticPHMM(5, 2, 8, residuals=residuals, **options).fit(sequences, theta).estimate(sequences[0])


def _interpolation() -> None:
    from paramove.hmm import TrainingOptions
    from paramove.phmm import InterpolativePHMM

    sequences, once = _sequences(), TrainingOptions(max_iterations=1)
    for residuals in ("correlated", "independent"):
        model = InterpolativePHMM(5, 2, 8, options=once, residuals=residuals)
        model.fit(sequences, [0.0, 0.5, 1.0]).estimate(sequences[0])


def _camera() -> CalibratedCamera:
    import numpy as np

    from paramove.cameras import CalibratedCamera

    camera_from_table = np.array(
        [[0.0, -1.0, 0.0, -0.2], [0.0, 0.0, -1.0, 0.2], [1.0, 0.0, 0.0, 1.5], [0.0, 0.0, 0.0, 1.0]]
    )
    lens = np.array([[300.0, 0.0, 159.5], [0.0, 300.0, 119.5], [0.0, 0.0, 1.0]])
    return CalibratedCamera("camera", 320, 240, lens, np.zeros(4), camera_from_table)


def _images() -> None:
    """Postures of an arm are compared with images."""
    import numpy as np

    from paramove.action_space import compile_observer
    from paramove.observation import ArmObserver, ArmSizes

    poses = np.tile([0.0, -0.25, 0.3, 0.1, -0.25, 0.1, 0.35, -0.2, 0.1], (10, 1))
    compile_observer(ArmObserver(ArmSizes(), [_camera()]), _camera(), poses)


def _reaching() -> None:
    from paramove.motion import MovementSource

    MovementSource().trained()


def _tracking() -> None:
    """A tracker of pointing."""
    from paramove.action_space import TrackingSetup
    from paramove.cameras import write_cameras

    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "cameras.yaml"
        write_cameras(path, [_camera()])
        TrackingSetup(cameras=path).video_tracker()
