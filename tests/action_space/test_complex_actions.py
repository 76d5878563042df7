"""Simple and dual pointing distinguished by the grammar of figure 6.26, from primitives (thesis 6.7.3)."""

from dataclasses import replace

import numpy as np
import pytest

from paramove.action_space.grammar_file import parsed_grammar
from paramove.action_space.tracker import ActionTracker
from paramove.action_space.training import arm_poses, table_action_demonstrations, train_action
from paramove.action_space.vocabulary import ActionModel, Vocabulary
from paramove.demonstrations import Demonstrations, corner_pairs, nine_pairs, table_place
from paramove.demonstrations.blending import phase
from paramove.demonstrations.synthetic import SAMPLE_RATE_HZ
from paramove.hmm import minimum_jerk
from paramove.phmm import LinearPHMM
from tests.action_space.performances import PERSON, gaussian
from tests.action_space.test_grammar import COMPLEX

CROSSING_S = 1.4


def crossing(first, second):
    """From one pose at the table to another."""
    share = minimum_jerk(np.linspace(0.0, 1.0, round(CROSSING_S * SAMPLE_RATE_HZ)), 0.1, 0.9)[:, None]
    return (1.0 - share) * first + share * second


def pointed(place, rng):
    """Poses out to a place, at it, and back."""
    poses = arm_poses(PERSON.demonstrate("pointing", table_place(place), rng))
    state = int(np.searchsorted(phase(poses), 1.5))
    return poses[:state], poses[state], poses[state:]


def named(shown, action, names, duration_s):
    told = replace(shown.description, action=action, parameter_names=names, duration=duration_s)
    return Demonstrations(shown.sequences, shown.theta, told)


@pytest.fixture(scope="module")
def vocabulary():
    rng = np.random.default_rng(0)
    shown = table_action_demonstrations("pointing", columns=3, rows=3, repetitions=2)
    parts = [pointed(place, rng) for place in shown.theta]
    out = Demonstrations([part[0] for part in parts], shown.theta, shown.description)
    back = Demonstrations([part[2] for part in parts], shown.theta, shown.description)
    pairs = np.concatenate([corner_pairs(), nine_pairs(), rng.random((12, 4))])
    over = [crossing(pointed(pair[:2], rng)[1], pointed(pair[2:], rng)[1]) for pair in pairs]
    noisy = [one + 0.002 * rng.standard_normal(one.shape) for one in over]
    redirect = Demonstrations(noisy, pairs, shown.description)
    return Vocabulary(
        [
            ActionModel.from_file_model(train_action(named(out, "point", ("u", "v"), 1.5), n_states=20)),
            ActionModel.from_file_model(
                train_action(named(redirect, "redirect", ("u", "v", "to_u", "to_v"), 1.4), n_states=20, kind=LinearPHMM)
            ),
            ActionModel.from_file_model(train_action(named(back, "withdraw", ("u", "v"), 1.5), n_states=20)),
        ]
    )


def performance(places, rng):
    out, at, back = pointed(places[0], rng)
    parts = [np.repeat(out[:1], 30, axis=0), out, np.repeat(at[None], 15, axis=0)]
    if len(places) == 2:
        _, there, back = pointed(places[1], rng)
        parts += [crossing(at, there), np.repeat(there[None], 15, axis=0)]
    return np.concatenate([*parts, back, np.repeat(back[-1:], 30, axis=0)])


@pytest.mark.parametrize("rate_hz", [8.0, 50.0])
@pytest.mark.parametrize("places", [[[0.3, 0.6]], [[0.3, 0.6], [0.8, 0.4]], [[0.7, 0.2], [0.45, 0.9]]])
def test_simple_and_dual_pointing_are_told_apart(vocabulary, rate_hz, places):
    poses = performance(np.array(places), np.random.default_rng(5))
    tracker = ActionTracker(vocabulary, parsed_grammar(COMPLEX), seed=2)
    targets, redirected = {}, 0.0
    for frame in np.arange(0.0, len(poses) - 1, SAMPLE_RATE_HZ / rate_hz):
        estimate = tracker.update(frame / SAMPLE_RATE_HZ, gaussian(poses[round(frame)], 0.05))
        redirected = max(redirected, estimate.tau_histogram[1, 10:].sum())  # p(B, tau in [0.5, 1])
        if estimate.target is not None:
            targets[estimate.target.number] = estimate.target.place
    assert (redirected > 0.5) == (len(places) == 2)
    assert sorted(targets) == list(range(1, len(places) + 1))
    for number, place in enumerate(places, start=1):
        assert np.linalg.norm(targets[number] - table_place(place)) < 0.05
    assert estimate.actions["withdraw"] + estimate.actions["point"] > 0.95, "back in the base pose"
