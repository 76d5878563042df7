"""Demonstration sets and models of the commands about movement models."""

from pathlib import Path
from typing import NamedTuple

import pytest
from typer.testing import CliRunner

from paramove.cli.main import build
from tests.cli.arm.arm_desk import Bench


class Trained(NamedTuple):
    """Folders and files.

    Attributes:
        table: set with reaching movements to 3 x 3 targets. both: the same and pointing ones.
        model: of `table`. models: classifier of `both`.
    """

    table: Path
    both: Path
    model: Path
    models: Path


def call(*arguments):
    """What a command prints and how it ends."""
    words = [str(argument) for argument in arguments]
    return CliRunner().invoke(build(words[0]), words)


@pytest.fixture(scope="session")
def trained(tmp_path_factory):
    folder = tmp_path_factory.mktemp("models")
    made = Trained(folder / "table", folder / "both", folder / "reaching.npz", folder / "models")
    for goal in (made.table, made.both):
        done = call("demos", "synthesize", goal, "--repetitions", 3)
        assert done.exit_code == 0, done.output
    done = call("demos", "synthesize", made.both, "--action", "pointing", "--repetitions", 3, "--seed", 1, "--add")
    assert done.exit_code == 0, done.output
    for source, goal in ((made.table, made.model), (made.both, made.models)):
        done = call("train", source, "--out", goal, "--leave-out", "none")
        assert done.exit_code == 0, done.output
    return made


@pytest.fixture
def desk(tmp_path):
    with Bench(tmp_path) as bench:
        yield bench
