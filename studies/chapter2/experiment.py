"""All trainings behind the report on thesis chapter 2, and the numbers that are read off them."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from paramove.documents import Floats
from paramove.hmm import ChainParameters, LeftRightHMM, Parameters
from studies.chapter2.figures import (
    ERGODIC_10,
    ERGODIC_20,
    FIGURES,
    LAST,
    PLAIN_5,
    PLAIN_7,
    PLAIN_7_NARROW,
    PLAIN_20_NARROW,
    RESULT,
    SKIPS_20,
    TIMED_5,
    TIMED_10,
    TIMED_20,
    Setting,
)
from studies.chapter2.movement import PARAMETER_SETS, ParameterSet
from studies.chapter2.training import Snapshot, Trained, chain_model, trained

BRANCHING = (ERGODIC_10, ERGODIC_20, SKIPS_20)
COMPARED = (ERGODIC_10, PLAIN_5, PLAIN_7, PLAIN_7_NARROW, PLAIN_20_NARROW, TIMED_5, TIMED_10, TIMED_20)
RANDOM_STARTS = 8
RANDOM_ITERATIONS = 100
SETS, SET_ITERATIONS = 3, 250


@dataclass(frozen=True)
class Experiment:
    """What was trained.

    Attributes:
        seed: of the training sequences and random starts.
        trained: the settings of the figures.
        branched: the likeliest of several random starts, for the chains that can branch.
        transitions_first: the 7-state chain whose transitions were trained before the rest.
        random_plain: the likeliest of several random starts of the 7-state chain.
        starts: the 10-state HMM with time restrictions from a random and from a simple start.
        drifts: largest |y| of a state mean as a fraction of the bound, for each set of parameters and setting; (SETS,).
        sampled: see `sampled_along_a_branch`.
    """

    seed: int
    trained: dict[Setting, Trained]
    branched: dict[Setting, Trained]
    transitions_first: Trained
    random_plain: Trained
    starts: dict[str, Trained]
    drifts: dict[ParameterSet, dict[Setting, Floats]]
    sampled: dict[str, float]


def run_experiment(seed: int, report: Callable[[str], None] = lambda step: None) -> Experiment:
    """Train everything; one to two minutes. `report` gets the name of each step."""
    done: dict[Setting, Trained] = {}
    for figure in FIGURES:
        if figure.setting not in done:
            report(f"figure {figure.number}")
            done[figure.setting] = trained(figure.setting, seed)
    report("random starts")
    branched = {setting: likeliest_random(setting, seed) for setting in BRANCHING}
    starts = {start: trained(replace(TIMED_10, start=start), seed) for start in ("random", "simple")}
    report("other sets of parameters")
    drifts: dict[ParameterSet, dict[Setting, Floats]] = {
        name: {setting: _drifts(setting, seed, name) for setting in COMPARED} for name in PARAMETER_SETS
    }
    return Experiment(
        seed,
        done,
        branched,
        trained(PLAIN_7, seed, transitions_first=True),
        likeliest_random(PLAIN_7, seed),
        starts,
        drifts,
        sampled_along_a_branch(branched[ERGODIC_20], seed),
    )


def likeliest_random(setting: Setting, seed: int) -> Trained:
    """The likeliest of `RANDOM_STARTS` trainings from random means and covariances, on the same sequences."""
    tries = [
        trained(replace(setting, start="random"), seed, RANDOM_ITERATIONS, start_seed=number)
        for number in range(RANDOM_STARTS)
    ]
    return max(tries, key=lambda one: one.log_likelihoods[-1])


def _drifts(setting: Setting, seed: int, parameters: ParameterSet) -> Floats:
    iterations = min(SET_ITERATIONS, LAST[setting.kind])
    trainings = [trained(setting, number, iterations, parameters=parameters) for number in range(seed, seed + SETS)]
    return np.array([drift(one.snapshots[-1], setting) for one in trainings])


def drift(snapshot: Snapshot, setting: Setting) -> float:
    """Largest distance of a state mean from the x-axis, as a fraction of the bound."""
    return float(np.abs(snapshot.means[:, 1]).max() / setting.bound)


def in_the_middle(snapshot: Snapshot) -> float:
    """Share of the state means with x in [0.8, 1.2]; a fifth if they are uniform."""
    x = snapshot.means[:, 0]
    return float(((x >= 0.8) & (x <= 1.2)).mean())


def unevenness(snapshot: Snapshot) -> float:
    """Longest step in x from a state mean to the next as a multiple of the mean step; 1 if they are uniform."""
    steps = np.diff(np.sort(snapshot.means[:, 0]))
    return float(steps.max() / steps.mean())


def branches(snapshot: Snapshot, bound: float) -> int:
    """Groups of state means with x in [0.4, 1.6], by the parameter of the movement on which each lies.

    Two groups are at least a third of the bound apart.
    """
    x, y = snapshot.means.T
    away = np.abs(x - 1.0) <= 0.6
    parameters = np.sort(y[away] / np.minimum(x[away], 2.0 - x[away]))
    return 1 + int((np.diff(parameters) > bound / 3.0).sum())


def per_frame(training: Trained, iteration: int) -> float:
    """ln p(X | lambda) of the training sequences per frame after an iteration."""
    return training.log_likelihoods[iteration] / sum(map(len, training.sequences))


def sampled_along_a_branch(training: Trained, seed: int, count: int = 50) -> dict[str, float]:
    """Sequences drawn from the Gaussians along the states of each training sequence (2.3.1).

    Medians: log-likelihood per frame of drawn and of training sequences, and their roughness, the mean length of the
    second difference.
    """
    model = training.snapshots[-1].model
    if not isinstance(model, ChainParameters):
        raise ValueError("branches are those of a chain without time restrictions")
    hmm = chain_model(training.setting).with_parameters(model)
    rng = np.random.default_rng(seed)
    factors = np.linalg.cholesky(model.covariances)
    drawn = []
    for number in range(count):
        states = hmm.decode(training.sequences[number % len(training.sequences)])
        noise = rng.standard_normal((len(states), 2))
        drawn.append(model.means[states] + np.einsum("tij,tj->ti", factors[states], noise))

    def likelihood(sequences: list[Floats]) -> float:
        return float(np.median([hmm.log_likelihood(one) / len(one) for one in sequences]))

    def roughness(sequences: list[Floats]) -> float:
        return float(np.median([np.linalg.norm(np.diff(one, 2, axis=0), axis=1).mean() for one in sequences]))

    return {
        "drawn_log_likelihood": likelihood(drawn),
        "training_log_likelihood": likelihood(training.sequences),
        "drawn_roughness": roughness(drawn),
        "training_roughness": roughness(training.sequences),
    }


def synthesised(experiment: Experiment) -> dict[str, Floats]:
    """One movement by each method of 2.2.4, from the 10-state HMM with time restrictions."""
    parameters = experiment.trained[TIMED_10].snapshots[-1].model
    if not isinstance(parameters, Parameters):
        raise ValueError("synthesis is shown for the HMM with time restrictions")
    model, rng = LeftRightHMM.from_parameters(parameters), np.random.default_rng(experiment.seed)
    return {
        "A: drawn": model.sample(rng),
        "B: mean of 100 drawn": model.sample_average(rng, 100),
        "C: spline through drawn": model.sample_spline(rng),
        "D: means in order": model.synthesize(100),
    }


def numbers_of(experiment: Experiment) -> dict[str, Any]:
    """The numbers behind the figures, for JSON."""
    rows = []
    for figure in FIGURES:
        training = experiment.trained[figure.setting]
        rows.append(
            {
                "figure": figure.number,
                "iterations": figure.iterations % (LAST[figure.setting.kind] + 1),
                **_row(training, figure.iterations),
            }
        )
    return {
        "seed": experiment.seed,
        "figures": rows,
        "random_starts": [
            {"states": setting.states, "kind": setting.kind, **_row(one, RESULT)}
            for setting, one in experiment.branched.items()
        ],
        "trials": {
            "transitions_first": _row(experiment.transitions_first, RESULT),
            "random_start": _row(experiment.random_plain, RESULT),
        },
        "drift_by_parameters": {
            name: [
                {"kind": s.kind, "states": s.states, "bound": s.bound, "drift": values.tolist()}
                for s, values in by_setting.items()
            ]
            for name, by_setting in experiment.drifts.items()
        },
        "sampled_along_a_branch": experiment.sampled,
    }


def _row(training: Trained, iteration: int) -> dict[str, Any]:
    snapshot, setting = training.snapshots[iteration], training.setting
    return {
        "drift": drift(snapshot, setting),
        "in_the_middle": in_the_middle(snapshot),
        "unevenness": unevenness(snapshot),
        "branches": branches(snapshot, setting.bound),
        "log_likelihood_per_frame": per_frame(training, iteration),
        "settled_after": training.settled(),
        "distance_from_result": float(training.distances()[iteration]),
        "means": snapshot.means.tolist(),
        "covariances": snapshot.covariances.tolist(),
    }
