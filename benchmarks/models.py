"""Speed of the movement models compared with hmmlearn and dynamax, as one table from one run.

    python benchmarks/models.py [--json FILE] [--rounds N] [--only TEXT]

Rows of a group do the same work on the same demonstrations and take turns. The table shows medians of processor time,
which other programs disturb less than time by the clock, and how many times as long each takes as the group's first
row. Everything runs in one thread on one core. A peer that is not installed is named; the extra `peers` brings it.

A group is a function that returns its rows; a new one goes into GROUPS. Peers are in `models_peers.py`.
"""

import argparse
import json
import logging
import os
import platform
import statistics
import subprocess
import sys
import time
from collections.abc import Callable
from dataclasses import asdict, dataclass
from functools import partial
from pathlib import Path

os.environ.update(OMP_NUM_THREADS="1", OPENBLAS_NUM_THREADS="1", MKL_NUM_THREADS="1")
sys.path.insert(0, str(Path(__file__).resolve().parent.parent))  # run as a program, only this folder is known

import numpy as np

from benchmarks.models_parametric import UNTRAINED, estimate_rows
from benchmarks.models_peers import (
    NotInstalledError,
    dynamax_training,
    hmmlearn_model,
    hmmlearn_training,
)
from paramove.demonstrations import demonstrations_at, reaching_cuboid, reaching_grid_demonstrations
from paramove.hmm import GaussianHMM, LeftRightHMM, TrainingOptions, resample
from paramove.phmm import InterpolativePHMM, LinearPHMM, QuadraticPHMM

ITERATIONS = 10
QUICK_S, SLOW_S = 0.2, 3.0
OPTIONS = TrainingOptions(max_iterations=ITERATIONS, tolerance=0.0)
THESIS_S = 50.0


@dataclass(frozen=True)
class Row:
    """One way to do the work of its group; `task` is None where it cannot be done here, `note` says why.

    Attributes:
        divisor: parts of the task that count as one, such as iterations.
        processor_time: of this process, all threads; on an idle machine that is the time by the clock.
    """

    name: str
    task: Callable[[], object] | None
    divisor: int = 1
    note: str = ""
    processor_time: bool = True


@dataclass
class Result:
    """Median time of a row, s; how many times as long as its group's first row."""

    group: str
    name: str
    seconds: float | None
    times_as_long: float | None
    runs: int
    note: str


def movements(n_frames: int, count: int) -> list[np.ndarray]:
    """Synthetic reaching movements over the table, 21 coordinates each."""
    rng = np.random.default_rng(0)
    corners = [[u, v, 0.0] for u in (0.0, 0.5, 1.0) for v in (0.0, 0.5, 1.0)]
    demonstrations = [demonstrations_at(reaching_cuboid().theta(np.array(one)), rng).sequences for one in corners]
    return [resample(one, n_frames) for repetition in zip(*demonstrations, strict=True) for one in repetition][:count]


def peer(name: str, task: Callable[[], object], divisor: int = ITERATIONS, note: str = "") -> Row:
    """A row of a peer. It is done once, so that a peer that is missing or fails is named."""
    try:
        task()
    except NotInstalledError as error:
        return Row(name, None, note=str(error))
    except (ValueError, FloatingPointError, np.linalg.LinAlgError) as error:
        return Row(name, None, note=f"fails: {str(error).splitlines()[0][:60]}")
    return Row(name, task, divisor, note)


def em_iteration(n_states: int, d_min: int, d_max: int, n_frames: int) -> list[Row]:
    """One iteration of Baum-Welch on 90 movements: the same number of states for everybody."""
    sequences = movements(n_frames, 90)
    durations = LeftRightHMM(n_states, d_min, d_max, options=OPTIONS).fit(sequences)
    finishing = GaussianHMM(n_states, finish_state=True, options=OPTIONS).fit(sequences)
    plain = GaussianHMM(n_states, options=OPTIONS).fit(sequences)
    first, second, third = durations.parameters, finishing.parameters, plain.parameters
    start = (third.means, third.covariances, 1, 1)
    return [
        Row("paramove, explicit durations", lambda: durations.fit(sequences, first), ITERATIONS),
        Row("paramove, plain chain with finish state", lambda: finishing.fit(sequences, second), ITERATIONS),
        Row("paramove, plain chain", lambda: plain.fit(sequences, third), ITERATIONS),
        peer("hmmlearn, plain chain, log", hmmlearn_training(sequences, *start, "log", ITERATIONS)),
        peer("hmmlearn, plain chain, scaling", hmmlearn_training(sequences, *start, "scaling", ITERATIONS)),
        peer("dynamax, plain chain, 64 bits", dynamax_training(sequences, *start, 64, ITERATIONS)),
        peer("dynamax, plain chain, 32 bits", dynamax_training(sequences, *start, 32, ITERATIONS)),
    ]


