"""Models trained from examples and written to files, with facts about their training."""

from __future__ import annotations

import hashlib
import json
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

from paramove.documents import checked_name, replacing
from paramove.phmm import MovementClassifier, ParametricHMM
from paramove.training.examples import Examples
from paramove.training.kinds import kind_of
from paramove.training.leaving_out import LeaveOutResult, LeftOutBy, leave_out

Make = Callable[[], ParametricHMM]
FACTS_ENDING = ".training.json"
"""Of the file next to a model with facts about its training and cross-validation."""


@dataclass(frozen=True)
class Trained:
    """A model of one action.

    Attributes:
        model: trained.
        examples: what it was trained with.
        seconds: duration of the training.
        file: where it was written.
        left_out: result of the cross-validation; None if there was none.
    """

    model: ParametricHMM
    examples: Examples
    seconds: float
    file: Path
    left_out: LeaveOutResult | None = None

    @property
    def action(self) -> str:
        """Name of the action."""
        return self.examples.actions[0]

    def facts(self) -> dict[str, Any]:
        """Numbers for people and JSON."""
        examples, model = self.examples, self.model
        low_high = zip(examples.theta.min(axis=0).tolist(), examples.theta.max(axis=0).tolist(), strict=True)
        facts: dict[str, Any] = {
            "action": self.action,
            "model": kind_of(model),
            "source": examples.source,
            "sequences": len(examples),
            "thetas": len({tuple(row) for row in examples.theta.tolist()}),
            "persons": sorted({name for name in examples.subjects if name}),
            "frames": sum(map(len, examples.sequences)),
            "rate_hz": examples.rate_hz,
            "bounds": {name: list(pair) for name, pair in zip(examples.parameter_names, low_high, strict=True)},
            "states": model.n_states,
            "frames_per_state": [model.d_min_, model.d_max_],
            "resampled_frames": model.resampled_frames_,
            "seconds": self.seconds,
        }
        summary = model.training_
        if summary is not None:
            facts |= {
                "iterations": len(summary.log_likelihoods),
                "converged": summary.converged,
                "log_likelihood_per_frame": summary.log_likelihoods[-1] / summary.n_frames,
            }
        facts["left_out"] = None if self.left_out is None else self.left_out.summary()
        facts["file"] = str(self.file)
        return facts


@dataclass(frozen=True)
class Training:
    """Trained models that are not written yet.

    Attributes:
        trained: the model of each action.
        whole: what is written: the model, or the classifier of all.
        goal: file or folder.
    """

    trained: tuple[Trained, ...]
    whole: ParametricHMM | MovementClassifier
    goal: Path

    def checked(self, make: Mapping[str, Make], by: LeftOutBy, finished: Callable[[str, int, int], None]) -> Training:
        """The same with the result of the cross-validation (`leave_out`) of each model.

        `finished` is called with the action, the finished folds and all folds. Raises ValueError if a fold cannot be
        trained.
        """
        return replace(self, trained=tuple(
            replace(one, left_out=leave_out(one.examples, make[one.action], by, partial(finished, one.action)))
            for one in self.trained
        ))  # fmt: skip

    def write(self) -> None:
        """Write models and facts. Files appear when they are complete; raises OSError if nothing can be written."""
        self.goal.parent.mkdir(parents=True, exist_ok=True)
        self.whole.save(self.goal)
        for one in self.trained:
            _write_facts(one)


def train(examples: Examples, make: Mapping[str, Make], goal: Path) -> Training:
    """Train a model of one action, or models of several and their classifier; nothing is written.

    Args:
        examples: of all actions.
        make: gives the untrained model of each.
        goal: file of one model, or folder of the classifier.

    Raises ValueError for examples that do not fit, InputError for the name of an action that no file can have.
    """
    for action in examples.actions:
        checked_name(action, "action")
    began_s = time.perf_counter()
    if len(examples.actions) == 1:
        (one,) = make.values()
        model = one().fit(examples.sequences, examples.theta, examples.groups)
        trained = Trained(model, examples, time.perf_counter() - began_s, goal)
        return Training((trained,), model, goal)
    classifier = MovementClassifier({action: one() for action, one in make.items()})
    classifier.fit(examples.sequences, examples.theta, examples.labels, examples.groups)
    seconds = time.perf_counter() - began_s
    return Training(
        tuple(
            Trained(model, examples.of_action(action), seconds, goal / f"{action}.model.npz")
            for action, model in classifier.models_.items()
        ),
        classifier,
        goal,
    )


def training_facts(file: Path) -> dict[str, Any] | None:
    """Facts that were written when the model in a file was trained; None if they are missing or of another file."""
    facts_file = file.with_suffix(FACTS_ENDING)
    try:
        facts = json.loads(facts_file.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return None
    if not isinstance(facts, dict) or facts.get("sha256") != checksum(file):
        return None
    return facts


def checksum(file: Path) -> str:
    """SHA-256 of a file."""
    return hashlib.sha256(file.read_bytes()).hexdigest()


def _write_facts(trained: Trained) -> None:
    facts = trained.facts() | {"sha256": checksum(trained.file)}
    facts_file = trained.file.with_suffix(FACTS_ENDING)
    with replacing(facts_file) as unfinished:
        unfinished.write_text(json.dumps(facts, indent=2, ensure_ascii=False) + "\n", encoding="utf-8")
