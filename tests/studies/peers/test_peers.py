"""Each peer on a small problem that it must solve; those whose library is not installed are skipped."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from studies.movements.method import BEGINNINGS, CLASSES, OUTLIERS, SYNTHESIS, THETA, Examples
from studies.movements.sweep import Row, missing_libraries
from studies.peers.catalogue import peer_rows
from studies.peers.library import PeerMissingError, library

DEFAULTS = [row for row in peer_rows() if row.name.endswith("(default)")]
REGRESSIONS = {"Gaussian processes (default)"}
"""They score no movements, so they are no classifiers."""


def bows(action: str, rng: np.random.Generator, *, groups: int = 9, repetitions: int = 4) -> Examples:
    """Movements of two points to a place theta in the plane; the actions differ in the way there."""
    places = np.stack(np.meshgrid([0.2, 0.4, 0.6], [-0.3, 0.0, 0.3]), axis=-1).reshape(-1, 2)[:groups]
    theta = np.repeat(places, repetitions, axis=0)
    sequences = []
    for place in theta:
        s = np.linspace(0.0, 1.0, int(rng.integers(40, 60)))[:, None] ** rng.uniform(0.95, 1.05)
        height = (0.25 if action == "over" else 0.05) * np.sin(np.pi * s)
        hand = np.hstack([s * place, height])
        sequences.append(np.hstack([hand, 0.5 * hand]) + 0.002 * rng.standard_normal((len(s), 6)))
    return Examples(sequences, theta, [action] * len(theta), np.repeat(np.arange(len(places)), repetitions), 50.0, 0)


@pytest.fixture(scope="module", params=DEFAULTS, ids=lambda row: row.name)
def row(request: pytest.FixtureRequest) -> Row:
    found: Row = request.param
    missing = missing_libraries(found)
    if missing:
        pytest.skip(f"not installed: {', '.join(missing)} (pip install 'paramove[peers]')")
    return found


@pytest.mark.filterwarnings("ignore")  # of the peers' own code
def test_one_action(row: Row) -> None:
    method = row.make(0)
    examples = bows("over", np.random.default_rng(0))
    asked = bows("over", np.random.default_rng(1), repetitions=1)
    method.fit(examples)
    if SYNTHESIS in method.can:
        made = method.synthesize(np.array([0.5, 0.15]), 100)
        assert made.shape == (100, 6)
        assert_allclose(made[-1, :2], [0.5, 0.15], rtol=0, atol=0.03)
        assert_allclose(made[50, 2], 0.25, rtol=0, atol=0.03)
    if THETA in method.can:
        estimates = [method.estimate(x) for x in asked.sequences]
        errors = np.linalg.norm([e.theta for e in estimates] - asked.theta, axis=1)
        assert errors.mean() < 0.03
        for estimate in estimates:
            if estimate.covariance is not None:
                assert np.linalg.eigvalsh(estimate.covariance).min() > -1e-9
    if OUTLIERS in method.can:
        other = bows("under", np.random.default_rng(2), repetitions=1)
        assert min(method.score(x) for x in asked.sequences) > max(method.score(x) for x in other.sequences)


@pytest.mark.filterwarnings("ignore")
def test_two_actions(row: Row) -> None:
    method = row.make(0)
    parts = [bows(action, np.random.default_rng(k), repetitions=2) for k, action in enumerate(("over", "under"))]
    both = Examples(
        parts[0].sequences + parts[1].sequences,
        np.concatenate([part.theta for part in parts]),
        parts[0].labels + parts[1].labels,
        np.concatenate([part.groups for part in parts]),
        50.0,
        0,
    )
    assert (CLASSES in method.can) == (row.name not in REGRESSIONS)
    if row.name in REGRESSIONS:
        return
    method.fit(both)
    for action in ("over", "under"):
        (x,) = bows(action, np.random.default_rng(9), groups=1, repetitions=1).sequences
        assert method.classify(x, True) == action
        if BEGINNINGS in method.can:
            assert method.classify(x[:25], False) == action


def test_a_missing_library_says_how_to_get_it() -> None:
    with pytest.raises(PeerMissingError, match=r"pip install 'paramove\[peers\]'"):
        library("no_such_module", "no-such-package")
