"""Lockstep with real processes."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from paramove.bus import topics
from paramove.bus.barrier import LockstepBarrier
from paramove.bus.bus import Bus
from paramove.bus.lockstep import from_marks
from paramove.bus.settings import BusSettings
from paramove.documents import InputError
from paramove.msgs.clock_pb2 import TickDone
from paramove.msgs.rule_pb2 import Speech
from paramove.msgs.tracked_objects_pb2 import TrackedObjects
from tests.bus.conftest import Wait

ROOT = Path(__file__).resolve().parents[2]
PERIOD_NS = 66_666_667
MEMBERS = {"a": "gesture", "b": "speech", "c": "idle"}


class Members:
    """Processes of `tests.bus.lockstep_member`, ended with the test."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.processes: dict[str, subprocess.Popen[bytes]] = {}

    def start(self, node: str, log: Path, seed: str) -> None:
        arguments = [node, str(self.folder), str(log), seed, MEMBERS[node]]
        command = [sys.executable, "-m", "tests.bus.lockstep_member", *arguments]
        self.processes[node] = subprocess.Popen(command, cwd=ROOT)

    def end(self) -> list[int]:
        for process in self.processes.values():
            if process.poll() is None:
                process.send_signal(signal.SIGTERM)
        return [process.wait(60) for process in self.processes.values()]


@pytest.fixture
def members(folder: Path) -> Iterator[Members]:
    started = Members(folder)
    yield started
    for process in started.processes.values():
        process.kill()
        process.wait()


def _simulator(folder: Path, names: tuple[str, ...]) -> Bus:
    settings = BusSettings(folder=folder, clock="simulated", lockstep=True, members=names)
    return Bus("simulator", settings, (topics.GESTURES, topics.SPEECH), (topics.CLOCK, topics.OBJECTS_TRACKED))


def _tick(bus: Bus, barrier: LockstepBarrier) -> list[str]:
    bus.publish(topics.OBJECTS_TRACKED, TrackedObjects(width_px=barrier.tick + 1))
    heard = barrier.advance((barrier.tick + 1) * PERIOD_NS)
    return [f"{item.topic.name} {item.sequence} {item.published_ns}" for item in heard]


def _run(members: Members, logs: Path, seed: str, ticks: int) -> list[str]:
    logs.mkdir()
    told = []
    with _simulator(members.folder, tuple(MEMBERS)) as bus:
        barrier = LockstepBarrier(bus)
        for node in MEMBERS:
            members.start(node, logs / node, seed + node)
        bus.publish(topics.OBJECTS_TRACKED, TrackedObjects(width_px=1000))
        assert barrier.wait_for_members()
        assert barrier.members == set(MEMBERS)
        for _ in range(ticks):
            told += _tick(bus, barrier)
        assert barrier.lost == []
        assert members.end() == [0, 0, 0]
    return told


def test_the_same_run_twice_however_slow_the_members_are(members: Members, tmp_path: Path) -> None:
    first = _run(members, tmp_path / "1", "one", 40)
    second = _run(members, tmp_path / "2", "two", 40)
    assert first == second
    # Gestures of tick k are heard by the simulator at the end of tick k; two for each image, one sentence a tick.
    assert len(first) == 2 * 41 + 41
    for node in MEMBERS:
        texts = [(tmp_path / run / node).read_text(encoding="utf-8") for run in "12"]
        assert texts[0] == texts[1]
        assert texts[0].count("tick ") >= 40
    lines = (tmp_path / "1" / "b").read_text(encoding="utf-8").splitlines()
    gestures = [line for line in lines if line.startswith("gestures")]
    # Node to node takes one tick; the simulator's own messages none.
    assert gestures[0] == f'gestures 1 {PERIOD_NS} object: "1000" '
    assert lines.index(gestures[0]) > lines.index(f"tick 1 {PERIOD_NS}")


def test_what_a_member_published_before_it_left_counts_for_one_more_tick(folder: Path) -> None:
    with _simulator(folder, ()) as bus:
        barrier = LockstepBarrier(bus)
        marks = from_marks({"speech": (7, 3), "lockstep/b": (os.getpid(), 0)})
        assert barrier._take(TickDone(node="b", pid=os.getpid(), kind=TickDone.KIND_JOIN, published=marks))
        barrier._admit()
        assert barrier._take(TickDone(node="b", pid=os.getpid(), kind=TickDone.KIND_LEAVE, published=marks))
        assert barrier.members == frozenset()
        assert barrier._all_marks()["speech"] == (7, 3)
        assert "lockstep/b" not in barrier._all_marks()
        barrier._publish_tick(PERIOD_NS)
        assert "speech" not in barrier._all_marks()
        barrier.close()


