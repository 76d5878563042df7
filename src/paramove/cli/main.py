"""The `paramove` command. Mounts the sub-commands; each is in a file of its own.

A module named here has an attribute `app`, a `typer.Typer`: with a name (`Typer(name="topic")`) it becomes a group of
commands, without one its commands are mounted as they are. Only the module of the command that is called is imported,
so that `paramove topic list` does not wait for what training needs.
"""

from __future__ import annotations

import importlib
import os
import sys
from collections.abc import Mapping, Sequence
from typing import Annotated

import typer

from paramove.cli.completions import typed_words
from paramove.documents import FULL_DISK, TEMPORARY, UNAVAILABLE, InputError
from paramove.linear_algebra_threads import use_one_thread
from paramove.terminal_size import drop_unusable_sizes

COMMANDS: dict[str, tuple[str, str]] = {
    "demo": ("paramove.cli.demo", "Run the demonstration: `paramove launch rule_learning`."),
    "launch": ("paramove.cli.launch", "Run an application from its launch file."),
    "run": ("paramove.cli.run", "Run one node, beside a running application or alone."),
    "new": ("paramove.cli.new", "Write an application of your own, to begin with."),
    "graph": ("paramove.cli.graph", "Draw the nodes and topics of a launch file, or of what is running."),
    "topic": ("paramove.cli.topic", "Look at topics, messages and rates on the bus."),
    "goal": ("paramove.cli.goal", "Send the robot of a running application a goal."),
    "interface": ("paramove.cli.interface", "Look at the types of messages."),
    "node": ("paramove.cli.node", "Look at the nodes on the bus."),
    "param": ("paramove.cli.param", "Look at and change parameters of nodes that run."),
    "host": ("paramove.cli.host", "Trust and check the other computers of a run."),
    "logs": ("paramove.cli.logs", "Show the log lines of a run's nodes, in the order of time."),
    "calibrate": ("paramove.cli.calibrate", "Print the calibration board; calibrate cameras."),
    "webcam": ("paramove.cli.webcam", "Fetch what tracking a person with a webcam needs."),
    "teach": ("paramove.cli.teach", "Teach a movement by showing it to cameras."),
    "arm": ("paramove.cli.arm", "Find, set up, calibrate, check, move and stop an arm of servos."),
    "demos": ("paramove.cli.demos", "List, show, plot, label, import, split and synthesize demonstrations."),
    "train": ("paramove.cli.train", "Train movement models from demonstrations."),
    "models": ("paramove.cli.models", "List, show, plot and compare movement models."),
    "recognize": ("paramove.cli.recognize", "Recognize the action of a movement and its parameters."),
    "synthesize": ("paramove.cli.synthesize", "Make the movement for given parameters."),
    "bag": ("paramove.cli.bag", "Look into a recording, or play it on a bus."),
    "recover": ("paramove.cli.recover", "Rebuild a recording whose writer was killed or whose bytes are damaged."),
    "evaluate": ("paramove.cli.evaluate", "Repeat experiments and measure their success."),
    "warm": ("paramove.cli.warm", "Compile kernels and train the reaching model, so that the first run starts fast."),
    "doctor": ("paramove.cli.doctor", "Check this machine and its installation."),
}
"""Name -> module and one line of help."""
EXTRAS = dict.fromkeys(("av", "cv2", "dynamixel_sdk", "mujoco", "serial", "websockets", "zmq"), "robot")
"""Module -> the extra of the package that brings it."""


def _version(requested: bool) -> None:
    if requested:
        from paramove import __version__

        typer.echo(f"paramove {__version__}")
        raise typer.Exit


def _callback(
    version: Annotated[
        bool, typer.Option("--version", callback=_version, is_eager=True, help="Show the version.")
    ] = False,
) -> None:
    """Learns parametric human movements from a few demonstrations; recognises, tracks and synthesises them."""


def build(requested: str | None) -> typer.Typer:
    """The command line with the command `requested` in full and the others by their help only."""
    app = typer.Typer(name="paramove", no_args_is_help=True, pretty_exceptions_enable=False)
    app.callback()(_callback)
    for name, (module, help_text) in COMMANDS.items():
        if name == requested:
            app.add_typer(importlib.import_module(module).app)
        else:
            app.command(name, help=help_text)(_placeholder)
    return app


def _placeholder() -> None:
    raise RuntimeError("a command is called without its module")


def wanted_command(arguments: Sequence[str], environment: Mapping[str, str]) -> str | None:
    """The command that is called, or whose options a shell completes; None if there is none yet."""
    if "_PARAMOVE_COMPLETE" in environment:
        arguments = typed_words(environment)
    return next((argument for argument in arguments[1:] if not argument.startswith("-")), None)


def main() -> None:
    """Entry point of the `paramove` script."""
    use_one_thread()
    drop_unusable_sizes()
    try:
        build(wanted_command(sys.argv, os.environ))(prog_name="paramove")
    except ModuleNotFoundError as error:
        package = (error.name or "").partition(".")[0]
        if package not in EXTRAS:
            raise
        sys.stderr.write(
            f"this needs {package}, which the extra '{EXTRAS[package]}' brings: "
            f"pip install 'paramove[{EXTRAS[package]}]'\n"
        )
        sys.exit(UNAVAILABLE)
    except InputError as error:  # of a command that does not handle it
        sys.stderr.write(f"{error}\n")
        sys.exit(error.exit_code)
    except OSError as error:
        if error.errno not in FULL_DISK:
            raise
        sys.stderr.write(f"{error.filename or 'the output'} cannot be written: {error.strerror}\n")
        sys.exit(TEMPORARY)


if __name__ == "__main__":
    main()
