"""Everything that is computed for the report on thesis chapter 4, as pieces of work that are stored one by one."""

from __future__ import annotations

import ast
import hashlib
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from importlib import import_module
from importlib.metadata import version
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from paramove.evaluation.chapter4.kinds import (
    BY_NAME,
    IPHMM_2,
    IPHMM_3,
    KINDS,
    LPHMM_3,
    OURS,
    QPHMM_3,
)
from paramove.evaluation.chapter4.learning import LEARNERS, TRAININGS, able, measured_learning
from paramove.evaluation.chapter4.line_movement import measured_line
from paramove.evaluation.chapter4.measurement import measured_kind, measured_noise
from paramove.evaluation.chapter4.raster import REPETITIONS
from paramove.evaluation.chapter4.redirect import FEWEST, redirect_experiment
from paramove.evaluation.chapter4.variation import (
    fit_to_references,
    hmmlearn_rate,
    likelihood_surfaces,
    natural_variation,
    plain_rate,
)
from paramove.evaluation.movements.sweep import code_digest

MODELS, NOISE, LEARNING, LINE, REDIRECT = "models", "noise", "learning", "line", "redirect"
VARIATION, FIT, SURFACES, HMMLEARN, PLAIN = "variation", "fit to averages", "surfaces", "hmmlearn", "plain HMM"

SOURCES = (
    "paramove.alignment",
    "paramove.demonstrations.arm",
    "paramove.demonstrations.blending",
    "paramove.demonstrations.reaching",
    "paramove.demonstrations.synthetic",
    "paramove.evaluation.chapter2.movement",
    "paramove.evaluation.chapter4.raster",
    "paramove.evaluation.movements.measures:theta_error",
    "paramove.evaluation.movements.measures:covered",
    "paramove.evaluation.movements.tasks:raster_tasks",
    "paramove.hmm",
)


BY_THESIS = tuple(kind.name for kind in KINDS if kind.thesis)
WITH_ALL_STATES = (LPHMM_3 + OURS, QPHMM_3 + OURS)
"""What is also trained with more states: the thesis's models, and ours of the same training."""


@dataclass(frozen=True)
class Scale:
    """How much is computed.

    Attributes:
        states: numbers of states, the first for all models. kinds: names of models. noisy: those shown noise.
        every: each so many-th test movement is asked. compared: movements per place whose pairs are compared.
        learners, trainings: of the learning curves.
        redirect_seeds: least number of seeds. redirect_tests: pairs of places. redirect_only: part of the names of
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
        group: to which part of the report it belongs. seed: of its movements.
        labels: what distinguishes it from others of its group and seed; they stand in the result too.
        measure: computes it, from `arguments`.
        sources: modules of this project beside `SOURCES` that decide its result.
    """

    group: str
    seed: int
    labels: dict[str, Any]
    measure: Callable[..., dict[str, Any]]
    arguments: tuple[Any, ...]
    sources: tuple[str, ...] = ()

    @property
    def label(self) -> str:
        """As the progress shows it."""
        return ", ".join([self.group, *map(str, self.labels.values()), f"seed {self.seed}"])

    def key(self) -> str:
        """Name of the file of its result: another one for other arguments, code or libraries."""
        parts = [self.group, repr(self.labels), repr(self.arguments), self.measure.__module__]
        if "name" in self.labels:
            parts.append(repr(replace(BY_NAME[self.labels["name"]], thesis=None)))
        parts += [code_digest(source) for source in (self.measure.__module__, *SOURCES, *self.sources)]
        parts += [f"{name} {version(name)}" for name in ("numpy", "scipy")]
        return hashlib.sha256("\n".join(parts).encode()).hexdigest()[:32]

    def run(self) -> dict[str, Any]:
        """The result as plain JSON."""
        found = self.measure(*self.arguments)
        return {"group": self.group, "fold": str(self.seed), "seed": self.seed, **self.labels, **found}


