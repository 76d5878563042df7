import pytest

from studies.movements.method import NotAble
from studies.movements.tasks import Fold
from studies.movements.trial import able, measure
from tests.studies.movements.conftest import MeanPath


def test_every_measure_of_one_action(tasks: dict[str, list[Fold]]) -> None:
    found = measure(MeanPath(), tasks["table/across"][0])
    values = found["values"]
    assert set(values) == {
        "dtw", "dtw_cut", "rms", "tip_rms", "end", "theta", "covered", "covered_50", "covered_80", "covered_set",
        "score_genuine", "score_aborted", "score_stopped", "score_others",
    }  # fmt: skip
    assert len(values["theta"]) == 4
    assert values["covered"] == [1.0] * 4
    assert min(values["score_genuine"]) > max(values["score_others"])


def test_actions_and_their_beginnings(tasks: dict[str, list[Fold]]) -> None:
    whole = measure(MeanPath(), tasks["table/actions"][0])["values"]
    assert sum(whole["correct"]) / len(whole["correct"]) > 0.9
    beginnings = measure(MeanPath(), tasks["table/beginnings"][0])["values"]
    assert set(beginnings) == {"correct_25", "correct_50", "correct_75", "correct_100"}


def test_a_method_is_not_asked_what_it_cannot(tasks: dict[str, list[Fold]]) -> None:
    class OnlyScores(MeanPath):
        can = frozenset({"outliers"})

    fold = tasks["table/across"][0]
    assert set(measure(OnlyScores(), fold)["values"]) == {
        "score_genuine", "score_aborted", "score_stopped", "score_others"
    }  # fmt: skip
    assert able(OnlyScores(), fold)
    assert not able(OnlyScores(), tasks["table/actions"][0])
    with pytest.raises(NotImplementedError, match="synthesise"):
        NotAble().synthesize(fold.test.theta[0], 10)
