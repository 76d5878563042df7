"""What a tracker of chapter 6 knows: actions, grammar, and where theta leads, for each kind of clip (thesis 6.7)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache, partial
from pathlib import Path

import numpy as np

from paramove.action_space import (
    ActionModel,
    Grammar,
    PersonPlacement,
    Vocabulary,
    cached_action,
    parsed_grammar,
    table_target,
)
from paramove.documents import Floats
from sim.persons.actions import EYE, FAR_ORIGIN, SHOWN, far_place
from sim.persons.performances import recording_of
from sim.persons.recorded import direction_place, recorded_demonstrations

COMPLEX_POINTING = """
begin: point(a)
after:
  point(a):
    - redirect(a, b)
    - withdraw(a)
  redirect(a, b): withdraw(b)
  withdraw(b): point(a)
switching: {share: 0.1, before: 0.8}
"""
"""Simple and dual pointing, figure 6.26. What follows a target may be taken for the other until late: where the second
target is not known, few hypotheses of going on to it are near the right one, and at first going back fits better."""

ACTIONS: dict[str, tuple[str, ...]] = {
    "pointing_50fps": ("pointing",),
    "pointing": ("pointing",),
    "pointing_far": ("pointing_far",),
    "pouring": ("pouring",),
    "box": ("table_to_box", "box_to_table"),
    "complex": ("point", "redirect", "withdraw"),
    "recorded": ("recorded_pointing",),
}
"""Of each kind of clip."""
BY_OTHERS = "recorded_by_others"
"""Clips of kind "recorded" again, with a model of the two other persons."""


@dataclass(frozen=True)
class Knowledge:
    """The models of a tracker.

    Attributes:
        vocabulary, grammar: of the actions.
        pointed: from the target of the tracker's theta (3,) and the person's placement to the target
            in the world, (3,), m.
    """

    vocabulary: Vocabulary
    grammar: Grammar
    pointed: Callable[[Floats, PersonPlacement], Floats]


def knowledge_of(kind: str, number: int, folder: Path | None = None) -> Knowledge:
    """What is known when a clip is tracked.

    Of a recorded person: this person's demonstrations in all other directions (kind "recorded"), or the other persons'
    demonstrations in all directions (`BY_OTHERS`).

    Args:
        kind, number: of the clip. folder: of the recordings; only for recorded persons.

    Raises RecordingsError for recorded persons where the recordings are absent.
    """
    if kind not in ("recorded", BY_OTHERS):
        return _knowledge(kind)
    played = recording_of(number, folder)
    return _of_recorded(played.subject, None if kind == BY_OTHERS else played.target_id, folder)


@cache
def _of_recorded(subject: int, target: int | None, folder: Path | None) -> Knowledge:
    vocabulary = Vocabulary([_recorded_action(subject, target, folder)])
    return Knowledge(vocabulary, Grammar.choice(list(vocabulary.names)), as_it_is)


@cache
def _knowledge(kind: str) -> Knowledge:
    names = ACTIONS[kind]
    vocabulary = Vocabulary([_action(name) for name in names])
    grammar = parsed_grammar(COMPLEX_POINTING) if kind == "complex" else Grammar.choice(list(names))
    return Knowledge(vocabulary, grammar, on_far_plane if kind == "pointing_far" else as_it_is)


def as_it_is(target: Floats, placement: PersonPlacement) -> Floats:
    """A target within reach is the target itself."""
    return target


def on_far_plane(target: Floats, placement: PersonPlacement) -> Floats:
    """Where the line from the person's eye through a far target meets the plane, which stands in the world. (3,), m.

    The models' plane grows with the person; the plane that is pointed at does not.
    """
    eye = placement.in_world(EYE)
    line = target - eye
    return np.asarray(eye + (FAR_ORIGIN[0] - eye[0]) / line[0] * line)


def _action(name: str) -> ActionModel:
    target = far_place if name == "pointing_far" else table_target
    return cached_action(name, "chapter 6, training movements", SHOWN[name], target=target)


def _recorded_action(subject: int, target: int | None, folder: Path | None) -> ActionModel:
    """Of the person without the movements to a target, or, without one, of all other persons."""
    if target is None:
        description, show = f"without person {subject}", partial(recorded_demonstrations, subject, folder)
    else:
        description = f"person {subject} without target {target}"
        show = partial(recorded_demonstrations, None, folder, of_subject=subject, without_target=target)
    source = f"pointing27 {description}, {folder or 'usual folder'}"
    return cached_action("recorded_pointing", source, show, target=direction_place)