def experiments(seeds: Sequence[int], scale: Scale, *, with_hmmlearn: bool = True) -> list[Experiment]:
    """All work for these seeds, the slow models last."""
    found = [one for seed in seeds for one in _of_data(seed, scale, with_hmmlearn)]
    more = [seed for seed in range(scale.redirect_seeds) if seed not in seeds]
    for seed in [*seeds, *more][: max(len(seeds), scale.redirect_seeds)]:
        found.append(
            Experiment(
                REDIRECT,
                seed,
                {},
                _redirects,
                (seed, scale.redirect_tests, scale.redirect_only),
                POLYNOMIAL + INTERPOLATIVE,
            )
        )
    found += [one for seed in seeds for one in _of_models(seed, scale)]
    return sorted(found, key=lambda one: "IPHMM" in one.labels.get("name", ""))


def _of_data(seed: int, scale: Scale, with_hmmlearn: bool) -> Iterator[Experiment]:
    yield Experiment(VARIATION, seed, {}, natural_variation, (seed, scale.compared))
    yield Experiment(FIT, seed, {}, fit_to_references, (seed,), POLYNOMIAL)
    yield Experiment(PLAIN, seed, {}, plain_rate, (seed,))
    yield Experiment(LINE, seed, {}, measured_line, (seed,), POLYNOMIAL)
    if with_hmmlearn:
        likeness = ("paramove.evaluation.chapter4.class_likeness",)
        yield Experiment(HMMLEARN, seed, {}, hmmlearn_rate, (seed,), likeness)
    states = max(scale.states)
    arguments = (seed, states, scale.surface_points)
    yield Experiment(SURFACES, seed, {"states": states}, likelihood_surfaces, arguments, POLYNOMIAL + INTERPOLATIVE)


def _of_models(seed: int, scale: Scale) -> Iterator[Experiment]:
    unfinished = "paramove.evaluation.chapter4.unfinished"
    for states in scale.states:
        for name in scale.kinds:
            if states != scale.states[0] and name not in (*WITH_ALL_STATES, *BY_THESIS):
                continue
            labels = {"name": name, "states": states}
            sources = (*_sources(name), "paramove.phmm.classification", unfinished)
            yield Experiment(MODELS, seed, labels, measured_kind, (name, states, seed, scale.every), sources)
    for name in scale.noisy:
        labels = {"name": name, "states": scale.states[0]}
        yield Experiment(NOISE, seed, labels, measured_noise, (name, scale.states[0], seed), _sources(name))
    for name in scale.learners:
        for side, repetitions in scale.trainings:
            if able(name, side, repetitions):
                labels = {"name": name, "side": side, "repetitions": repetitions}
                arguments = (name, side, repetitions, seed)
                sources = (*_sources(name), "paramove.evaluation.chapter4.measurement")
                yield Experiment(LEARNING, seed, labels, measured_learning, arguments, sources)


def _redirects(seed: int, tests: int, only: str) -> dict[str, Any]:
    rows = redirect_experiment(seed, tests, only)
    return {"values": {"jerk": [row["jerk_ratio"] for row in rows]}, "rows": rows}


@lru_cache
def modules_behind(module: str) -> tuple[str, ...]:
    """A module of this project and all of its package that it imports, directly or through others."""
    package = module.rpartition(".")[0]
    found, open_ends = {module}, [module]
    while open_ends:
        tree = ast.parse(Path(str(import_module(open_ends.pop()).__file__)).read_text(encoding="utf-8"))
        nodes = [node for node in ast.walk(tree) if isinstance(node, ast.ImportFrom)]
        imported = {str(node.module) for node in nodes if str(node.module).startswith(f"{package}.")}
        whole = {f"{package}.{one.name}" for node in nodes if node.module == package for one in node.names}
        new = (imported | {name for name in whole if find_spec(name)}) - found
        found |= new
        open_ends += sorted(new)
    return tuple(sorted(found))


POLYNOMIAL = modules_behind("paramove.phmm.polynomial")
INTERPOLATIVE = modules_behind("paramove.phmm.interpolative")


def _sources(name: str) -> tuple[str, ...]:
    return modules_behind(BY_NAME[name].make.__module__)
