"""`paramove arm jog` on a real bus, with an arm's driver that does what it is told, and a person at the keys."""

from __future__ import annotations

import contextlib
import os
import subprocess
import sys
import tempfile
import threading
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from foxglove_schemas_protobuf.JointState_pb2 import JointState
from foxglove_schemas_protobuf.JointStates_pb2 import JointStates
from typer.testing import CliRunner

from paramove.bus import topics
from paramove.bus.bus import Bus
from paramove.bus.settings import BusSettings
from paramove.cli.arm.terminal_person import TerminalPerson
from paramove.cli.main import build
from paramove.msgs.joint_trajectory_pb2 import TrajectoryStatus
from paramove.msgs.safety_state_pb2 import SafetyFault, SafetyState
from paramove.operator.jogging import Jogging
from paramove.safety.gate_io import PERSON_STOP
from tests.supervision.test_unread_terminal import stopped_terminal

SUBSCRIBES = (topics.ARM_TRAJECTORY, topics.OPERATOR_ARM, *topics.STOPS)
STOPPED = SafetyFault(code=PERSON_STOP, detail="stopped by a person")
PUBLISHES = (topics.ARM_JOINT_STATES, topics.ARM_TRAJECTORY_STATUS, topics.ARM_SAFETY)


@pytest.fixture
def folder(monkeypatch):
    with tempfile.TemporaryDirectory(prefix="jog-") as runtime:
        monkeypatch.setenv("XDG_RUNTIME_DIR", runtime)
        monkeypatch.delenv("PARAMOVE_DOMAIN", raising=False)
        folder = Path(runtime) / "paramove" / "default"
        folder.mkdir(parents=True, mode=0o700)
        yield folder


class Arm:
    """Two joints; each of its answers has the person press the next keys."""

    def __init__(self, bus, keys):
        self.angles = {"pan": 0.0, "lift": 0.5}
        self.heard = []
        self.ticks = self.stops_until = 0
        self._bus, self._keys = bus, iter(keys)
        self.write = lambda text: None

    def run(self):
        self._say_state(SafetyState.STATE_DISARMED)
        for event in self._bus.events(*SUBSCRIBES, tick=True):
            self._bus.publish(
                topics.ARM_JOINT_STATES,
                JointStates(joints=[JointState(name=name, position=angle) for name, angle in self.angles.items()]),
            )
            if hasattr(event, "topic"):
                self._hear(event.topic, event.message)
                continue
            self.ticks += 1
            if self.ticks == self.stops_until:
                self.stops_until = 0
                self._say_state(SafetyState.STATE_HOLD, STOPPED)

    def _hear(self, topic, message):
        if topic in topics.STOPS:
            if "stop" in self.heard:
                return  # it is said until it is answered
            self.heard.append("stop")
            self.stops_until = self.ticks + 5
            self._say_state(SafetyState.STATE_STOPPING, STOPPED)
        elif topic is topics.OPERATOR_ARM:
            if self.stops_until:
                self.heard.append("arm while it stops")
            else:
                self.heard.append(f"arm from the {message.source}")
                self._say_state(SafetyState.STATE_ARMED)
        else:
            (joint,) = message.joints
            self.heard.append(joint)
            self.angles[joint] = message.points[-1].position_rad[0]
            self._bus.publish(
                topics.ARM_TRAJECTORY_STATUS,
                TrajectoryStatus(trajectory_id=message.id, state=TrajectoryStatus.STATE_SUCCEEDED),
            )
            return  # the person sees it before the next key
        self.write(next(self._keys))

    def seen(self):
        self.write(next(self._keys))

    def _say_state(self, state, *faults):
        self._bus.publish(topics.ARM_SAFETY, SafetyState(state=state, faults=faults))


@contextlib.contextmanager
def running(folder, keys):
    """The arm's driver in a thread of its own."""
    made, ready = [], threading.Event()

    def drive():
        with Bus("driver", BusSettings(folder=folder), SUBSCRIBES, PUBLISHES) as bus:
            made.extend((bus, Arm(bus, keys)))
            ready.set()
            made[1].run()

    thread = threading.Thread(target=drive)
    thread.start()
    assert ready.wait(60)
    yield made[1]
    made[0].stop()
    thread.join()


