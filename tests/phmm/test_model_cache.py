"""Models are trained once and kept."""

from dataclasses import replace

import numpy as np
import pytest

from paramove.phmm import LinearPHMM, MovementDescription, model_cache
from paramove.phmm.model_cache import cached_model, stored_model
from paramove.source_code import code_digest

CODE = f"code {code_digest(__name__)}"


@pytest.fixture
def train():
    """Counts how often it trains."""

    def trained():
        trained.times += 1
        rng = np.random.default_rng(trained.times)
        theta = rng.random((6, 1))
        model = LinearPHMM(4, 2, 4)
        model.fit([np.linspace(0.0, one, 12)[:, None] + 0.01 * rng.normal(size=(12, 1)) for one in theta[:, 0]], theta)
        model.description = MovementDescription("waving")
        return model

    trained.times = 0
    return trained


def test_a_model_is_trained_once_for_each_source(train, tmp_path):
    first = cached_model(LinearPHMM, "waving", "one person", train, tmp_path)
    again = cached_model(LinearPHMM, "waving", "one person", train, tmp_path)
    assert train.times == 1
    assert first.description == again.description == MovementDescription("waving", source=f"one person, {CODE}")
    np.testing.assert_array_equal(first.coefficients_, again.coefficients_)
    assert (
        cached_model(LinearPHMM, "waving", "two persons", train, tmp_path).description.source == f"two persons, {CODE}"
    )
    assert train.times == 2
    assert len(list(tmp_path.glob("waving_*.npz"))) == 2


def test_a_file_that_is_damaged_or_of_another_source_is_replaced(train, tmp_path, caplog):
    first = cached_model(LinearPHMM, "waving", "one person", train, tmp_path)
    (path,) = tmp_path.glob("*.npz")
    path.write_bytes(path.read_bytes()[:200])
    assert stored_model(LinearPHMM, path) is None
    assert "training again, the cached model does not fit" in caplog.text
    cached_model(LinearPHMM, "waving", "one person", train, tmp_path)
    assert train.times == 2
    first.description = replace(first.description, source="somebody else")
    first.save(path)
    assert cached_model(LinearPHMM, "waving", "one person", train, tmp_path).description.source == f"one person, {CODE}"
    assert train.times == 3


def test_a_model_of_other_code_is_replaced(train, tmp_path, monkeypatch):
    cached_model(LinearPHMM, "waving", "one person", train, tmp_path)
    monkeypatch.setattr(model_cache, "code_digest", lambda *modules: " ".join(modules))
    model = cached_model(LinearPHMM, "waving", "one person", train, tmp_path, modules=["paramove.hmm"])
    assert model.description.source == f"one person, code {__name__} paramove.hmm"
    assert train.times == 2
    assert len(list(tmp_path.iterdir())) == 1


def test_a_folder_that_cannot_be_made_costs_the_file_only(train, tmp_path, caplog):
    (tmp_path / "file").write_text("")
    model = cached_model(LinearPHMM, "waving", "one person", train, tmp_path / "file" / "actions")
    assert model.description.source == f"one person, {CODE}"
    assert "the trained model is not cached" in caplog.text


def test_no_file_is_no_model(tmp_path):
    assert stored_model(LinearPHMM, None) is None
    assert stored_model(LinearPHMM, tmp_path / "none.npz") is None
