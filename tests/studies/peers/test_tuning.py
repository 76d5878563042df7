import numpy as np

from studies.movements.method import CLASSES, SYNTHESIS, Examples, NotAble
from studies.peers.tuning import Tuned, inner_folds


class Constant(NotAble):
    """Synthesises a constant; remembers what it was fitted on."""

    can = frozenset({SYNTHESIS})
    fitted: list[set[int]] = []  # noqa: RUF012

    def __init__(self, value: float) -> None:
        self.value = value

    def fit(self, examples: Examples) -> None:
        Constant.fitted.append(set(examples.groups.tolist()))

    def synthesize(self, theta: np.ndarray, n: int) -> np.ndarray:
        return np.full((n, 3), self.value)


def examples(groups: int = 5) -> Examples:
    numbers = np.repeat(np.arange(groups), 2)
    return Examples(
        [np.full((20, 3), 2.0)] * len(numbers), numbers[:, None] * 1.0, ["a"] * len(numbers), numbers, 50.0, 0
    )


def test_the_best_candidate_is_chosen_and_learns_everything() -> None:
    Constant.fitted.clear()
    tuned = Tuned(Constant, [{"value": 1.0}, {"value": 2.1}, {"value": 5.0}])
    tuned.fit(examples())
    assert tuned.chosen == {"value": 2.1}
    assert Constant.fitted[-1] == set(range(5))
    assert max(len(groups) for groups in Constant.fitted[:-1]) < 5


def test_whole_groups_are_left_out() -> None:
    folds = inner_folds(examples())
    assert len(folds) == 3
    for train, test in folds:
        assert not set(train.groups) & set(test.groups)
    assert sorted(np.concatenate([test.groups for _, test in folds])) == sorted(examples().groups)


def test_a_single_group_cannot_be_left_out() -> None:
    (fold,) = inner_folds(examples(groups=1))
    assert len(fold[0]) == len(fold[1]) == 2


def test_what_it_can_is_what_the_candidates_can() -> None:
    assert Tuned(Constant, [{"value": 1.0}]).can == {SYNTHESIS}
    assert CLASSES not in Tuned(Constant, [{"value": 1.0}]).can
