"""Every `paramove` command that a message or a docstring of the code names exists, with its options."""

import ast
import re

import pytest

from paramove.cli.main import COMMANDS
from tests.docs.command_line import unknown
from tests.docs.markdown import ROOT

NAMED = re.compile(r"([`'\"]?)paramove ([a-z][^`'\"\n;:,()]*)")
PLACES = ("src/paramove", "nodes", "sim")


def named_commands(text):
    """The words after `paramove` of each command that a text names; prose goes on with a word that is no command."""
    for quote, words in NAMED.findall(text):
        if quote or words.split()[0] in COMMANDS:
            yield words.split()


def test_commands_named_in_the_code_exist():
    found = []
    for path in (path for place in PLACES for path in sorted((ROOT / place).rglob("*.py"))):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Constant) and isinstance(node.value, str):
                found += [
                    f"{path.relative_to(ROOT)}:{node.lineno}: paramove {' '.join(words)}: {wrong}"
                    for words in named_commands(node.value)
                    if (wrong := unknown(words))
                ]
    assert found == []


@pytest.mark.parametrize("text", ["run paramove train --kind", "`paramove nothing`", "'paramove topic ecko'"])
def test_a_command_that_does_not_exist_is_found(text):
    assert all(unknown(words) for words in named_commands(text))
    assert list(named_commands(text))
