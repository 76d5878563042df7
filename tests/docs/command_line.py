"""The `paramove` command line without a process of its own for each question."""

import functools
import re

import typer

from paramove.cli.main import COMMANDS, build
from studies.__main__ import app as studies


@functools.cache
def command_line(name):
    return typer.main.get_command(build(name))


def unknown(words):
    """What of a `paramove` command does not exist; "" if all does."""
    return unknown_to(command_line(words[0]), words) if words[0] in COMMANDS else words[0]


def unknown_study(words):
    """The same of `python -m studies`."""
    return unknown_to(typer.main.get_command(studies), words)


def unknown_to(command, words):
    """What of a command and those below it does not exist."""
    for number, word in enumerate(words):
        if word in getattr(command, "commands", {}):
            command = command.commands[word]
        elif hasattr(command, "commands") and re.fullmatch(r"[a-z_-]+", word) and number < 2:
            return word
    known = {option for parameter in command.params for option in (*parameter.opts, *parameter.secondary_opts)}
    options = {word.partition("=")[0].rstrip(".]") for word in words if re.match(r"--?[a-z]", word)}
    return " ".join(sorted(options - known - {"--help"}))
