"""The tasks: what is trained, what is tested, and along which folds.

A fold leaves out a whole direction, person or grid, never single repetitions at random:

- `pointing/direction`: per person, one of the targets is left out.
- `pointing/corners`: per person, trained on the targets in the corners of the grid, those of all depths together,
  tested on all others.
- `pointing/four corners`: the same per depth: four directions are learned, all others of that depth tested.
- `pointing/planes`: per person, the middle column or the middle row of the targets is left out.
- `pointing/new person`: one person is left out; `pointing/new person, 3 movements`: but for three drawn movements.
- `table/<action>`: one person is left out; both hands together. Drinking counts up to the grasp.
- `table/<action>, 5 persons`, `table/actions, 5 persons`: five drawn persons are learned, the others tested.
- `table/actions`: the kinds of movement, one person left out; whole movements.
- `table/beginnings`: the same while they go on, all cut at their beginning by one absolute rule.
- `table/first 100 ms` and more: the same, every movement is cut after that time.
- `raster/<action>`, `raster/actions`, `raster/beginnings`: the synthetic demonstrator; 3 x 3 targets 10 times against
  7 x 5 targets 4 times; a fold is a seed.
- `scripted/same`, `scripted/3 mm`: minimum-jerk movements of a point to 3 x 3 targets, 4 times with 1 mm of noise; the
  latter with ends that vary by 3 mm. `raster/1 repetition`, 2, 5, 20: the demonstrator's reaching. Each fold is a set.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from operator import attrgetter
from pathlib import Path

import numpy as np

from paramove.demonstrations import (
    RATE_HZ,
    SAMPLE_RATE_HZ,
    RecordedMovement,
    Recordings,
    RecordingsError,
    data_folder,
    demonstrations_at,
    load_recordings,
    table_targets,
)
from paramove.documents import Floats
from paramove.hmm import minimum_jerk
from studies.movements.measures import ThetaKind
from studies.movements.method import Examples, joined
from studies.movements.per_action import first_frames

GRID_ACTIONS = ("reaching", "pointing")
FIRST_MS = (100, 200, 400)
FEW_PERSONS, DRAWS = 5, 2
KNOWN, ADAPTATIONS = 3, 4
"""How many movements of a new person are known, and how often these are drawn."""
REPETITIONS = (1, 2, 5, 20)
SCRIPTED = {"same": 0.0, "3 mm": 0.003}
"""Standard deviation of where scripted movements begin and end, m."""
SCRIPTED_NOISE_M, SCRIPTED_FRAMES = 0.001, 100


@dataclass(frozen=True)
class Fold:
    """Training and test of one fold.

    Attributes:
        task, name: which; folds of one task have different names.
        train, test: movements.
        others: movements of other kinds by whom or what was left out, for rejection.
        kind: what theta is.
        beginnings: the kind is estimated while the movement goes on.
        own: a few movements of the person who is tested, to adapt to.
    """

    task: str
    name: str
    train: Examples
    test: Examples
    others: list[Floats]
    kind: ThetaKind
    beginnings: bool = False
    own: Examples | None = None

    @property
    def several_actions(self) -> bool:
        """Whether classification is the task."""
        return len(self.train.actions) > 1


def real_tasks(folder: Path | None = None) -> dict[str, list[Fold]]:
    """All tasks on recorded people, by name; those of a data set that the folder does not have are left out.

    Raises RecordingsError where there is no folder, no data set, or a damaged one.
    """
    root = data_folder(folder)
    present = [name for name in ("pointing27", "table_reach") if (root / name / "data.npz").is_file()]
    if not present:
        raise RecordingsError(f"{root} has neither pointing27/data.npz nor table_reach/data.npz")
    tasks: dict[str, list[Fold]] = {}
    if "pointing27" in present:
        pointing = load_recordings("pointing27", root)
        tasks |= {"pointing/direction": _directions(pointing), "pointing/corners": _corners(pointing)}
        tasks |= {"pointing/four corners": _four_corners(pointing), "pointing/planes": _planes(pointing)}
        tasks |= {"pointing/new person": _new_persons(pointing, 0, 1)}
        tasks |= {f"pointing/new person, {KNOWN} movements": _new_persons(pointing, KNOWN, ADAPTATIONS)}
    if "table_reach" in present:
        tasks |= _table_tasks(load_recordings("table_reach", root))
    return {name: folds for name, folds in tasks.items() if folds}


def _table_tasks(table: Recordings) -> dict[str, list[Fold]]:
    with_target = [action for action in table.actions if np.isfinite(_targets(table.of(action=action))).all()]
    tasks = {f"table/{action}": _persons(table, action) for action in with_target}
    tasks |= {name: _few_persons(table, name, [action], _TO_GRASP) for action in with_target for name in [_few(action)]}
    if len(table.actions) > 1:
        tasks[_few("actions")] = _few_persons(table, _few("actions"), table.actions, _WHOLE)
        tasks["table/actions"] = _kinds(table, "table/actions", _WHOLE)
        tasks["table/beginnings"] = _kinds(table, "table/beginnings", _FROM_ONSET, beginnings=True)
        for milliseconds in FIRST_MS:
            name = f"table/first {milliseconds} ms"
            tasks[name] = _kinds(table, name, _first(milliseconds))
    return tasks


def grid_tasks(seeds: Sequence[int] = (0, 1, 2, 3, 4)) -> dict[str, list[Fold]]:
    """All tasks on the synthetic demonstrator, by name."""
    tasks: dict[str, list[Fold]] = {f"raster/{action}": [] for action in (*GRID_ACTIONS, "actions", "beginnings")}
    for seed in seeds:
        train = {action: _grid(action, 3, 3, 10, [seed, 0]) for action in GRID_ACTIONS}
        test = {action: _grid(action, 7, 5, 4, [seed, 1]) for action in GRID_ACTIONS}
        for action, other in zip(GRID_ACTIONS, GRID_ACTIONS[::-1], strict=True):
            others = test[other].sequences
            tasks[f"raster/{action}"].append(
                Fold(f"raster/{action}", str(seed), train[action], test[action], others, "raster")
            )
        both, tests = joined(train.values()), joined(test.values())
        tasks["raster/actions"].append(Fold("raster/actions", str(seed), both, tests, [], "raster"))
        tasks["raster/beginnings"].append(Fold("raster/beginnings", str(seed), both, tests, [], "raster", True))
    return tasks


def few_tasks(seeds: Sequence[int] = tuple(range(20))) -> dict[str, list[Fold]]:
    """Few or tidy demonstrations, of synthetic movements, by name."""
    tasks = {
        f"scripted/{name}": [
            Fold(f"scripted/{name}", str(seed), *_scripted(deviation, seed), [], "place") for seed in seeds
        ]
        for name, deviation in SCRIPTED.items()
    }
    for repetitions in REPETITIONS:
        name = f"raster/{repetitions} repetition{'s' if repetitions > 1 else ''}"
        tasks[name] = [
            Fold(name, str(seed), _grid("reaching", 3, 3, repetitions, [seed, 2]),
                 _grid("reaching", 7, 5, 2, [seed, 3]), [], "raster")
            for seed in seeds
        ]  # fmt: skip
    return tasks


def _scripted(deviation: float, seed: int) -> tuple[Examples, Examples]:
    """Training and test of movements along a line to targets of a table, as a script or a robot makes them."""
    rng = np.random.default_rng([seed, 4])

    def to(targets: Floats, repetitions: int) -> Examples:
        theta = np.repeat(targets[:, :2], repetitions, axis=0)
        progress = minimum_jerk(np.linspace(0.0, 1.0, SCRIPTED_FRAMES), 0.0, 1.0)[:, None]
        sequences = []
        for target in np.repeat(targets, repetitions, axis=0):
            begin, end = deviation * rng.standard_normal((2, 3))
            noise = SCRIPTED_NOISE_M * rng.standard_normal((SCRIPTED_FRAMES, 3))
            sequences.append(begin + progress * (target + end - begin) + noise)
        groups = np.repeat(np.arange(len(targets)), repetitions)
        return Examples(sequences, theta, ["scripted"] * len(theta), groups, SAMPLE_RATE_HZ, 0)

    return to(table_targets(3, 3)[0], 4), to(table_targets(7, 5)[0], 4)


def _directions(pointing: Recordings) -> list[Fold]:
    folds = []
    for subject in pointing.subjects:
        own = pointing.of(subject=subject)
        for target in sorted({one.target_id for one in own}):
            train = [one for one in own if one.target_id != target]
            test = [one for one in own if one.target_id == target]
            if train:
                folds.append(_pointing_fold("pointing/direction", f"{subject}/{target}", pointing, train, test))
    return folds


def _corners(pointing: Recordings) -> list[Fold]:
    folds = []
    for subject in pointing.subjects:
        own = pointing.of(subject=subject)
        corners = corner_targets({one.target_id: one.target for one in own})
        train = [one for one in own if one.target_id in corners]
        test = [one for one in own if one.target_id not in corners]
        if train and test:
            folds.append(_pointing_fold("pointing/corners", str(subject), pointing, train, test))
    return folds


def _four_corners(pointing: Recordings) -> list[Fold]:
    folds = []
    for subject in pointing.subjects:
        own = pointing.of(subject=subject)
        positions = {one.target_id: one.target for one in own}
        corners = corner_targets(positions)
        depths = np.array([positions[number][0] for number in sorted(corners)])
        for depth in _levels(depths):
            level = [one for one in own if abs(one.target[0] - depth) <= 0.15 * np.ptp(depths)]
            train = [one for one in level if one.target_id in corners]
            test = [one for one in level if one.target_id not in corners]
            if train and test:
                name = f"{subject}/{depth:.2f}"
                folds.append(_pointing_fold("pointing/four corners", name, pointing, train, test))
    return folds


def _planes(pointing: Recordings) -> list[Fold]:
    folds = []
    for subject in pointing.subjects:
        own = pointing.of(subject=subject)
        positions = np.array(list({one.target_id: one.target for one in own}.values()))
        for axis, name in ((1, "column"), (2, "row")):
            levels = _levels(positions[:, axis])
            if len(levels) < 3:
                continue
            middle, width = levels[len(levels) // 2], 0.15 * np.ptp(positions[:, axis])
            train = [one for one in own if abs(one.target[axis] - middle) >= width]
            test = [one for one in own if abs(one.target[axis] - middle) < width]
            folds.append(_pointing_fold("pointing/planes", f"{subject}/{name}", pointing, train, test))
    return folds


def _new_persons(pointing: Recordings, n_known: int, draws: int) -> list[Fold]:
    folds, name = [], f"pointing/new person, {n_known} movements" if n_known else "pointing/new person"
    for number, subject in enumerate(pointing.subjects):
        train = [one for one in pointing.movements if one.subject != subject]
        tested = list(pointing.of(subject=subject))
        for draw in range(draws if train else 0):
            chosen = set(np.random.default_rng([number, draw]).permutation(len(tested))[:n_known].tolist())
            others = [one for number, one in enumerate(tested) if number not in chosen]
            fold = _pointing_fold(name, f"{subject}/{draw}", pointing, train, others, by_person=True)
            known = [tested[number] for number in sorted(chosen)]
            own = _pointing_fold(name, "", pointing, known, [], by_person=True).train if known else None
            folds.append(replace(fold, own=own))
    return folds


def _levels(values: Floats) -> list[float]:
    """Centres of clusters of positions that lie farther apart than a tenth of their range."""
    ordered = np.sort(values)
    parts = np.split(ordered, np.flatnonzero(np.diff(ordered) > 0.1 * np.ptp(values) + 1e-9) + 1)
    return [float(part.mean()) for part in parts]


def corner_targets(positions_by_target: dict[int, Floats]) -> set[int]:
    """Targets at the outermost left or right and, at the same time, the lowest or highest; of every depth."""
    numbers = list(positions_by_target)
    positions = np.array([positions_by_target[number] for number in numbers])
    outermost = np.ones(len(numbers), dtype=bool)
    for axis in (1, 2):
        values = positions[:, axis]
        tolerance = 0.1 * np.ptp(values)
        outermost &= (values < values.min() + tolerance) | (values > values.max() - tolerance)
    return {number for number, corner in zip(numbers, outermost, strict=True) if corner}


def _pointing_fold(
    task: str, name: str, recordings: Recordings, train: list[RecordedMovement], test: list[RecordedMovement],
    by_person: bool = False,
) -> Fold:  # fmt: skip
    def examples(movements: list[RecordedMovement]) -> Examples:
        return Examples(
            [one.movement for one in movements],
            np.array([one.direction for one in movements]),
            [one.action for one in movements],
            np.array([recordings.subjects.index(one.subject) if by_person else one.target_id for one in movements]),
            RATE_HZ,
            recordings.fingertip,
        )

    return Fold(task, name, examples(train), examples(test), [], "direction")


def _persons(table: Recordings, action: str) -> list[Fold]:
    folds = []
    own = table.of(action=action)
    for subject in table.subjects:
        others = [one.to_grasp for one in table.of(subject=subject) if one.action != action]
        train = _table_examples([one for one in own if one.subject != subject], table.fingertip, _TO_GRASP)
        test = _table_examples([one for one in own if one.subject == subject], table.fingertip, _TO_GRASP)
        if len(train) and len(test):
            folds.append(Fold(f"table/{action}", str(subject), train, test, others, "place"))
    return folds


def _few(what: str) -> str:
    return f"table/{what}, {FEW_PERSONS} persons"


def _few_persons(table: Recordings, name: str, actions: Sequence[str], part: Part) -> list[Fold]:
    folds = []
    own = [one for action in actions for one in table.of(action=action)]
    subjects = sorted({one.subject for one in own})
    for draw in range(DRAWS if len(subjects) > FEW_PERSONS else 0):
        chosen = set(np.random.default_rng(draw).permutation(subjects)[:FEW_PERSONS].tolist())
        train = _table_examples([one for one in own if one.subject in chosen], table.fingertip, part)
        for subject in sorted(set(subjects) - chosen):
            test = _table_examples([one for one in own if one.subject == subject], table.fingertip, part)
            folds.append(Fold(name, f"{draw}/{subject}", train, test, [], "place"))
    return folds


def _kinds(table: Recordings, name: str, part: Part, *, beginnings: bool = False) -> list[Fold]:
    folds = []
    for subject in table.subjects:
        rest = [one for one in table.movements if one.subject != subject]
        if not rest:  # a single person cannot be left out
            continue
        train = _table_examples(rest, table.fingertip, part)
        test = _table_examples(list(table.of(subject=subject)), table.fingertip, part)
        folds.append(Fold(name, str(subject), train, test, [], "place", beginnings))
    return folds


Part = Callable[[RecordedMovement], Floats]
_WHOLE = attrgetter("movement")
_TO_GRASP = attrgetter("to_grasp")
_FROM_ONSET = attrgetter("from_onset")


def _first(milliseconds: int) -> Part:
    return lambda one: first_frames(one.from_onset, round(milliseconds / 1000.0 * RATE_HZ))


def _table_examples(movements: list[RecordedMovement], tip: int, part: Part) -> Examples:
    """Theta is the target; a movement without one gets the start of its fingertip."""
    sequences = [part(one) for one in movements]
    starts = np.array([x[0, 3 * tip : 3 * tip + 3] for x in sequences]).reshape(-1, 3)
    theta = np.array([one.target for one in movements]).reshape(-1, 3)
    theta = np.where(np.isfinite(theta), theta, starts)
    return Examples(
        sequences, theta, [one.action for one in movements], np.array([one.subject for one in movements]), RATE_HZ, tip
    )


def _targets(movements: Sequence[RecordedMovement]) -> Floats:
    return np.array([one.target for one in movements])


def _grid(action: str, columns: int, rows: int, repetitions: int, seed: Sequence[int]) -> Examples:
    targets, coordinates = table_targets(columns, rows)
    rng = np.random.default_rng([*seed, GRID_ACTIONS.index(action)])
    demonstrations = demonstrations_at(targets, rng, action=action, repetitions=repetitions)  # type: ignore[arg-type]
    theta = np.repeat(coordinates, repetitions, axis=0)
    cells = np.repeat(np.arange(len(targets)), repetitions)
    return Examples(demonstrations.sequences, theta, [action] * len(theta), cells, SAMPLE_RATE_HZ, 5)