def test_a_killed_member_is_named_and_joins_again(
    members: Members, tmp_path: Path, wait: Wait, caplog: pytest.LogCaptureFixture
) -> None:
    with _simulator(members.folder, ("b", "c")) as bus:
        barrier = LockstepBarrier(bus)
        for node in ("b", "c"):
            members.start(node, tmp_path / node, node)
        assert barrier.wait_for_members()
        for _ in range(5):
            _tick(bus, barrier)
        members.processes["b"].kill()
        members.processes["b"].wait()
        for _ in range(5):
            _tick(bus, barrier)
        assert barrier.lost == ["b"]
        assert barrier.members == {"c"}
        assert "member b ended at tick" in caplog.text
        members.start("b", tmp_path / "b2", "b")
        told: list[str] = []
        wait(lambda: barrier.members == {"b", "c"}, lambda: told.extend(_tick(bus, barrier)))
        told.clear()
        for _ in range(5):
            told += _tick(bus, barrier)
        assert len([line for line in told if line.startswith("speech")]) >= 4
        assert members.end() == [0, 0]
        assert _tick(bus, barrier) == []
        assert sorted(barrier.lost) == ["b", "b", "c"]


def test_a_stopped_process_makes_time_wait_and_is_named(
    members: Members, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    monkeypatch.setattr("paramove.bus.barrier.WARNING_PERIOD_S", 0.05)
    with _simulator(members.folder, ("c",)) as bus:
        barrier = LockstepBarrier(bus)
        members.start("c", tmp_path / "c", "c")
        assert barrier.wait_for_members()
        process = members.processes["c"]
        process.send_signal(signal.SIGSTOP)
        complaints: list[str] = []

        def go_on_after_a_complaint() -> None:
            complaints[:] = [record.message for record in caplog.records if "time waits for c" in record.message]
            if complaints:
                os.kill(process.pid, signal.SIGCONT)

        wait_once = bus.exchange.wait
        monkeypatch.setattr(
            bus.exchange, "wait", lambda seconds: (go_on_after_a_complaint(), wait_once(min(seconds, 0.05)))[1]
        )
        assert _tick(bus, barrier) == []
        assert complaints
        assert barrier.members == {"c"}


def test_only_the_bus_that_says_the_clock_sets_the_time(folder: Path) -> None:
    with (
        Bus("node", BusSettings(folder=folder, clock="simulated")) as bus,
        pytest.raises(RuntimeError, match="does not publish clock"),
    ):
        bus.keep_time(1)
    with _simulator(folder, ()) as bus:
        bus.keep_time(2)
        with pytest.raises(RuntimeError, match="time would run back from 2 ns to 1 ns"):
            bus.keep_time(1)
        with pytest.raises(RuntimeError, match="LockstepBarrier"):
            next(bus.events())


def test_simulated_time_in_a_run_with_the_time_of_the_machine_is_rejected(folder: Path) -> None:
    settings = BusSettings(folder=folder, begun_ns=5)
    with (
        Bus("world", settings, (), (topics.CLOCK,)) as bus,
        pytest.raises(InputError, match="clock: simulated"),
    ):
        bus.keep_time(1)


def test_without_lockstep_the_clock_is_said_and_nobody_is_waited_for(folder: Path, wait: Wait) -> None:
    settings = BusSettings(folder=folder, clock="simulated")
    with (
        Bus("simulator", settings, (topics.SPEECH,), (topics.CLOCK,)) as simulator,
        Bus("node", settings, (), (topics.SPEECH,)) as node,
    ):
        barrier = LockstepBarrier(simulator)
        assert barrier.wait_for_members()
        clock = node.exchange.subscribers[topics.CLOCK.name]
        wait(lambda: clock.receive() is None and clock.welcomed, lambda: simulator.exchange.wait(0.001))
        barrier.advance(PERIOD_NS)
        ticks = node.events(tick=True)
        assert next(ticks).number == 1
        assert node.now_ns == PERIOD_NS
        node.publish(topics.SPEECH, Speech(text="hello"))
        # The speaker answers the simulator's subscription only now, so the sentence itself may be missed.
        assert simulator.exchange.subscribers["speech"].counter.lost == 0
