"""Loops, choices and concatenations: where particles go when an action is over (thesis 6.7.1 to 6.7.3)."""

import numpy as np
import pytest

from paramove.action_space.grammar import BASE, Grammar, Switching
from paramove.action_space.grammar_file import parsed_grammar
from paramove.action_space.vocabulary import Vocabulary
from paramove.documents.input_error import InputError
from tests.action_space.toy import toy_action

COMPLEX = """
begin: point(a)
after:
  point(a):
    - redirect(a, b)
    - withdraw(a)
  redirect(a, b): withdraw(b)
  withdraw(b): point(a)
"""


def particles(step, n, n_parameters, tau, seed=0):
    rng = np.random.default_rng(seed)
    return np.full(n, step), np.full(n, BASE), rng.random((n, n_parameters)), np.full(n, tau), rng


def test_a_loop_begins_again_with_new_parameters():
    step, origin, theta, tau, rng = particles(0, 1000, 2, 1.2)
    tau[:500] = 0.9
    before = theta.copy()
    moved = Grammar.loop("a").advance(step, origin, theta, tau, rng)
    np.testing.assert_array_equal(moved, np.arange(500, 1000))
    np.testing.assert_allclose(tau[500:], 0.2)
    np.testing.assert_array_equal(theta[:500], before[:500])
    assert (theta[500:] != before[500:]).all()


def test_a_loop_may_keep_its_parameters():
    grammar = parsed_grammar("begin: pour(a)\nafter:\n  pour(a): pour(a)\n")
    step, origin, theta, tau, rng = particles(0, 10, 2, 1.5)
    before = theta.copy()
    grammar.advance(step, origin, theta, tau, rng)
    np.testing.assert_array_equal(theta, before)


def test_a_choice_takes_any_action_next():
    step, origin, theta, tau, rng = particles(0, 4000, 2, 1.01)
    Grammar.choice(["a", "b"]).advance(step, origin, theta, tau, rng)
    assert (step == 1).mean() == pytest.approx(0.5, abs=0.03)


def test_weights_of_a_choice():
    text = "begin: [a(x)]\nafter:\n  a(x):\n    - a(y)\n    - b(y): 3\n  b(x): a(y)\n"
    step, origin, theta, tau, rng = particles(0, 4000, 2, 1.01)
    parsed_grammar(text).advance(step, origin, theta, tau, rng)
    assert (step == 1).mean() == pytest.approx(0.75, abs=0.03)


def test_concatenated_actions_hand_their_places_over():
    grammar = parsed_grammar(COMPLEX)
    assert [one.name for one in grammar.steps] == ["point", "redirect", "withdraw"]
    step, origin, theta, tau, rng = particles(0, 3000, 4, 1.1)
    before = theta.copy()
    grammar.advance(step, origin, theta, tau, rng)
    assert set(step) == {1, 2}
    assert (step == 1).mean() == pytest.approx(0.5, abs=0.04)
    np.testing.assert_array_equal(theta[:, :2], before[:, :2])  # a is where both begin
    redirected = step == 1
    assert (theta[redirected, 2:] != before[redirected, 2:]).all()  # b is new
    tau[:] = 1.05
    middle = theta.copy()
    grammar.advance(step, origin, theta, tau, rng)
    np.testing.assert_array_equal(step[redirected], 2)
    np.testing.assert_array_equal(theta[redirected, :2], middle[redirected, 2:])  # withdraw from b
    np.testing.assert_array_equal(step[~redirected], 0)
    assert (theta[~redirected, :2] != middle[~redirected, :2]).all()


def test_only_unknown_places_diffuse():
    free = parsed_grammar(COMPLEX).free_components(4)
    np.testing.assert_array_equal(
        free, [[True, True, False, False], [False, False, True, True], [False, False, False, False]]
    )


def test_several_actions_may_be_over_within_a_frame():
    step, origin, theta, tau, rng = particles(0, 5, 4, 2.3)
    parsed_grammar(COMPLEX).advance(step, origin, theta, tau, rng)
    np.testing.assert_allclose(tau, 0.3)
    assert set(step) <= {0, 2}


def test_a_fifth_of_the_particles_at_the_beginning_switch():
    grammar = Grammar.choice(["a", "b", "c"])
    step, origin, theta, tau, rng = particles(1, 30_000, 2, 0.05)
    tau[20_000:] = 0.2
    before = theta.copy()
    grammar.switch(step, origin, theta, tau, grammar.switching.share, rng)
    np.testing.assert_array_equal(theta, before)
    assert (step[:20_000] != 1).mean() == pytest.approx(0.2, abs=0.01)
    assert (step[:20_000] == 0).mean() == pytest.approx(0.1, abs=0.01)
    assert (step[20_000:] == 1).all()


def test_concatenated_actions_switch_with_their_places():
    """Before there is any evidence: redirect(a, b) for withdraw(a) and back, but not after the second place."""
    grammar = parsed_grammar(COMPLEX)
    step, origin, theta, tau, rng = particles(0, 3000, 4, 1.02)
    grammar.advance(step, origin, theta, tau, rng)
    assert (origin == 0).all()
    begun, before = step.copy(), theta.copy()
    rows = grammar.switch(step, origin, theta, tau, 0.3, rng)
    assert len(rows) / 3000 == pytest.approx(0.3, abs=0.03)
    np.testing.assert_array_equal(np.flatnonzero(step != begun), np.sort(rows))
    np.testing.assert_array_equal(theta[:, :2], before[:, :2])
    redirected = (begun == 2) & (step == 1)
    assert redirected.any()
    assert (theta[redirected, 2:] != before[redirected, 2:]).all()
    tau[:] = 1.02
    grammar.advance(step, origin, theta, tau, rng)
    second = step.copy()
    grammar.switch(step, origin, theta, tau, 0.3, rng)
    np.testing.assert_array_equal(step, second)


def test_nothing_switches_where_only_one_action_begins():
    step, origin, theta, tau, rng = particles(0, 100, 4, 0.0)
    assert len(parsed_grammar(COMPLEX).switch(step, origin, theta, tau, 0.5, rng)) == 0


def test_beginnings_are_spread_over_the_actions_that_begin():
    step, theta = Grammar.choice(["a", "b"]).beginning(2000, 2, np.random.default_rng(0))
    assert step.mean() == pytest.approx(0.5, abs=0.05)
    assert theta.min() >= 0.0
    assert theta.max() <= 1.0


def test_a_grammar_fits_its_vocabulary():
    vocabulary = Vocabulary([toy_action("point"), toy_action("withdraw"), toy_action("redirect", n_parameters=4)])
    parsed_grammar(COMPLEX).check(vocabulary)
    with pytest.raises(InputError, match="did you mean 'point'"):
        Grammar.loop("pont").check(vocabulary)
    with pytest.raises(InputError, match=r"'redirect' has 2 place\(s\), the grammar names 1"):
        Grammar.loop("redirect").check(vocabulary)


def test_switching_is_checked():
    with pytest.raises(InputError, match="between 0 and 1"):
        Switching(share=1.5)
