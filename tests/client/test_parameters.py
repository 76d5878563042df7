"""Parameters of nodes changed from outside, by Python and by `paramove param`."""

import json
import threading
from typing import ClassVar

import pytest
from typer.testing import CliRunner

from paramove.bus import Bus, BusSettings, BusVisitor, NodeConfig, TopicTakenError, topics
from paramove.bus.live_parameters import LiveParameters
from paramove.cli.main import build
from paramove.client import NoMessageError, RejectedParameterError, Run, parameters_of, set_parameter
from paramove.documents import InputError, exit_codes


class Config(NodeConfig):
    """Of the node in these tests."""

    CHANGEABLE: ClassVar = ("speed",)

    speed: float = 1.0


@pytest.fixture
def speeds(folder):
    """What the node has read at its ticks; it runs in a thread as if it were a process."""
    read, buses, ready, config = [], [], threading.Event(), Config()

    def run():
        with Bus("walker", BusSettings(folder=folder)) as bus:
            buses.append(bus)
            bus.follow(LiveParameters("walker", config, config.CHANGEABLE))
            bus.ready("walks")
            ready.set()
            for _ in bus.events(tick=True):
                read.append(config.speed)

    thread = threading.Thread(target=run)
    thread.start()
    assert ready.wait(60)
    yield read
    buses[0].stop()
    thread.join()


def param(*words):
    return CliRunner().invoke(build("param"), ["param", *words])


def test_a_parameter_is_changed_and_the_node_uses_it(folder, speeds):
    with Run(folder) as run:
        assert parameters_of(run, "walker", 30.0)["speed"].value == "1.0"
        done = set_parameter(run, "walker", "speed", 2.5, timeout_s=30.0)
        assert (done.value, done.rejection) == ("2.5", "")
        run.idle(0.3)
    assert speeds[-1] == 2.5


def test_what_a_node_does_not_take_is_raised(folder, speeds):
    with Run(folder) as run:
        with pytest.raises(RejectedParameterError, match="valid number"):
            set_parameter(run, "walker", "speed", "fast", timeout_s=30.0)
        with pytest.raises(InputError, match="did you mean 'speed'"):
            set_parameter(run, "walker", "spee", 1.0, timeout_s=30.0)
        with pytest.raises(NoMessageError):
            set_parameter(run, "runner", "speed", 1.0, timeout_s=0.1)
    with BusVisitor(folder, "another") as other, Run(folder) as run:
        other.publisher(topics.PARAMETERS_SET)
        with pytest.raises(TopicTakenError):
            set_parameter(run, "walker", "speed", 1.0, timeout_s=30.0)


def test_the_command_lists_gets_and_sets(folder, speeds):
    assert json.loads(param("list", "--json").output) == [
        {"parameter": "walker.speed", "value": 1.0, "changed_s": None}
    ]
    assert param("get", "walker", "speed").output == "1.0\n"
    done = param("set", "walker", "speed", "3")
    assert (done.exit_code, done.output) == (exit_codes.OK, "walker.speed is 3.0\n")
    assert param("get", "walker", "speed").output == "3.0\n"
    assert "walker.speed" in param("list", "walker").output


@pytest.mark.parametrize(
    ("words", "code", "printed"),
    [
        (("set", "walker", "speed", "fast"), exit_codes.CONFIGURATION, "valid number"),
        (("set", "walker", "size", "1"), exit_codes.CONFIGURATION, "speed"),
        (("set", "wlker", "speed", "1", "--wait", "0.1"), exit_codes.FAILURE, "status/wlker"),
        (("get", "walker", "size"), exit_codes.USAGE, "speed"),
        (("get", "wlker", "speed", "--wait", "0.1"), exit_codes.FAILURE, "did you mean 'walker'?"),
    ],
)
def test_what_the_command_rejects_is_reported(folder, speeds, words, code, printed):
    done = param(*words)
    assert (done.exit_code, printed in done.output) == (code, True), done.output
