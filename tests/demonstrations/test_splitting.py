"""Splits: nothing is in both parts, whole groups stay together, the same seed gives the same split."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from paramove.demonstrations.demonstration_set import DemonstrationSet
from paramove.demonstrations.movement import DemonstrationError
from tests.demonstrations.movements import a_set, movement

SHOWN = a_set(("P1", "P2", "P3"), 2)


def identities(movements):
    return {(one.subject, tuple(one.theta), one.repetition) for one in movements}


@settings(deadline=None, max_examples=40, derandomize=True)
@given(by=st.sampled_from(["movement", "subject", "theta"]), fraction=st.floats(0.05, 0.95), seed=st.integers(0, 99))
def test_a_partition_that_depends_on_the_seed_alone(by, fraction, seed):
    train, test = SHOWN.split(by, fraction, seed)
    assert identities(train).isdisjoint(identities(test))
    assert len(train) + len(test) == len(SHOWN)
    assert len(train) > 0
    assert len(test) > 0
    order = np.random.default_rng(seed).permutation(len(SHOWN))
    again = DemonstrationSet(tuple(SHOWN[int(n)] for n in order)).split(by, fraction, seed)
    assert [identities(part) for part in again] == [identities(train), identities(test)]
    if by == "subject":
        assert set(train.subjects).isdisjoint(test.subjects)
    if by == "theta":
        assert {tuple(one.theta) for one in train}.isdisjoint(tuple(one.theta) for one in test)


def test_the_share_is_that_of_each_action():
    both = DemonstrationSet((*SHOWN, *(movement(action="pointing", repetition=number) for number in range(8))))
    _, test = both.split(fraction=0.25)
    assert [len(test.select(action)) for action in ("pointing", "reaching")] == [2, 4]


def test_bins_are_cells_of_equal_width():
    grid = DemonstrationSet(tuple(movement((x / 10, y / 10, 0.0)) for x in range(4) for y in range(4)))
    _, test = grid.split("theta", 0.25, 1, bins=2)
    assert len(test) == 4
    assert np.ptp([one.theta for one in test], axis=0) == pytest.approx([0.1, 0.1, 0.0])


def test_other_seeds_give_other_splits():
    assert len({frozenset(identities(SHOWN.split(seed=seed)[1])) for seed in range(10)}) > 5


def test_what_cannot_be_split_is_told():
    with pytest.raises(DemonstrationError, match="1 persons cannot be split into training and test; record more"):
        a_set(("P1",)).split("subject")
    with pytest.raises(ValueError, match="above 0 and below 1, found 1"):
        SHOWN.split(fraction=1.0)