def expanded_iteration(n_states: int, d_min: int, d_max: int, n_frames: int, count: int) -> list[Row]:
    """One iteration of the same model: durations, or d_max sub-states each, whose outputs peers cannot tie."""
    sequences = movements(n_frames, count)
    durations = LeftRightHMM(n_states, d_min, d_max, options=OPTIONS).fit(sequences)
    start = (durations.means_, durations.covariances_, d_min, d_max)
    first = durations.parameters
    return [
        Row("paramove, explicit durations", lambda: durations.fit(sequences, first), ITERATIONS),
        peer("hmmlearn, expanded, log", hmmlearn_training(sequences, *start, "log", 1), 1, "transitions alone"),
        peer("hmmlearn, expanded, scaling", hmmlearn_training(sequences, *start, "scaling", 1), 1, "transitions alone"),
        peer("dynamax, expanded, 64 bits", dynamax_training(sequences, *start, 64, 1), 1, "all, untied"),
    ]


def thesis_training() -> list[Row]:
    """The case whose time the thesis gives (4.1.1): 21 states of 3 to 6 frames, 10 sequences, 10 iterations."""
    sequences = movements(100, 10)
    options = TrainingOptions(max_iterations=10, tolerance=0.0)
    theta = np.linspace(0.0, 1.0, 10)[:, None]
    model = partial(LinearPHMM, 21, 3, 6)
    # The thesis has a prior that fades and no lasting floor (2.2.2).
    unfloored = TrainingOptions(max_iterations=10, tolerance=0.0, floor_fraction=0.0)
    thesis = model(options=unfloored, residuals="independent", smoothness=None)
    prior, correlated = model(options=options, residuals="independent"), model(options=options)
    return [
        Row("paramove, linear PHMM, EM alone", lambda: thesis.fit(sequences, theta), note="as in the thesis"),
        Row("paramove, linear PHMM with prior", lambda: prior.fit(sequences, theta)),
        Row("paramove, linear PHMM, correlated", lambda: correlated.fit(sequences, theta), note="the default"),
        Row("paramove, HMM", lambda: LeftRightHMM(21, 3, 6, options=options).fit(sequences)),
        Row("thesis, linear PHMM (Core 2, 2.4 GHz)", None, note=f"{THESIS_S:g} s as printed"),
    ]


def likelihood() -> list[Row]:
    """ln p(X) of one movement: 20 states, T = 100, D = 21."""
    sequences = movements(100, 90)
    durations = LeftRightHMM(20, 4, 6).fit(sequences)
    plain = GaussianHMM(20).fit(sequences)
    rows = [
        Row("paramove, explicit durations", lambda: durations.log_likelihood(sequences[0])),
        Row("paramove, plain chain", lambda: plain.log_likelihood(sequences[0])),
    ]
    for name, model, lengths in (("plain chain", plain, (1, 1)), ("expanded", durations, (4, 6))):
        try:
            theirs = hmmlearn_model(model.means_, model.covariances_, *lengths, "log", 1)
        except NotInstalledError as error:
            rows.append(Row(f"hmmlearn, {name}, log", None, note=str(error)))
        else:
            rows.append(Row(f"hmmlearn, {name}, log", partial(theirs.score, sequences[0])))
    return rows


def parametric() -> list[Row]:
    """Parametric models of reaching, 80 states of 2 to 3 frames, a cuboid of 2 x 2 x 2 targets."""
    training = reaching_grid_demonstrations(np.random.default_rng(0))
    local = InterpolativePHMM(80, 2, 3, resampled_frames=200, residuals="independent")
    local.fit(training.sequences, training.theta)
    quadratic = QuadraticPHMM(n_states=20, d_min=4, d_max=6, resampled_frames=100).fit(
        training.sequences, training.theta
    )
    return [
        Row("train interpolative PHMM, 80 states", lambda: local.fit(training.sequences, training.theta)),
        Row("estimate theta, interpolative, 80 states", lambda: local.estimate(training.sequences[0])),
        Row("estimate theta, quadratic, 20 states", lambda: quadratic.estimate(training.sequences[0])),
    ]


def estimates(kind: str) -> list[Row]:
    """Theta of one movement over the table: 20 states of 4 to 6 frames, T = 100, D = 21."""
    return [Row(name, task, UNTRAINED, note) for name, task, note in estimate_rows(kind)]


