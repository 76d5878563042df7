"""The dashboard's node: a replay, and a person's stop over a real bus."""

from __future__ import annotations

import json
import threading
from pathlib import Path

import pytest

from nodes import dashboard
from paramove.bus import topics
from paramove.bus.bus import Bus
from paramove.bus.recorded import RecordedBus, with_ticks
from paramove.bus.settings import BusSettings
from paramove.dashboard.link_file import NAME, link_in
from paramove.msgs.safety_state_pb2 import SafetyState
from paramove.safety.gate_io import PERSON_STOP
from tests.dashboard import scene
from tests.dashboard.conftest import WAIT_S, Visitor
from tests.motion.reaching import ROBOT_FOLDER

CONFIG = dashboard.Config(robot=ROBOT_FOLDER)
SENTENCE = "stopped from the page by a person"


def test_hears_nothing_of_the_truth_and_says_nothing_but_the_stop() -> None:
    assert not any(topic.truth for topic in dashboard.SUBSCRIBES)
    assert dashboard.PUBLISHES == (topics.OPERATOR_STOP,)


def test_a_replay_shows_all_and_says_nothing(tmp_path: Path) -> None:
    bus = RecordedBus(with_ticks(scene.heard(scene.messages())), run_folder=tmp_path)
    dashboard.run(bus, CONFIG)
    assert bus.published == []
    assert [state for state, _ in bus.states] == ["ready"]
    assert not (tmp_path / NAME).exists()


def test_the_run_ends_once_the_arm_rests_after_a_stop(tmp_path: Path) -> None:
    hold = (topics.ARM_SAFETY, scene.safety(SafetyState.STATE_HOLD, (PERSON_STOP, SENTENCE)))
    later = scene.heard([hold], 9_000_000_000)
    bus = RecordedBus(with_ticks([*scene.heard([hold]), *later]), run_folder=tmp_path)
    dashboard.run(bus, CONFIG)
    assert bus.states[-1] == ("stopped", SENTENCE)
    assert bus.now_ns < 5_000_000_000


def test_a_pressed_button_is_said_on_the_bus_at_once(tmp_path: Path) -> None:
    """Between two ticks: no message and no tick comes after the press but what the press itself causes."""
    folder = tmp_path / "bus"
    settings = BusSettings(folder=folder, clock="simulated")  # nobody says the clock, so there are no ticks
    with (
        Bus("dashboard", settings, dashboard.SUBSCRIBES, dashboard.PUBLISHES, tmp_path) as bus,
        Bus("driver", BusSettings(folder=folder), subscribes=(topics.OPERATOR_STOP,)) as driver,
    ):
        failures: list[BaseException] = []

        def press() -> None:
            try:
                while not (link := link_in(tmp_path)):
                    driver.idle(0.05)
                visitor = Visitor(int(json.loads((tmp_path / NAME).read_text())["port"]))
                visitor.open_link(link)
                with visitor.socket() as live:
                    live.recv(WAIT_S)
                    live.send("stop")
                    for heard in driver.events(topics.OPERATOR_STOP):
                        assert heard.message.source == "page"
                        break
            except BaseException as error:
                failures.append(error)
            finally:
                bus.stop()

        person = threading.Thread(target=press)
        person.start()
        dashboard.run(bus, CONFIG)
        person.join(WAIT_S)
        assert failures == []


def test_a_wrong_port_is_refused() -> None:
    with pytest.raises(ValueError, match="port"):
        dashboard.Config(port=70000)
