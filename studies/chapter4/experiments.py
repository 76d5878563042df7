"""Everything that is computed for the report on thesis chapter 4, as pieces of work that are stored one by one."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from importlib.metadata import version
from typing import Any

from paramove.source_code import code_digest
from studies.chapter4.grid import REPETITIONS
from studies.chapter4.kinds import (
    BY_NAME,
    IPHMM_2,
    IPHMM_3,
    KINDS,
    LPHMM_3,
    OURS,
    QPHMM_3,
)
from studies.chapter4.learning import LEARNERS, TRAININGS, able, measured_learning
from studies.chapter4.line_movement import measured_line
from studies.chapter4.measurement import measured_kind, measured_noise
from studies.chapter4.redirect import FEWEST, redirects
from studies.chapter4.variation import (
    fit_to_references,
    hmmlearn_rate,
    likelihood_surfaces,
    natural_variation,
    plain_rate,
)

MODELS, NOISE, LEARNING, LINE, REDIRECT = "models", "noise", "learning", "line", "redirect"
VARIATION, FIT, SURFACES, HMMLEARN, PLAIN = "variation", "fit to averages", "surfaces", "hmmlearn", "plain HMM"

BY_THESIS = tuple(kind.name for kind in KINDS if kind.thesis)
WITH_ALL_STATES = (LPHMM_3 + OURS, QPHMM_3 + OURS)
"""What is also trained with more states: the thesis's models, and ours of the same training."""


@dataclass(frozen=True)
class Scale:
    """How much is computed.

    Attributes:
        states: numbers of states, the first for all models. kinds: names of models. noisy: those tested with noise.
        every: each so many-th test movement is classified. compared: movements per target whose pairs are compared.
        learners, trainings: of the learning curves.
        redirect_seeds: minimum number of seeds. redirect_tests: pairs of targets. redirect_only: part of the names of
            the training sets.
        surface_points: per axis of figure 4.15.
    """

    states: tuple[int, ...] = (20, 40)
    kinds: tuple[str, ...] = tuple(kind.name for kind in KINDS)
    noisy: tuple[str, ...] = (IPHMM_3, LPHMM_3, QPHMM_3, LPHMM_3 + OURS, QPHMM_3 + OURS)
    every: int = 1
    compared: int = 14
    learners: tuple[str, ...] = LEARNERS
    trainings: tuple[tuple[int, int], ...] = TRAININGS
    redirect_seeds: int = 10
    redirect_tests: int = 40
    redirect_only: str = ""
    surface_points: int = 25


QUICK = Scale(
    states=(10,),
    kinds=(IPHMM_2, IPHMM_3, LPHMM_3, QPHMM_3, QPHMM_3 + OURS),
    noisy=(QPHMM_3 + OURS,),
    every=REPETITIONS,
    compared=4,
    learners=(QPHMM_3 + OURS,),
    trainings=((3, 1), (3, 3)),
    redirect_seeds=1,
    redirect_tests=3,
    redirect_only=FEWEST,
    surface_points=7,
)


@dataclass(frozen=True)
class Experiment:
    """One piece of work.

    Attributes:
        group: part of the report. seed: of its movements.
        labels: what distinguishes it from others of its group and seed; the result contains them too.
        measure: computes it, from `arguments`.
    """

    group: str
    seed: int
    labels: dict[str, Any]
    measure: Callable[..., dict[str, Any]]
    arguments: tuple[Any, ...]

    @property
    def label(self) -> str:
        """Shown by the progress bar."""
        return ", ".join([self.group, *map(str, self.labels.values()), f"seed {self.seed}"])

    def key(self) -> str:
        """Name of the file of its result: another one for other arguments, code or libraries."""
        parts = [self.group, repr(self.labels), repr(self.arguments), self.measure.__module__]
        if "name" in self.labels:
            parts.append(repr(replace(BY_NAME[self.labels["name"]], thesis=None)))
        parts.append(code_digest(self.measure.__module__))
        parts += [f"{name} {version(name)}" for name in ("numpy", "scipy")]
        return hashlib.sha256("\n".join(parts).encode()).hexdigest()[:32]

    def run(self) -> dict[str, Any]:
        """The result as plain JSON."""
        result = self.measure(*self.arguments)
        return {"group": self.group, "fold": str(self.seed), "seed": self.seed, **self.labels, **result}


def experiments(seeds: Sequence[int], scale: Scale, *, with_hmmlearn: bool = True) -> list[Experiment]:
    """All work for these seeds, the slow models last."""
    work = [one for seed in seeds for one in _of_data(seed, scale, with_hmmlearn)]
    more = [seed for seed in range(scale.redirect_seeds) if seed not in seeds]
    for seed in [*seeds, *more][: max(len(seeds), scale.redirect_seeds)]:
        arguments = (seed, scale.redirect_tests, scale.redirect_only)
        work.append(Experiment(REDIRECT, seed, {}, redirects, arguments))
    work += [one for seed in seeds for one in _of_models(seed, scale)]
    return sorted(work, key=lambda one: "IPHMM" in one.labels.get("name", ""))


def _of_data(seed: int, scale: Scale, with_hmmlearn: bool) -> Iterator[Experiment]:
    yield Experiment(VARIATION, seed, {}, natural_variation, (seed, scale.compared))
    yield Experiment(FIT, seed, {}, fit_to_references, (seed,))
    yield Experiment(PLAIN, seed, {}, plain_rate, (seed,))
    yield Experiment(LINE, seed, {}, measured_line, (seed,))
    if with_hmmlearn:
        yield Experiment(HMMLEARN, seed, {}, hmmlearn_rate, (seed,))
    states = max(scale.states)
    arguments = (seed, states, scale.surface_points)
    yield Experiment(SURFACES, seed, {"states": states}, likelihood_surfaces, arguments)


def _of_models(seed: int, scale: Scale) -> Iterator[Experiment]:
    for states in scale.states:
        for name in scale.kinds:
            if states != scale.states[0] and name not in (*WITH_ALL_STATES, *BY_THESIS):
                continue
            labels = {"name": name, "states": states}
            yield Experiment(MODELS, seed, labels, measured_kind, (name, states, seed, scale.every))
    for name in scale.noisy:
        labels = {"name": name, "states": scale.states[0]}
        yield Experiment(NOISE, seed, labels, measured_noise, (name, scale.states[0], seed))
    for name in scale.learners:
        for side, repetitions in scale.trainings:
            if able(name, side, repetitions):
                labels = {"name": name, "side": side, "repetitions": repetitions}
                arguments = (name, side, repetitions, seed)
                yield Experiment(LEARNING, seed, labels, measured_learning, arguments)
