"""Speed of training and likelihood beside hmmlearn, on the same demonstrations.

    python benchmarks/hmm.py [--json FILE] [--repetitions N]

The model is that of thesis 4.2.2: 20 states of 4 to 6 frames, full covariances, D = 21, T = 100, 10 sequences. hmmlearn
knows no durations: its plain left-right model is the easier task, the expanded one (120 sub-states) the equal one.
All use one core.
"""

import argparse
import json
import logging
import os
import platform
import sys
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
from hmmlearn.hmm import GaussianHMM
from threadpoolctl import threadpool_limits

from paramove.demonstrations import demonstrations_at, reaching_cuboid, reaching_grid_demonstrations
from paramove.hmm import LeftRightHMM, TrainingOptions, resample
from paramove.phmm import InterpolativePHMM

ITERATIONS = 10
STATES, D_MIN, D_MAX, FRAMES = 20, 4, 6, 100


def seconds(task: Callable[[], object], repetitions: int) -> float:
    """Shortest time of several runs; the first, which may compile, does not count."""
    task()
    times = []
    for _ in range(repetitions):
        start = time.perf_counter()
        task()
        times.append(time.perf_counter() - start)
    return min(times)


def transitions(n_states: int, d_min: int, d_max: int) -> np.ndarray:
    """Expanded left-right chain (thesis 2.2.3.2); d_max = 1 gives a plain chain with self-transitions."""
    if d_max == 1:
        matrix = 0.8 * np.eye(n_states) + 0.2 * np.eye(n_states, k=1)
        matrix[-1, -1] = 1.0
        return matrix
    matrix = np.zeros((n_states * d_max,) * 2)
    for row in range(len(matrix)):
        state, sub = divmod(row, d_max)
        leave = 0.0 if sub + 1 < d_min else 1.0 if sub + 1 == d_max else 0.5
        exit_to = min((state + 1) * d_max, len(matrix) - 1)
        matrix[row, exit_to] += leave
        matrix[row, min(row + 1, len(matrix) - 1)] += 1.0 - leave
    return matrix


def hmmlearn_model(means: np.ndarray, covariances: np.ndarray, d_min: int, d_max: int) -> GaussianHMM:
    """hmmlearn's model with the given start.

    Of the expanded form only the transitions are trained: it cannot tie sub-states, and those that no path uses would
    lose their means. So its time is a lower bound.
    """
    model = GaussianHMM(
        len(means) * d_max, "full", init_params="", params="tmc" if d_max == 1 else "t", n_iter=ITERATIONS, tol=-np.inf
    )
    model.transmat_ = transitions(len(means), d_min, d_max)
    model.startprob_ = np.eye(len(model.transmat_))[0]
    model.means_ = np.repeat(means, d_max, axis=0)
    model.covars_ = np.repeat(covariances, d_max, axis=0)
    return model


def measure(repetitions: int) -> dict[str, float]:
    """All times in s."""
    rng = np.random.default_rng(0)
    target = reaching_cuboid().theta(np.array([0.5, 0.5, 0.0]))
    sequences = [resample(one, FRAMES) for one in demonstrations_at(target, rng).sequences]
    stacked, lengths = np.concatenate(sequences), [FRAMES] * len(sequences)
    options = TrainingOptions(max_iterations=ITERATIONS, tolerance=0.0)
    ours = LeftRightHMM(STATES, D_MIN, D_MAX, options=options)
    ours.fit(sequences)
    plain = hmmlearn_model(ours.means_, ours.covariances_, 1, 1)
    expanded = hmmlearn_model(ours.means_, ours.covariances_, D_MIN, D_MAX)
    times = {
        "likelihood_paramove_s": seconds(lambda: ours.log_likelihood(sequences[0]), 20 * repetitions),
        "likelihood_hmmlearn_plain_s": seconds(lambda: plain.score(sequences[0]), 20 * repetitions),
        "likelihood_hmmlearn_expanded_s": seconds(lambda: expanded.score(sequences[0]), 20 * repetitions),
        "training_paramove_s": seconds(lambda: ours.fit(sequences), repetitions),
        "training_hmmlearn_plain_s": seconds(
            lambda: hmmlearn_model(ours.means_, ours.covariances_, 1, 1).fit(stacked, lengths), repetitions
        ),
        "training_hmmlearn_expanded_s": seconds(
            lambda: hmmlearn_model(ours.means_, ours.covariances_, D_MIN, D_MAX).fit(stacked, lengths), repetitions
        ),
    }
    shown = reaching_grid_demonstrations(rng)
    reaching = InterpolativePHMM(80, 2, 3, resampled_frames=200).fit(shown.sequences, shown.theta)
    times["training_reaching_2x2x2_80_states_s"] = seconds(
        lambda: InterpolativePHMM(80, 2, 3, resampled_frames=200).fit(shown.sequences, shown.theta), repetitions
    )
    times["estimate_theta_80_states_s"] = seconds(lambda: reaching.estimate(shown.sequences[0]), repetitions)
    theta, tau = np.tile(target, (400, 1)), np.linspace(0.0, 1.0, 400)
    times["progress_mean_400_particles_s"] = seconds(lambda: reaching.progress_mean(theta, tau), 20 * repetitions)
    return times


def main() -> None:
    """Measure, show, and write JSON where asked to."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--json", type=Path, help="write the times to this file")
    parser.add_argument("--repetitions", type=int, default=3)
    arguments = parser.parse_args()
    logging.getLogger("hmmlearn").setLevel(logging.ERROR)  # it warns of each fall that its fixed start brings
    with threadpool_limits(1):
        times = measure(arguments.repetitions)
    for name, value in times.items():
        sys.stdout.write(f"{name:42s} {1e3 * value:10.3f} ms\n")
    if arguments.json is not None:
        machine = {"machine": platform.machine(), "python": platform.python_version(), "cores": os.cpu_count()}
        arguments.json.write_text(json.dumps({"benchmark": "hmm", **machine, "times": times}, indent=2) + "\n")


if __name__ == "__main__":
    main()
