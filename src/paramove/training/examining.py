"""Recognition of movements by trained models: action, parameters with their uncertainty, or rejection."""

from __future__ import annotations

import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy.special import chdtri  # scipy.stats would take half a second to import

from paramove.demonstrations import BODY, DemonstrationError, Movement, in_body_frame, mirrored, resampled
from paramove.documents import Floats, InputError, renamed_attribute
from paramove.phmm import (
    MovementClassifier,
    ParameterEstimate,
    ParametricHMM,
    UnlikelyMovementWarning,
    has_p_values,
)
from paramove.training.drawing import bounds, description_of, parameter_names
from paramove.training.kinds import kind_of
from paramove.training.leaving_out import REGION, covers

SIGNIFICANCE_LEVEL = 0.01
"""A movement with a smaller p-value is rejected as none of the known actions."""
UNKNOWN_FRAMES = ("", "laboratory", "unspecified")
"""Names of frames in files of motion capture that carry no information."""


@dataclass(frozen=True)
class Recognition:
    """How one movement was recognised.

    Attributes:
        movement: as classified, in the frame and at the rate of the models.
        action: the most probable one.
        known: whether the movement is one of the known actions, by its p-value.
        posterior: probability of each action.
        estimate: of the action's parameters.
        parameter_names: of the components of theta.
        p_value: probability that a genuine movement has at least this outlier score; None if it is unknown: from models
            without p-values, or with a single training movement.
        outside: names of the parameters whose estimates are outside the bounds of the training.
        remarks: what makes it hardly a movement, or a beginning, at the frame rate of the training.
        labelled: theta of the label, as far as the model has its parameters; None without a label.
    """

    movement: Movement
    action: str
    known: bool
    posterior: dict[str, float]
    estimate: ParameterEstimate
    parameter_names: tuple[str, ...]
    p_value: float | None
    outside: tuple[str, ...]
    remarks: tuple[str, ...]
    labelled: Floats | None

    typicality = renamed_attribute("typicality", "p_value")

    @property
    def half_widths(self) -> Floats:
        """Half widths of the box around the 95 % confidence region of theta. Shape (P,)."""
        size = float(np.sqrt(chdtri(len(self.estimate.theta), 1.0 - REGION)))
        return size * np.sqrt(np.diagonal(self.estimate.covariance))

    def facts(self) -> dict[str, Any]:
        """Plain values for people and JSON."""
        facts: dict[str, Any] = {
            "movement": self.movement.source,
            "seconds": self.movement.duration,
            "action": self.action if self.known else None,
            "most_probable_action": self.action,
            "posterior": self.posterior,
            "theta": dict(zip(self.parameter_names, self.estimate.theta.tolist(), strict=True)),
            "theta_region_95": dict(zip(self.parameter_names, self.half_widths.tolist(), strict=True)),
            "theta_covariance": self.estimate.covariance.tolist(),
            "theta_outside_bounds": list(self.outside),
            "remarks": list(self.remarks),
            "p_value": self.p_value,
            "typicality": self.p_value,  # the old name, for one release
            "log_likelihood": self.estimate.log_likelihood,
        }
        if self.movement.action:
            facts["labelled_action"] = self.movement.action
        if self.labelled is not None:
            facts["labelled_theta"] = self.labelled.tolist()
            facts["labelled_theta_in_region"] = covers(self.estimate.theta, self.estimate.covariance, self.labelled)
        return facts


