"""Which action may follow which, and how their parameters are bound (thesis 6.7.1 to 6.7.3)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from paramove.action_space.vocabulary import PLACE_SIZE, Vocabulary
from paramove.documents import Floats, InputError, Ints, nearest

NEW = -1
"""In a binding: this place is unknown and drawn anew."""
BASE = -1
"""Origin of particles that began from the base pose."""


@dataclass(frozen=True)
class Follower:
    """A step that may come next.

    Attributes:
        step: its number.
        weight: probability relative to the other followers.
        binding: for each of its places the number of the place of the step before that it takes over, or NEW.
    """

    step: int
    weight: float
    binding: tuple[int, ...]


@dataclass(frozen=True)
class Step:
    """One state of the grammar: an action with named places.

    Attributes:
        name: as written, such as redirect.
        action: name of the action in the vocabulary.
        places: names, such as (a, b).
        followers: what may come when its progress exceeds 1.
    """

    name: str
    action: str
    places: tuple[str, ...]
    followers: tuple[Follower, ...]


@dataclass(frozen=True)
class Switching:
    """Particles at the very beginning of an action change to another one that might have begun (6.7.2).

    Attributes:
        share: fraction of the particles, in each frame at 8 fps.
        before: for progress up to this.
    """

    share: float = 0.2
    before: float = 0.1

    def __post_init__(self) -> None:
        """Raises InputError for values outside [0, 1]."""
        if not (0.0 <= self.share < 1.0 and 0.0 <= self.before <= 1.0):
            raise InputError(f"share and before of switching lie between 0 and 1, found {self.share}, {self.before}")


@dataclass(frozen=True)
class Grammar:
    """A state machine over actions; the base pose is where its first steps begin.

    Attributes:
        steps: all of them. begin: numbers of those that begin from the base pose.
        switching: among the steps that might have come instead, those of `begin` or the followers of the step before.
    """

    steps: tuple[Step, ...]
    begin: tuple[int, ...]
    switching: Switching = Switching()

    @classmethod
    def loop(cls, action: str, n_places: int = 1) -> Grammar:
        """One action again and again, each time with new parameters (6.7.1)."""
        return cls.choice([action], n_places)

    @classmethod
    def choice(cls, actions: list[str], n_places: int = 1) -> Grammar:
        """After each execution any of the actions (6.7.2, figure 6.23)."""
        places = tuple("abcdefgh"[:n_places])
        followers = tuple(Follower(number, 1.0, (NEW,) * n_places) for number in range(len(actions)))
        steps = tuple(Step(action, action, places, followers) for action in actions)
        return cls(steps, tuple(range(len(actions))))

    def check(self, vocabulary: Vocabulary) -> None:
        """Raises InputError unless the vocabulary has each action, with as many places as the steps name."""
        for step in self.steps:
            if step.action not in vocabulary.names:
                hint = nearest(step.action, vocabulary.names)
                raise InputError(f"step {step.name!r}: no action {step.action!r} in the vocabulary; {hint}")
            n_places = vocabulary.actions[vocabulary.index(step.action)].n_parameters // PLACE_SIZE
            if n_places != len(step.places):
                raise InputError(
                    f"step {step.name!r}: action {step.action!r} has {n_places} place(s), the grammar names "
                    f"{len(step.places)}: ({', '.join(step.places)})"
                )

    def actions(self, vocabulary: Vocabulary) -> Ints:
        """Number of the action of each step."""
        return np.array([vocabulary.index(step.action) for step in self.steps], dtype=np.int64)

    def free_components(self, n_parameters: int) -> NDArray[np.bool_]:
        """Which components of theta are unknown when a step begins, shape (steps, P).

        A place is known if every step before hands it over; then it does not diffuse (6.7.3).
        """
        known = {(number, place) for number, step in enumerate(self.steps) for place in range(len(step.places))}
        for follower in (follower for step in self.steps for follower in step.followers):
            known -= {(follower.step, place) for place, source in enumerate(follower.binding) if source == NEW}
        known -= {(number, place) for number in self.begin for place in range(len(self.steps[number].places))}
        reached = {follower.step for step in self.steps for follower in step.followers}
        free = np.zeros((len(self.steps), n_parameters), dtype=np.bool_)
        for number, step in enumerate(self.steps):
            for place in range(len(step.places)):
                free[number, PLACE_SIZE * place : PLACE_SIZE * (place + 1)] = (
                    number not in reached or (number, place) not in known
                )
        return free

    def beginning(self, n_particles: int, n_parameters: int, rng: np.random.Generator) -> tuple[Ints, Floats]:
        """Steps (M,) that begin and parameters (M, P) drawn from the prior, uniform in [0, 1] (6.4.4)."""
        steps = np.asarray(self.begin, dtype=np.int64)[rng.integers(len(self.begin), size=n_particles)]
        return steps, rng.random((n_particles, n_parameters))

    def advance(self, step: Ints, origin: Ints, theta: Floats, tau: Floats, rng: np.random.Generator) -> Ints:
        """Moves particles whose progress exceeds 1 to a next step, in place; the rows of those that moved.

        tau becomes tau - 1; the origin becomes the step before; bound places are handed over, new ones are drawn from
        the prior.
        """
        moved = np.zeros(len(tau), dtype=np.bool_)
        while (over := tau > 1.0).any():
            moved |= over
            before = step.copy()
            for number in np.unique(before[over]):
                self._leave(int(number), np.flatnonzero(over & (before == number)), step, theta, rng)
            origin[over] = before[over]
            tau[over] -= 1.0
        return np.flatnonzero(moved)

    def _leave(self, number: int, rows: Ints, step: Ints, theta: Floats, rng: np.random.Generator) -> None:
        followers = self.steps[number].followers
        cumulative = np.cumsum([follower.weight for follower in followers])
        chosen = np.searchsorted(cumulative / cumulative[-1], rng.random(len(rows)), side="right")
        before, drawn = theta[rows], rng.random((len(rows), theta.shape[1]))
        for index, follower in enumerate(followers):
            own = chosen == index
            step[rows[own]] = follower.step
            for place, source in enumerate(follower.binding):
                to = slice(PLACE_SIZE * place, PLACE_SIZE * (place + 1))
                values = drawn[:, to] if source == NEW else before[:, PLACE_SIZE * source : PLACE_SIZE * (source + 1)]
                theta[rows[own], to] = values[own]

    def switch(
        self, step: Ints, origin: Ints, theta: Floats, tau: Floats, fraction: float, rng: np.random.Generator
    ) -> Ints:
        """Changes a fraction of the particles at the beginning of a step to an alternative step, in place; their rows.

        A place that both steps have from the step before, or that is new in both, stays; others are drawn.
        """
        early = np.flatnonzero((tau <= self.switching.before) & (rng.random(len(tau)) < fraction))
        switched = []
        for number in np.unique(origin[early]):
            choices = self._beginnings if number == BASE else self.steps[number].followers
            own = early[origin[early] == number]
            for index, choice in enumerate(choices if len(choices) > 1 else ()):
                rows = own[step[own] == choice.step]
                others = (index + rng.integers(1, len(choices), size=len(rows))) % len(choices)
                switched.append((choice, choices, rows, others))
        for choice, choices, rows, others in switched:
            for index, other in enumerate(choices):
                self._replace(choice, other, rows[others == index], step, theta, rng)
        return np.concatenate([rows for _, _, rows, _ in switched]) if switched else early[:0]

    @property
    def _beginnings(self) -> tuple[Follower, ...]:
        return tuple(Follower(number, 1.0, (NEW,) * len(self.steps[number].places)) for number in self.begin)

    def _replace(
        self, old: Follower, new: Follower, rows: Ints, step: Ints, theta: Floats, rng: np.random.Generator
    ) -> None:
        before, drawn = theta[rows], rng.random((len(rows), theta.shape[1]))
        unmatched = list(enumerate(old.binding))
        for place, source in enumerate(new.binding):
            match = next((one for one in unmatched if one[1] == source), None)
            to = slice(PLACE_SIZE * place, PLACE_SIZE * (place + 1))
            if match is None:
                theta[rows, to] = drawn[:, to]
                continue
            unmatched.remove(match)
            theta[rows, to] = before[:, PLACE_SIZE * match[0] : PLACE_SIZE * (match[0] + 1)]
        step[rows] = new.step
