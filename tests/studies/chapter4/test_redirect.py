"""The experiment on the redirect action."""

import pytest

from studies.chapter4.redirect import redirect_experiment


@pytest.mark.long
def test_sixteen_corner_pairs_teach_the_whole_region() -> None:
    rows = {(row["training"], row["model"]): row for row in redirect_experiment(0, tests=8)}
    assert len(rows) == 10
    learned = rows["16 corner pairs, from the model", "linear"]
    assert learned["error_cm"]["max"] < 2.0
    assert max(learned["start_miss_cm"]["max"], learned["end_miss_cm"]["max"]) < 1.0
    assert all(row["jerk_ratio"] <= 1.2 for row in rows.values())
    assert rows["9 pairs, demonstrated", "linear"]["error_cm"]["mean"] < 4.0
