"""Errors in grammar files say where and what would have worked."""

import pytest

from paramove.action_space.grammar_file import GrammarError, parsed_grammar, read_grammar

GOOD = "begin: point(a)\nafter:\n  point(a): point(b)\n"


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "g.yaml:1:1: the file is empty"),
        ("after:\n  point(a): point(b)\n", "begin is missing"),
        ("begin: point(a)\n", "after is missing"),
        ("begin: point(a)\nafter: []\n", "g.yaml:2:1: after is missing"),
        ("begin: point(a)\nafter: [point(a)]\n", "g.yaml:2:1: expected after as a mapping"),
        (GOOD + "swiching: {share: 0.1}\n", "g.yaml:4:1: unknown key 'swiching'; did you mean 'switching'?"),
        (GOOD + "switching: {share: 1.5}\n", "g.yaml:4:1: share and before of switching lie between 0 and 1"),
        (GOOD + "switching: {shar: 0.5}\n", "g.yaml:4:13: unknown key 'shar'; did you mean 'share'?"),
        (GOOD + "switching: {share: yes}\n", "g.yaml:4:13: expected a number, found 'yes'"),
        (GOOD + "actions: {pont: pointing}\n", "g.yaml:4:11: there is no step 'pont'; did you mean 'point'?"),
        (GOOD + "actions: {point: 3}\n", "g.yaml:4:11: expected the name of an action, found 3"),
        ("begin: point\nafter:\n  point(a): point(b)\n", "g.yaml:1:1: expected a step with its places"),
        ("begin: pont(a)\nafter:\n  point(a): point(b)\n", "g.yaml:1:1: step 'pont' is not defined under 'after'"),
        ("begin: []\nafter:\n  point(a): point(b)\n", "g.yaml:1:1: begin names at least one step"),
        ("begin: point(a)\nafter:\n  point(a):\n    - back(b)\n", "g.yaml:4:7: step 'back' is not defined"),
        ("begin: point(a)\nafter:\n  point(a): point(a, b)\n", "g.yaml:3:3: point has 1 place(s) (a), found 2"),
        ("begin: point(a)\nafter:\n  point(a): []\n", "g.yaml:3:3: nothing follows 'point(a)'"),
        ("begin: go(a, a)\nafter:\n  go(a, a): go(a, b)\n", "g.yaml:3:3: two places of 'go(a, a)' have the same name"),
        (GOOD + "  point(b): point(a)\n", "g.yaml:4:3: step 'point' is defined twice"),
        ("begin: point(a)\nafter:\n  point(a):\n    - point(a): -1\n", "g.yaml:4:7: the weight of 'point(a)' is a pos"),
        ("begin: point(a)\nafter:\n  point(a):\n    - {point(a): 1, b(a): 2}\n", "g.yaml:4:7: expected one step with"),
        ("begin: [1]\nafter:\n  point(a): point(b)\n", "g.yaml:1:9: expected a step with its places"),
        ("begin: point(a)\nbegin: point(a)\n", "g.yaml:2:1: duplicate key 'begin'"),
        ("begin: &x point(a)\n", "anchor '&x' is rejected"),
    ],
)
def test_errors_have_positions(text, message):
    with pytest.raises(GrammarError) as caught:
        parsed_grammar(text, "g.yaml")
    assert message in str(caught.value)


def test_a_step_may_have_another_name_than_its_action():
    grammar = parsed_grammar(GOOD + "actions: {point: pointing}\nswitching: {share: 0.1, before: 0.2}\n")
    assert grammar.steps[0].action == "pointing"
    assert (grammar.switching.share, grammar.switching.before) == (0.1, 0.2)


def test_a_file(tmp_path):
    path = tmp_path / "loop.yaml"
    path.write_text(GOOD, encoding="utf-8")
    assert read_grammar(path).steps[0].name == "point"
    with pytest.raises(GrammarError, match="there is no grammar") as caught:
        read_grammar(tmp_path / "none.yaml")
    assert caught.value.missing
    path.write_bytes(b"\xff\xfe\x00")
    with pytest.raises(GrammarError, match="cannot be read as UTF-8"):
        read_grammar(path)