def jogged(monkeypatch, arm, first):
    """What the command says, and how it ends, after the first keys and those that the arm has pressed."""
    read, write = os.pipe()
    arm.write = lambda text: os.write(write, text.encode())
    os.write(write, first.encode())
    handle = Jogging.handle_status

    def hear_and_press(jogging, message):
        handle(jogging, message)
        arm.seen()

    monkeypatch.setattr(Jogging, "handle_status", hear_and_press)
    with os.fdopen(read) as source:
        monkeypatch.setattr("paramove.cli.arm.jog.TerminalPerson", lambda: TerminalPerson(source))
        done = CliRunner().invoke(build("arm"), ["arm", "jog", "--step", "3"])
    os.close(write)
    return done


def test_keys_arm_move_and_stop_the_arm(folder, monkeypatch):
    with running(folder, ["2-", "1+", " ", "q"]) as arm:
        done = jogged(monkeypatch, arm, "a")
    assert done.exit_code == 0, done.output
    assert arm.heard == ["arm from the terminal", "lift", "pan", "stop"]
    assert arm.angles == pytest.approx({"pan": np.deg2rad(3.0), "lift": 0.5 - np.deg2rad(3.0)})
    assert "2 lift" in done.stdout


def test_an_arm_that_still_stops_is_armed_once_it_rests(folder, monkeypatch):
    with running(folder, ["1+", " ", "a", "q"]) as arm:
        done = jogged(monkeypatch, arm, "a")
    assert done.exit_code == 0, done.output
    assert arm.heard == ["arm from the terminal", "pan", "stop", "arm from the terminal"]
    assert "the arm is still stopping: it is armed once it rests" in done.stdout


def test_a_terminal_that_takes_nothing_keeps_no_key_from_the_arm(folder):
    terminal, end = stopped_terminal()
    command = [sys.executable, "-m", "paramove.cli.main", "arm", "jog"]
    with running(folder, [" ", "q"]) as arm:
        jog = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=end, stderr=end)
        arm.write = lambda text: os.write(jog.stdin.fileno(), text.encode())
        arm.write("a")
        try:
            assert jog.wait(60) == 0
        finally:
            jog.kill()
            jog.communicate()
            os.close(end)
            os.close(terminal)
    assert arm.heard == ["arm from the terminal", "stop"]


def test_a_driver_that_is_gone_is_told(folder, monkeypatch):
    monkeypatch.setattr("paramove.cli.arm.jog.NO_DATA_S", 0.0)
    with running(folder, ["q"]) as arm:
        done = jogged(monkeypatch, arm, "a")
    assert "no data" in done.stdout
    assert "is the arm's driver running?" in done.stdout


def test_without_an_arm_it_says_so(folder, monkeypatch):
    monkeypatch.setattr("paramove.cli.arm.jog.TIMEOUT_S", 0.2)
    read, write = os.pipe()
    with os.fdopen(read) as source:
        monkeypatch.setattr("paramove.cli.arm.jog.TerminalPerson", lambda: TerminalPerson(source))
        done = CliRunner().invoke(build("arm"), ["arm", "jog"])
    os.close(write)
    assert done.exit_code == 69
    assert "no data from an arm within 0.2 s" in done.stderr


def test_beside_another_speaker_it_does_not_begin(folder):
    with Bus("synthesizer", BusSettings(folder=folder), (), (topics.ARM_TRAJECTORY,)):
        done = CliRunner().invoke(build("arm"), ["arm", "jog"])
    assert done.exit_code == 75
    assert "synthesizer" in done.stderr
    assert "paramove node stop" in done.stderr


def test_in_a_narrow_terminal_the_line_is_written_anew_and_ended(folder, monkeypatch):
    monkeypatch.setattr("paramove.cli.arm.jog.sys", SimpleNamespace(stdout=SimpleNamespace(isatty=lambda: True)))
    narrow = SimpleNamespace(get_terminal_size=lambda: os.terminal_size((20, 2)))
    monkeypatch.setattr("paramove.cli.arm.jog.shutil", narrow)  # and not that of pytest, which asks for the width too
    with running(folder, ["1+", "q"]) as arm:
        done = jogged(monkeypatch, arm, "a")
    shown = [piece for piece in done.stdout.split("\r")[1:] if not piece.endswith("\n")]
    assert shown
    assert all(len(piece) < 20 for piece in shown)
    assert done.stdout.endswith("\n")
