from pathlib import Path

import numpy as np
import pytest

from paramove.demonstrations.recorded_people import RecordingsError
from studies.movements.tasks import Fold, corner_targets, few_tasks, grid_tasks, real_tasks
from tests.demonstrations.synthetic_recordings import write_table


def test_all_tasks_follow_from_the_folder(tasks: dict[str, list[Fold]]) -> None:
    """Whatever its number of persons, targets and actions: an action without targets is only one to tell apart."""
    assert {name: len(folds) for name, folds in tasks.items()} == {
        "pointing/direction": 2 * 9,
        "pointing/corners": 2,
        "pointing/four corners": 2,
        "pointing/planes": 2 * 2,
        "pointing/new person": 2,
        "pointing/new person, 3 movements": 2 * 4,
        "table/across": 3,
        "table/forward": 3,
        "table/actions": 3,
        "table/beginnings": 3,
        "table/first 100 ms": 3,
        "table/first 200 ms": 3,
        "table/first 400 ms": 3,
    }


def test_what_is_tested_is_not_trained(tasks: dict[str, list[Fold]]) -> None:
    for folds in tasks.values():
        for fold in folds:
            trained = {x.tobytes() for x in fold.train.sequences}
            assert not trained & {x.tobytes() for x in fold.test.sequences}
            assert not set(fold.train.groups) & set(fold.test.groups)


def test_few_persons_are_drawn_and_the_others_tested(tmp_path: Path) -> None:
    write_table(tmp_path, persons=7)
    folds = real_tasks(tmp_path)["table/across, 5 persons"]
    assert len(folds) == 2 * 2
    for fold in folds:
        assert len(set(fold.train.groups)) == 5
        assert not set(fold.train.groups) & set(fold.test.groups)


def test_few_and_tidy_movements_differ_between_seeds_and_repeat() -> None:
    tasks, again = few_tasks((0, 1)), few_tasks((0,))
    assert {name: len(folds) for name, folds in tasks.items()} == {
        "scripted/same": 2,
        "scripted/3 mm": 2,
        "raster/1 repetition": 2,
        "raster/2 repetitions": 2,
        "raster/5 repetitions": 2,
        "raster/20 repetitions": 2,
    }
    for name, (first, second) in tasks.items():
        assert np.array_equal(first.train.sequences[0], again[name][0].train.sequences[0])
        assert not np.array_equal(first.train.sequences[0], second.train.sequences[0])
    ends = np.array([x[-5:].mean(axis=0) for x in tasks["scripted/same"][0].test.sequences])
    assert np.abs(ends[:, :2] - tasks["scripted/same"][0].test.theta).max() < 0.003


def test_every_movement_is_tested_once(tasks: dict[str, list[Fold]]) -> None:
    assert sum(len(fold.test) for fold in tasks["pointing/direction"]) == 2 * 9 * 2 - 1
    assert sum(len(fold.test) for fold in tasks["table/actions"]) == 3 * 2 * 3 * 2


def test_one_data_set_is_enough(tmp_path: Path) -> None:
    write_table(tmp_path, persons=2)
    names = set(real_tasks(tmp_path))
    assert names >= {"table/across", "table/forward", "table/actions", "table/beginnings"}
    assert not any(name.startswith("pointing") for name in names)


def test_a_single_person_cannot_be_left_out(tmp_path: Path) -> None:
    write_table(tmp_path, persons=1)
    assert real_tasks(tmp_path) == {}


def test_no_data_set(tmp_path: Path) -> None:
    with pytest.raises(RecordingsError, match="neither"):
        real_tasks(tmp_path)


def test_corners() -> None:
    places = {
        k: np.array([d, y, z])
        for k, (d, y, z) in enumerate((d, y, z) for d in (1, 2) for y in (0, 1, 2) for z in (0, 1, 2))
    }
    assert corner_targets({k: place.astype(float) for k, place in places.items()}) == {0, 2, 6, 8, 9, 11, 15, 17}


def test_the_first_milliseconds_are_equally_long_for_all(tasks: dict[str, list[Fold]]) -> None:
    for fold in tasks["table/first 200 ms"]:
        assert {len(x) for x in (*fold.train.sequences, *fold.test.sequences)} == {10}


def test_theta_is_finite_also_without_targets(tasks: dict[str, list[Fold]]) -> None:
    for fold in tasks["table/actions"]:
        assert np.isfinite(fold.train.theta).all()


def test_rejection_has_movements_of_other_kinds(tasks: dict[str, list[Fold]]) -> None:
    fold = tasks["table/across"][0]
    assert fold.train.actions == ["across"]
    assert len(fold.others) == 2 * 2 * 2


def test_grid_of_the_synthetic_demonstrator() -> None:
    tasks = grid_tasks([0])
    (fold,) = tasks["raster/reaching"]
    assert (len(fold.train), len(fold.test)) == (90, 140)
    assert fold.train.theta.min() == 0.0
    assert fold.test.theta.max() == 1.0
    assert tasks["raster/beginnings"][0].train.actions == ["pointing", "reaching"]
