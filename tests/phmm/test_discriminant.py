"""Which action a movement is: actions with and without theta, complete and begun, by persons who did not train."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose

from paramove.documents import InputError
from paramove.hmm import resample
from paramove.phmm import INDEX_FILE, LinearPHMM, ModelFileError, MovementClassifier
from paramove.phmm.discriminant import WHOLE, Discriminant, discriminant_features
from paramove.phmm.storage import read_record, write_record
from paramove.training.examining import Examiner
from tests.phmm.movements import FEW, shown


def letters(seed: int, n_letters: int = 20, repetitions: int = 30) -> tuple[list[np.ndarray], np.ndarray]:
    """Written letters as velocities and pressure of a pen, (T, 3): every letter has its shape and its duration."""
    rng, shapes = np.random.default_rng(seed), np.random.default_rng(99)
    sequences, labels = [], []
    for letter in range(n_letters):
        shape, frames = shapes.standard_normal((6, 2)), shapes.uniform(60.0, 200.0)
        for _ in range(repetitions):
            n_frames = int(frames * np.exp(0.12 * rng.standard_normal()))
            time = np.linspace(0.0, 1.0, n_frames) ** np.exp(0.15 * rng.standard_normal())
            waves = np.sin(np.pi * np.outer(time, np.arange(1.0, 7.0)))
            velocity = waves @ (shape + 0.25 * rng.standard_normal(shape.shape))
            frames_of_one = np.column_stack([velocity, np.exp(-(((time - 0.5) / 0.3) ** 2))])
            sequences.append(frames_of_one + 0.02 * rng.standard_normal(frames_of_one.shape))
            labels.append(chr(ord("a") + letter))
    return sequences, np.array(labels)


@pytest.fixture(scope="module")
def writer() -> MovementClassifier:
    sequences, labels = letters(0)
    return MovementClassifier().fit(sequences, None, labels)


def test_letters_without_theta_are_read(writer: MovementClassifier) -> None:
    sequences, labels = letters(1, repetitions=10)
    assert writer.score(sequences, labels) >= 0.99
    assert writer.models_ == {}
    found = [writer.classify(x) for x in sequences]
    assert all(one.estimates == {} for one in found)
    p_values = np.array([one.p_value for one in found])
    assert 0.0 < np.mean(p_values < 0.05) < 0.15
    assert 0.05 < np.mean(p_values < 0.2) < 0.4
    begun = [x[: len(x) // 2] for x in sequences]
    assert np.mean(writer.predict(begun, finished=False) == labels) > 0.7  # of 20 letters


def test_what_is_no_letter_is_rejected(writer: MovementClassifier) -> None:
    rng = np.random.default_rng(0)
    for _ in range(5):
        assert writer.classify(0.5 * rng.standard_normal((100, 3)).cumsum(axis=0)).p_value < 1e-3


def test_actions_with_and_without_theta_compete(tmp_path: Path) -> None:
    reaching, theta = shown(0)
    rng = np.random.default_rng(1)
    time = np.linspace(0.0, 1.0, 45)[:, None]
    waving = [np.sin(time * [6.0, 9.0, 12.0]) + 0.05 * rng.standard_normal((45, 3)) for _ in range(12)]
    labels = ["reach"] * len(reaching) + ["wave"] * len(waving)
    parameters = np.concatenate([theta, np.full((len(waving), 2), np.nan)])
    classifier = MovementClassifier(LinearPHMM(8, options=FEW)).fit(reaching + waving, parameters, labels)
    assert classifier.score(reaching + waving, labels) == 1.0
    assert set(classifier.classify(waving[0]).estimates) == {"reach"}
    assert classifier.classify(resample(waving[0], 40)).p_value > 0.01
    classifier.save(tmp_path)
    again = MovementClassifier.load(tmp_path)
    for sequence in (reaching[3], waving[3], waving[3][:20]):
        one, other = (each.classify(sequence, finished=len(sequence) > 20) for each in (classifier, again))
        assert (one.action, one.posterior, one.p_value) == (other.action, other.posterior, other.p_value)
    with pytest.raises(InputError, match="no theta: wave"):
        Examiner(again)
    (tmp_path / "reach.model.npz").unlink()
    with pytest.raises(ModelFileError):
        MovementClassifier.load(tmp_path)


def test_an_action_whose_name_is_a_path_is_neither_written_nor_read(tmp_path: Path) -> None:
    sequences, theta = shown(0)
    classifier = MovementClassifier(LinearPHMM(8, options=FEW)).fit(sequences, theta, ["reach"] * len(sequences))
    classifier.save(tmp_path / "models")
    record = read_record(tmp_path / "models" / INDEX_FILE)
    foreign = replace(record, parameters={**record.parameters, "actions": ["../models/reach"]})
    write_record(tmp_path / "models" / INDEX_FILE, foreign)
    with pytest.raises(ModelFileError, match="no '/'"):
        MovementClassifier.load(tmp_path / "models")
    classifier.models_ = {"../reach": classifier.models_["reach"]}
    with pytest.raises(InputError, match="no '/'"):
        classifier.save(tmp_path / "new")
    assert not (tmp_path / "new").exists()


def test_a_theta_that_is_missing_once_is_named() -> None:
    sequences, theta = shown(0)
    theta[5, 1] = np.nan
    with pytest.raises(ValueError, match=r"'reach': theta is finite, .* for sequence 5, 1 in all"):
        MovementClassifier(LinearPHMM(8)).fit(sequences, theta, ["reach"] * len(sequences))


def test_units_do_not_matter() -> None:
    sequences, labels = letters(0, 4, 8)
    actions = np.unique(labels, return_inverse=True)[1]
    metres, millimetres = (
        Discriminant.fitted([factor * x for x in sequences], actions, 4, np.arange(len(actions)), WHOLE)
        for factor in (1.0, 1000.0)
    )
    expected = metres.log_probabilities(sequences[0])
    assert_allclose(millimetres.log_probabilities(1000.0 * sequences[0]), expected, rtol=1e-6, atol=1e-9)


def test_beginnings_do_not_depend_on_where_they_begin() -> None:
    sequence = letters(0, 1, 1)[0][0]
    assert_allclose(discriminant_features(sequence + 3.0, 30), discriminant_features(sequence, 30), atol=1e-12)
    assert discriminant_features(sequence, WHOLE).shape == (6 * 3 + 1,)
