"""The log-likelihood distribution test (2.2.5): calibrated for movements like the compared, strict for others."""

import numpy as np
import pytest

from paramove.hmm import GaussianHMM, LeftRightHMM, LikelihoodTest
from tests.hmm.test_gaussian import movements
from tests.hmm.test_synthesis import chain, lasting


@pytest.mark.parametrize("model", [chain(), lasting()], ids=["chain", "durations"])
def test_p_values_of_sequences_of_the_model_are_uniform(model: GaussianHMM | LeftRightHMM) -> None:
    rng = np.random.default_rng(0)
    test = LikelihoodTest.of_samples(model, rng, 500)
    values = np.sort([test.p_value(model.sample(rng)) for _ in range(400)])
    assert np.abs(values - np.linspace(0.0, 1.0, 400)).max() < 0.12


def test_people_are_judged_by_people() -> None:
    shown = movements(3, [40] * 60, seed=1)
    model = LeftRightHMM(8, 3, 7).fit(shown[:20])
    by_held_out = LikelihoodTest.of_sequences(model, shown[20:40])
    accepted = np.mean([by_held_out.accepts(one, 0.05) for one in shown[40:]])
    assert accepted >= 0.8
    other = movements(3, [40] * 10, seed=2)
    assert not any(by_held_out.accepts(one, 0.05) for one in other)


def test_cross_validation_leaves_out_what_it_judges() -> None:
    shown = movements(3, [40] * 40, seed=1)
    model = LeftRightHMM(8, 3, 7).fit(shown[:20])
    before = model.means_
    crossed, own = LikelihoodTest.cross_validated(model, shown[:20]), LikelihoodTest.of_sequences(model, shown[:20])
    assert model.means_ is before
    assert np.median(crossed.values) < np.median(own.values)  # training sequences look likelier than new ones
    assert np.mean([crossed.accepts(one, 0.05) for one in shown[20:]]) >= 0.8
    assert len(LikelihoodTest.cross_validated(model, shown[:20], 4).values) == 20


def test_a_length_without_a_path_has_the_least_p_value() -> None:
    shown = movements(2, [22] * 25)
    test = LikelihoodTest.of_sequences(LeftRightHMM(5, 3, 6).fit(shown[:5]), shown[5:])
    assert test.p_value(np.zeros((200, 2))) == pytest.approx(1 / 21, rel=1e-12)
    assert not test.accepts(np.zeros((200, 2)), 0.05)


def test_too_few_to_reject_anything_is_said() -> None:
    shown = movements(2, [22] * 10)
    test = LikelihoodTest.of_sequences(LeftRightHMM(5, 3, 6).fit(shown[:5]), shown[5:])
    with pytest.raises(ValueError, match=r"5 sequences can reject nothing at level 0\.05; give at least 19"):
        test.accepts(shown[0])
    with pytest.raises(ValueError, match="no sequences to compare with"):
        LikelihoodTest.of_sequences(test.model, [])
    with pytest.raises(ValueError, match="n_parts is 2 to the number of sequences"):
        LikelihoodTest.cross_validated(LeftRightHMM(5, 3, 6), shown, 1)
