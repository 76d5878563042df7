"""Parameters that change while a node runs: at their time, checked, and reported."""

from typing import ClassVar

import pytest
from pydantic import Field, model_validator

from paramove.bus import NodeConfig
from paramove.bus.live_parameters import MOST_WAITING, LiveParameters
from paramove.msgs.parameters_pb2 import ParameterRequest

SECOND = 10**9


class Config(NodeConfig):
    """Of a node in these tests."""

    CHANGEABLE: ClassVar = ("speed", "names")

    speed: float = Field(1.0, gt=0.0, le=9.0)
    names: tuple[str, ...] = ("a",)
    fixed: int = 3

    @model_validator(mode="after")
    def _fits(self):
        if self.speed > 5.0 and len(self.names) > 1:
            raise ValueError("too fast for two")
        return self


@pytest.fixture
def config():
    return Config()


@pytest.fixture
def live(config):
    return LiveParameters("node", config, config.CHANGEABLE)


def request(name="speed", value="2.5", at_s=None, node="node", number="1"):
    made = ParameterRequest(id=number, node=node, name=name, value=value)
    if at_s is not None:
        made.at.FromNanoseconds(round(at_s * SECOND))
    return made


def of(live, name):
    return next(parameter for parameter in live.parameters if parameter.name == name)


def test_a_value_lands_at_once_or_exactly_at_its_time(live, config):
    assert live.receive(request(), SECOND)
    assert config.speed == 1.0
    assert live.land(SECOND)
    assert config.speed == 2.5
    assert live.receive(request(value="3", at_s=2.0, number="2"), SECOND)
    assert not live.land(2 * SECOND - 1)
    assert (config.speed, of(live, "speed").value) == (2.5, "2.5")
    assert live.land(2 * SECOND)
    assert (config.speed, of(live, "speed").value) == (3.0, "3.0")
    assert of(live, "speed").changed.ToNanoseconds() == 2 * SECOND


def test_values_are_yaml_and_land_in_the_order_of_their_times(live, config):
    live.receive(request("names", "[b, c]", 3.0), 0)
    live.receive(request("names", "[d]", 2.0), 0)
    live.land(2 * SECOND)
    assert config.names == ("d",)
    live.land(3 * SECOND)
    assert config.names == ("b", "c")
    assert of(live, "names").value == '["b", "c"]'


@pytest.mark.parametrize(
    ("wrong", "words"),
    [
        (request(value="0"), "greater than 0"),
        (request(value="fast"), "valid number"),
        (request(value="[1"), "speed"),
        (request(value="nan"), "speed"),
    ],
)
def test_what_is_wrong_is_rejected_with_the_reason_and_changes_nothing(live, config, wrong, words):
    assert live.receive(wrong, SECOND)
    assert not live.land(9 * SECOND)
    assert config == Config()
    assert words in of(live, "speed").rejection
    assert of(live, "speed").request_id == "1"


@pytest.mark.parametrize(("name", "words"), [("fixed", "there are: names, speed"), ("sped", "did you mean 'speed'?")])
def test_what_does_not_change_while_the_node_runs_is_logged_with_what_does(live, config, caplog, name, words):
    assert not live.receive(request(name, "4"), SECOND)
    assert not live.land(SECOND)
    assert config == Config()
    assert words in caplog.text


def test_a_time_that_is_over_is_rejected_as_late(live, config):
    live.receive(request(at_s=0.9), SECOND)
    assert of(live, "speed").late
    assert not live.land(SECOND)
    live.receive(request(number="2"), SECOND)
    assert (of(live, "speed").late, of(live, "speed").rejection) == (False, "")


def test_a_value_that_no_longer_fits_when_its_time_comes_is_rejected_then(live, config):
    live.receive(request("speed", "6", 2.0), SECOND)
    live.receive(request("names", "[a, b]", 1.5), SECOND)
    live.land(3 * SECOND)
    assert (config.speed, config.names) == (1.0, ("a", "b"))
    assert "too fast for two" in of(live, "speed").rejection


def test_requests_to_others_and_floods_are_ignored(live):
    assert not live.receive(request(node="other"), 0)
    for number in range(MOST_WAITING + 1):
        live.receive(request(at_s=5.0, number=str(number)), 0)
    assert "wait for their time already" in of(live, "speed").rejection


def test_a_changeable_name_that_is_no_parameter_is_an_error(config):
    with pytest.raises(ValueError, match="did you mean 'speed'"):
        LiveParameters("node", config, ("spee",))
