"""The `paramove` command line without a process of its own for each question."""

import functools
import re

import typer

from paramove.cli.main import COMMANDS, build


@functools.cache
def command_line(name):
    return typer.main.get_command(build(name))


def unknown(words):
    """What of a command does not exist; "" if all does."""
    if words[0] not in COMMANDS:
        return words[0]
    command = command_line(words[0])
    for number, word in enumerate(words):
        if word in getattr(command, "commands", {}):
            command = command.commands[word]
        elif hasattr(command, "commands") and re.fullmatch(r"[a-z_-]+", word) and number < 2:
            return word
    known = {option for parameter in command.params for option in (*parameter.opts, *parameter.secondary_opts)}
    options = {word.partition("=")[0].rstrip(".]") for word in words if re.match(r"--?[a-z]", word)}
    return " ".join(sorted(options - known - {"--help"}))
