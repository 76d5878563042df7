"""Two hosts in one process: two bus folders, two key folders, and the loopback between them."""

from __future__ import annotations

import contextlib
import tempfile
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, Literal

import pytest

from benchmarks.hosts import free_ports
from paramove.bus import Bus, BusSettings, BusVisitor, Publisher, Subscriber, topics
from paramove.bus.topics import Topic, split_name
from paramove.hosts import HostKeys, Peer, Relay, RelaySettings


class TwoHosts:
    """`here` gives the topics of `gives`, `there` those of `back`; each has a folder of the bus and one of keys.

    In simulated time messages cross as they are; with `real_time` the commands of `there` come from `here`.
    """

    def __init__(
        self, root: Path, gives: tuple[Topic, ...], back: tuple[Topic, ...] = (), real_time: bool = False
    ) -> None:
        self._clock: Literal["monotonic", "simulated"] = "monotonic" if real_time else "simulated"
        self._opened = contextlib.ExitStack()
        self.folders = {
            name: Path(self._opened.enter_context(tempfile.TemporaryDirectory())) for name in ("here", "there")
        }
        self.keys = {name: HostKeys(root / name) for name in self.folders}
        self.ports = {name: free_ports() for name in self.folders}
        crossing = {"here": gives, "there": back}
        self.relays: dict[str, Relay] = {}
        self.settings: dict[str, RelaySettings] = {}
        self._running: dict[str, contextlib.ExitStack] = {}
        for name, other in (("here", "there"), ("there", "here")):
            self.keys[name].trust(other, self.keys[other].own().public)
            rows = [{one.name: split_name(one.name)[1] for one in crossing[side]} for side in (name, other)]
            peer = Peer(
                address="127.0.0.1",
                port=self.ports[other],
                key=self.keys[other].own().public,
                wants=rows[0],
                gives=rows[1],
                commands=real_time and name == "there",
            )
            self.settings[name] = RelaySettings(
                address="127.0.0.1", port=self.ports[name], peers={other: peer}, keys=self.keys[name].folder
            )

    def start(self, *names: str) -> None:
        """Starts the relays of these hosts, of both by default."""
        for name in names or self.folders:
            self._running[name] = self._opened.enter_context(contextlib.ExitStack())
            bus = Bus(f"relay_{name}", BusSettings(folder=self.folders[name], clock=self._clock))
            self._running[name].callback(bus.close)
            self.relays[name] = self._running[name].enter_context(Relay(bus, self.settings[name]))

    def stop(self, name: str) -> None:
        """Ends a host's relay."""
        del self.relays[name]
        self._running[name].close()

    def connected(self, topic: Topic) -> tuple[Publisher, Subscriber]:
        """Both relays started, a publisher here and its subscriber there, which has been welcomed."""
        published, subscriber = self.visitor("here").publisher(topic), self.visitor("there").subscriber(topic)
        self.start()
        self.until(lambda: subscriber.welcomed, subscriber.receive, published.serve)
        return published, subscriber

    def visitor(self, name: str) -> BusVisitor:
        """Sockets on a host's bus."""
        return self._opened.enter_context(BusVisitor(self.folders[name], "a test"))

    def until(
        self, condition: Callable[[], Any], *also: Callable[[], Any], only: str = "", seconds: float = 60.0
    ) -> Any:
        """Lets the relays, or one of them only, work until the condition is true; returns what it gave."""
        end_s = time.monotonic() + seconds
        while time.monotonic() < end_s:
            for name, relay in self.relays.items():
                if only in ("", name):
                    relay.step()
            for call in also:
                call()
            if found := condition():
                return found
        raise AssertionError(f"not within {seconds} s: {condition}")

    def close(self) -> None:
        self._opened.close()


@pytest.fixture
def two_hosts(tmp_path: Path) -> Iterator[Callable[..., TwoHosts]]:
    with contextlib.ExitStack() as opened:

        def make(
            gives: tuple[Topic, ...], back: tuple[Topic, ...] = (topics.RULES,), real_time: bool = False
        ) -> TwoHosts:
            hosts = TwoHosts(tmp_path, gives, back, real_time)
            opened.callback(hosts.close)
            return hosts

        yield make
