import numpy as np
import pytest

from studies.movements.summary import measured, summarised


def result(fold: str, values: dict[str, list[float]]) -> dict[str, object]:
    return {"task": "t", "row": "r", "fold": fold, "seed": 0, "values": values, "seconds": {"fit": 1.0}}


def test_interval_comes_from_folds_not_from_movements() -> None:
    """Two folds that disagree: the interval reaches from one to the other, however many movements they have."""
    results = [result("a", {"theta": [1.0] * 500}), result("b", {"theta": [3.0] * 500})]
    found = measured(results, ("theta",), lambda values: float(values.mean()))
    assert found == pytest.approx((2.0, 1.0, 3.0))


def test_pooled_over_folds() -> None:
    rng = np.random.default_rng(0)
    results = [
        result(
            str(k), {"score_genuine": list(rng.normal(1.0, 1.0, 40)), "score_aborted": list(rng.normal(0.0, 1.0, 40))}
        )
        for k in range(20)
    ]
    found = summarised(results)["t"]["r"]["measures"]
    assert set(found) == {"auroc_aborted"}
    assert found["auroc_aborted"].low < 0.76 < found["auroc_aborted"].high


def test_without_values_there_is_no_column() -> None:
    found = summarised([result("a", {"score_genuine": [1.0], "score_others": []})])["t"]["r"]
    assert found["measures"] == {}
    assert found["seconds"] == {"fit": 1.0}