FIRST_CALL = """
import time
start = time.perf_counter()
import numpy as np
from paramove.hmm import LeftRightHMM
LeftRightHMM(5, 2, 8).fit([np.random.default_rng(i).standard_normal((30, 2)) for i in range(3)])
print(time.perf_counter() - start)
"""


def first_call() -> list[Row]:
    """`import paramove.hmm` and a first training in a new process, once `paramove warm` has compiled the kernels."""
    return [
        Row(
            "new process",
            lambda: subprocess.run([sys.executable, "-c", FIRST_CALL], check=True, capture_output=True),
            processor_time=False,
        )
    ]


GROUPS: dict[str, Callable[[], list[Row]]] = {
    "EM iteration, 20 states (4..6), 90 x T=100, D=21": lambda: em_iteration(20, 4, 6, 100),
    "EM iteration, 80 states (2..3), 90 x T=200, D=21": lambda: em_iteration(80, 2, 3, 200),
    "the same durations, 20 states (4..6), 90 x T=100": lambda: expanded_iteration(20, 4, 6, 100, 90),
    "the same durations, 80 states (2..3), 20 x T=200": lambda: expanded_iteration(80, 2, 3, 200, 20),
    "training of thesis 4.1.1, 21 states, 10 x T=100, 10 iterations": thesis_training,
    "log-likelihood of one movement, 20 states, T=100": likelihood,
    "parametric models of reaching": parametric,
    "estimate of theta, interpolative, 20 states, T=100": lambda: estimates("interpolative"),
    "estimate of theta, linear, 20 states, T=100": lambda: estimates("linear"),
    "estimate of theta, quadratic, 20 states, T=100": lambda: estimates("quadratic"),
    "estimate of theta, neural, 20 states, T=100": lambda: estimates("neural"),
    "import and first training in a new process": first_call,
}


def timed(group: str, rows: list[Row], rounds: int) -> list[Result]:
    """Runs the rows in turn, a quick one once more before it is timed; a slow one only as often as it fits."""
    times: list[list[float]] = [[] for _ in rows]
    for round_ in range(rounds + 1):
        for row, own_times in zip(rows, times, strict=True):
            # What takes seconds has been run once by `peer` already, so its first time counts.
            if row.task is None or (round_ > 0 and own_times[0] * row.divisor > SLOW_S):
                continue
            if own_times and own_times[0] * row.divisor < QUICK_S:
                row.task()  # what others left in caches and memory is not its own
            clock = time.process_time if row.processor_time else time.perf_counter
            began = clock()
            row.task()
            own_times.append((clock() - began) / row.divisor)
    medians = [statistics.median(own_times[1:] or own_times) if own_times else None for own_times in times]
    reference = medians[0]
    return [
        Result(group, row.name, median, None if median is None or reference is None else median / reference,
               max(1, len(own_times) - 1) if own_times else 0, row.note)
        for row, median, own_times in zip(rows, medians, times, strict=True)
    ]  # fmt: skip


def show(results: list[Result]) -> None:
    """One group as part of the table."""
    sys.stdout.write(f"\n{results[0].group}\n")
    for result in results:
        if result.seconds is None:
            sys.stdout.write(f"  {result.name:42s} {'-':>13s} {'':>9s}  {result.note}\n")
            continue
        ratio = f"{result.times_as_long:.3g} x" if result.times_as_long is not None else ""
        sys.stdout.write(f"  {result.name:42s} {1e3 * result.seconds:10.3f} ms {ratio:>9s}  {result.note}\n")
    sys.stdout.flush()


def main() -> None:
    """Measure, print, and write JSON if requested."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--json", type=Path, help="write the results to this file")
    parser.add_argument("--rounds", type=int, default=5, help="runs that count, of each row")
    parser.add_argument("--only", default="", help="groups whose name contains this text")
    arguments = parser.parse_args()
    logging.getLogger("hmmlearn").setLevel(logging.ERROR)  # it warns of each fall that its fixed start brings
    if hasattr(os, "sched_setaffinity"):
        os.sched_setaffinity(0, {max(os.sched_getaffinity(0))})
    results: list[Result] = []
    for group, rows in GROUPS.items():
        if arguments.only in group:
            results += timed(group, rows(), arguments.rounds)
            show([result for result in results if result.group == group])
    if arguments.json is not None:
        machine = {"machine": platform.machine(), "python": platform.python_version(), "cores": os.cpu_count()}
        content = {"benchmark": "models", **machine, "results": [asdict(result) for result in results]}
        arguments.json.write_text(json.dumps(content, indent=2) + "\n")


if __name__ == "__main__":
    main()
