"""`paramove goal send`: the state of a goal is the exit code."""

import json

import pytest
from typer.testing import CliRunner

from paramove.cli.main import build
from paramove.documents import exit_codes


def send(*words):
    return CliRunner().invoke(build("goal"), ["goal", "send", *words])


@pytest.mark.parametrize(
    ("goal", "code", "printed"),
    [
        ("{object: blue}", 0, "succeeded blue"),
        ("{object: red}", exit_codes.JUDGED_A_FAILURE, "rejected red"),
        ("{objekt: red}", exit_codes.CONFIGURATION, "objekt"),
    ],
)
def test_a_goal_is_followed_to_its_end(node, goal, code, printed):
    done = send(goal, "--wait", "30")
    assert (done.exit_code, printed in done.output) == (code, True), done.output


def test_json_has_the_whole_status(node):
    assert json.loads(send("{object: blue}", "--json").output)["state"] == "STATE_SUCCEEDED"


def test_a_goal_without_an_end_is_reported(node):
    done = send("{}", "--wait", "1")
    assert (done.exit_code, "has not ended within 1 s" in done.output) == (exit_codes.FAILURE, True)


def test_where_nothing_runs_that_is_reported(folder):
    done = send("{}")
    assert (done.exit_code, "nothing is running" in done.output) == (exit_codes.INPUT_MISSING, True)