class Examiner:
    """Recognises movements with trained models.

    Args:
        classifier: of the actions; of a single model `MovementClassifier.from_models`.

    Raises InputError for models with different points, frames or rates, and for actions without theta.
    """

    def __init__(self, classifier: MovementClassifier) -> None:
        self.classifier = classifier
        self.models: Mapping[str, ParametricHMM] = classifier.models_
        without = sorted(set(classifier.classes_) - set(self.models))
        if without:
            raise InputError(
                f"these actions have no theta: {', '.join(without)}; ask MovementClassifier.load(FOLDER).classify in "
                "Python, or train a folder of actions that have"
            )
        self._about = [description_of(model) for model in self.models.values()]
        for about in self._about[1:]:
            for what in ("point_names", "frame", "rate_hz"):
                one, other = getattr(self._about[0], what), getattr(about, what)
                if one != other:
                    raise InputError(
                        f"competing models need the same {what.replace('_', ' ')}: {self._about[0].action} has "
                        f"{one}, {about.action} has {other}; train them from one set"
                    )
        scored = {_scored_by(model) for model in self.models.values()}
        if len(scored) > 1:
            raise InputError(
                "competing models need the same kind: all with correlated residuals, or all with the same states and "
                f"frames; found {'; '.join(sorted(kind_of(model) for model in self.models.values()))}"
            )

    def prepared(self, movement: Movement) -> Movement:
        """The movement with the points of the models, in their frame and at their rate.

        Raises DemonstrationError if a point is missing or the frame differs.
        """
        about = self._about[0]
        if about.frame == BODY and movement.frame != BODY:
            movement = in_body_frame(movement)
            movement = mirrored(movement) if movement.side == "left" else movement
        elif about.frame != movement.frame and movement.frame not in UNKNOWN_FRAMES:
            raise DemonstrationError(
                f"{movement.source}: its points are in the frame '{movement.frame}', those of the model in "
                f"'{about.frame}'; train with --body, which transforms every movement into the person's frame"
            )
        movement = _with_points(movement, about.point_names)
        return resampled(movement, about.rate_hz) if about.rate_hz else movement

    def examine(self, movement: Movement, *, finished: bool = True) -> Recognition:
        """Recognises a movement, or its beginning. Raises InputError with the reason if that is impossible."""
        prepared = self.prepared(movement)
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore", UnlikelyMovementWarning)  # they are the remarks
                action, posterior, estimate, p_value = self._classified(prepared, finished)
        except ValueError as error:
            raise DemonstrationError(f"{movement.source}: {error}") from error
        model = self.models[action]
        names = parameter_names(model)
        low, high = bounds(model)
        outside = tuple(
            name
            for name, value, minimum, maximum in zip(names, estimate.theta, low, high, strict=True)
            if not minimum <= value <= maximum
        )
        known = p_value is None or p_value >= SIGNIFICANCE_LEVEL
        labelled = _labelled(prepared, names)
        remarks = model.remarks(prepared.frames, finished=finished)
        return Recognition(prepared, action, known, posterior, estimate, names, p_value, outside, remarks, labelled)

    def _classified(
        self, movement: Movement, finished: bool
    ) -> tuple[str, dict[str, float], ParameterEstimate, float | None]:
        if len(self.models) == 1 and not finished:  # no other action whose beginning it could be
            ((action, model),) = self.models.items()
            if not has_p_values(model):
                return action, {action: 1.0}, model.estimate(movement.frames, finished=False), None
            examination = model.examine(movement.frames, finished=False)
            return action, {action: 1.0}, examination.estimate, _known(examination.p_value)
        result = self.classifier.classify(movement.frames, finished=finished)
        return result.action, result.posterior, result.estimates[result.action], _known(result.p_value)


def _known(p_value: float) -> float | None:
    """The p-value; None for NaN, which is unknown."""
    return None if np.isnan(p_value) else p_value


def _scored_by(model: ParametricHMM) -> tuple[object, ...]:
    """Models whose scores are comparable have the same of these."""
    return ("p_value",) if has_p_values(model) else (model.n_states, model.resampled_frames_)


def percent(probability: float) -> str:
    """A probability as text, without false certainty: "> 99.9 %" instead of "100 %"."""
    value = 100.0 * probability
    if value > 99.9:
        return "> 99.9 %"
    return f"{value:.1f} %" if value >= 0.1 else "< 0.1 %"


def confusion(recognitions: Sequence[Recognition]) -> dict[str, dict[str, int]]:
    """Labelled action -> recognised action -> count; "none" where the movement was rejected."""
    table: dict[str, dict[str, int]] = {}
    for one in recognitions:
        if one.movement.action:
            row = table.setdefault(one.movement.action, {})
            recognised = one.action if one.known else "none"
            row[recognised] = row.get(recognised, 0) + 1
    return table


def _with_points(movement: Movement, names: tuple[str, ...]) -> Movement:
    if not names or names == movement.point_names:
        return movement
    missing = [name for name in names if name not in movement.point_names]
    if missing:
        raise DemonstrationError(
            f"{movement.source}: the model needs {', '.join(names)}; missing are {', '.join(missing)}. The file has "
            f"{', '.join(movement.point_names)}: assign them with --mapping or --point"
        )
    order = [movement.point_names.index(name) for name in names]
    return replace(movement, positions=movement.positions[:, order], point_names=names)


def _labelled(movement: Movement, names: tuple[str, ...]) -> Floats | None:
    if not names or not set(names) <= set(movement.parameter_names):
        return None
    return np.array([movement.theta[movement.parameter_names.index(name)] for name in names])
