"""Applications on two hosts, which are two network namespaces with clocks of their own."""

from __future__ import annotations

import contextlib
import json
import logging
import os
import random
import signal
import subprocess
import sys
import threading
import time
from collections import defaultdict
from pathlib import Path

import numpy as np
import pytest

from benchmarks.namespaces import CLOCK_AHEAD_S, HERE, THERE, Namespaces
from paramove.documents import exit_codes
from paramove.recording.reader import read
from paramove.supervision import load
from paramove.workspace import Workspace
from studies.faults.kill_cases import SIGNALS, Expected, expected_of
from studies.faults.leftovers import left_over
from tests.docs.terminal import at_terminal

pytestmark = pytest.mark.long
ROOT = Path(__file__).parents[2]
PARAMOVE = f"{sys.executable} -m paramove.cli.main"
CAMERA_AWAY = f"""
hosts:
  robot_pc: {{address: {HERE}}}
  camera_pc: {{ssh: other, address: {THERE}, folder: {ROOT}, command: {PARAMOVE}}}
nodes:
  camera: {{host: camera_pc}}
  colour_tracker: {{host: camera_pc}}
"""
ARM_AWAY = f"""
hosts:
  desk_pc: {{address: {HERE}}}
  robot_pc: {{ssh: other, address: {THERE}, folder: {ROOT}, command: {PARAMOVE}}}
after_run: null
nodes:
  arm_driver: {{host: robot_pc}}
  dynamixel_emulator: {{host: robot_pc}}
  judge: null
"""
GOES_ON = "  reacher: {required: false}\n"
"""The run goes on when the arm has stopped, and with it the task."""
_log = logging.getLogger(__name__)
STOP_LIMIT_S = 0.1
STILL = np.deg2rad(0.2)
LONGEST_WAIT_S = 18.0
"""Since the arm was armed: it moves most of that time."""


@pytest.fixture
def hosts(launcher, tmp_path):
    """Two hosts; `launcher` starts on the first one, which the second trusts."""
    with contextlib.ExitStack() as opened:
        try:
            hosts = opened.enter_context(Namespaces())
        except OSError as error:
            pytest.skip(str(error))
        runtime = Path(launcher.environment["XDG_RUNTIME_DIR"], "there")
        domain = f"two-{os.getpid()}"
        launcher.environment |= {"XDG_CONFIG_HOME": str(tmp_path / "config_here"), "PARAMOVE_DOMAIN": domain}
        launcher.environment |= hosts.ssh(tmp_path, runtime, tmp_path / "config_there")
        trust = [*PARAMOVE.split(), "host", "trust", "other", "--folder", str(ROOT), "--command", PARAMOVE]
        assert subprocess.run(trust, cwd=ROOT, env=launcher.environment, check=False).returncode == 0
        launcher.within = hosts.within
        yield hosts
        runtimes = (Path(launcher.environment["XDG_RUNTIME_DIR"], *there, "paramove") for there in ((), ("there",)))
        assert [what for folder in runtimes for what in left_over(domain, folder)] == []


def overlay(folder, text):
    path = folder / "two_hosts.yaml"
    path.write_text(text)
    return str(path)


def content(recording):
    """Of each recorded topic but the status, all messages up to the robot's last sentence."""
    messages, end_ns = defaultdict(list), 0
    for one in read(recording):
        if one.topic == "speech":
            end_ns = one.publish_ns
        if not one.topic.startswith("status/"):
            messages[one.topic].append(
                (one.publish_ns, one.sequence, one.message.SerializeToString(deterministic=True))
            )
    return {topic: [one for one in some if one[0] <= end_ns] for topic, some in messages.items()}


@pytest.mark.parametrize("seed", range(5))
def test_a_seed_is_the_same_run_on_one_host_and_on_two(launcher, hosts, tmp_path, seed):
    options = ("rule_learning", "--robot", "koch_v1_1", "--seed", str(seed), "--headless", "--with", "sim")
    recordings = []
    for words in (("--with", overlay(tmp_path, CAMERA_AWAY)), ()):
        code, shown = launcher.run(*options, *words, timeout_s=1500)
        assert code == 0, shown
        recordings.append(content(launcher.latest / "recording.mcap"))
        if words:
            log = (launcher.latest / "logs" / "relay_robot_pc.log").read_text()
            assert "camera_pc: replies within" in log
    two, one = recordings
    assert {topic: len(some) for topic, some in two.items()} == {topic: len(some) for topic, some in one.items()}
    assert two == one


@pytest.mark.parametrize("seed", range(5))
def test_rules_are_learned_in_real_time_over_a_slow_and_lossy_link(launcher, hosts, tmp_path, seed):
    hosts.link(delay_s=0.005, jitter_s=0.002, loss=0.005)
    options = ("rule_learning", "--robot", "koch_v1_1", "--seed", str(seed), "--headless", "--with", "sim")
    code, shown = launcher.run(
        *options, "--with", "wall_clock", "--with", overlay(tmp_path, CAMERA_AWAY), timeout_s=900
    )
    assert code == 0, shown
    latest = {}
    for one in read(launcher.latest / "recording.mcap"):
        if one.topic.startswith("status/"):
            latest[one.topic] = one.message
    counts = {(topic, one.topic): (one.lost, one.rejected) for topic, its in latest.items() for one in its.received}
    assert {what: (lost, rejected) for what, (lost, rejected) in counts.items() if lost or rejected} == {}
    assert ("status/rule_learner", "gestures") in counts


TUTORIAL = ROOT / "docs" / "tutorials" / "two_computers.md"


def test_the_commands_of_the_tutorial(launcher, hosts):
    """But those with a real arm; each as it is typed, with the names of the computers that it has."""
    environment = launcher.environment | {"PATH": f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"}
    lines = [line for line in TUTORIAL.read_text().splitlines() if line.startswith("paramove ") and "real" not in line]
    assert [line.split()[1:3] for line in lines] == [
        ["host", "trust"],
        ["host", "check"],
        ["launch", "rule_learning"],
        ["launch", "dynamixel_arm"],
    ]
    trust = lines[0].replace("camera-pc", "robot-pc")  # as the text requests
    for line in (*lines[:2], trust, *(f"{line} --headless --runs {launcher.folder}" for line in lines[2:])):
        typed = [*hosts.within, *line.split()]
        done = subprocess.run(typed, cwd=ROOT, env=environment, capture_output=True, text=True, check=False)
        assert done.returncode == 0, f"{line}\n{done.stdout}{done.stderr}"


class ArmWatch:
    """What the arm's driver publishes on the other host: states of the gate, and joints, by this host's clock."""

    def __init__(self, hosts, launcher):
        folder = Path(
            launcher.environment["XDG_RUNTIME_DIR"], "there", "paramove", launcher.environment["PARAMOVE_DOMAIN"]
        )
        program = [*hosts.within_there, sys.executable, str(Path(__file__).parent / "arm_watch.py"), str(folder)]
        self._process = subprocess.Popen(program, cwd=ROOT, stdout=subprocess.PIPE, text=True)
        self.gate, self.joints = [], []
        self._thread = threading.Thread(target=self._read)
        self._thread.start()

    def _read(self):
        for line in self._process.stdout:
            time_s, *rest = json.loads(line)
            (self.gate if len(rest) == 2 else self.joints).append((time_s - CLOCK_AHEAD_S, *rest))

    def until(self, condition, seconds=60.0):
        end_s = time.monotonic() + seconds
        while not condition():
            assert time.monotonic() < end_s, f"not in time; the gate: {self.gate[-1:]}"
            threading.Event().wait(0.01)

    def close(self):
        self._process.kill()
        self._process.wait()
        self._thread.join()
        self._process.stdout.close()


@pytest.fixture
def arm_watch(hosts, launcher):
    watch = ArmWatch(hosts, launcher)
    yield watch
    watch.close()


@pytest.mark.parametrize("seed", range(20))
def test_a_cut_link_stops_the_arm_and_nothing_moves_when_it_is_back(launcher, hosts, arm_watch, tmp_path, seed):
    draw = random.Random(seed)
    started = launcher.start(
        "dynamixel_arm", "--headless", "--with", "emulated", "--with", overlay(tmp_path, ARM_AWAY + GOES_ON)
    )
    arm_watch.until(lambda: arm_watch.gate and arm_watch.gate[-1][1] == "STATE_ARMED")
    armed_s = time.monotonic()
    wait_s = draw.uniform(0.5, LONGEST_WAIT_S)
    arm_watch.until(lambda: time.monotonic() > armed_s + wait_s and arm_watch.gate[-1][1] == "STATE_ARMED")
    cut_s = time.monotonic()
    hosts.link(loss=1.0)
    arm_watch.until(lambda: arm_watch.gate[-1][1] == "STATE_HOLD")
    stop = next(one for one in arm_watch.gate if one[0] > cut_s and one[1] != "STATE_ARMED")
    _log.info("cut %.1f s after arming: stop begun %.0f ms later", wait_s, 1e3 * (stop[0] - cut_s))
    assert stop[0] - cut_s <= STOP_LIMIT_S
    assert any("no reply from desk_pc" in fault for fault in stop[2])
    listed = subprocess.run(
        [*hosts.within_there, *PARAMOVE.split(), "node", "list"],
        env=launcher.environment | {"XDG_RUNTIME_DIR": launcher.environment["XDG_RUNTIME_DIR"] + "/there"},
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=False,
    ).stdout
    assert "hold" in listed
    hosts.link()
    restored_s = time.monotonic()
    arm_watch.until(lambda: time.monotonic() > restored_s + 2.0)
    moved = np.array([positions for time_s, positions in arm_watch.joints if time_s > stop[0] + 0.5])
    assert len(moved) > 50
    assert np.ptp(moved[:, :-1], axis=0).max() < STILL
    fingers = moved[:, -1]  # they lag behind their last goal, and close on what lies between them
    assert np.ptp(fingers[len(fingers) // 2 :]) < STILL
    armed = at_terminal(f"{' '.join(hosts.within)} {PARAMOVE} arm enable --yes", "", launcher.environment)
    assert armed[0] == 0, armed
    arm_watch.until(lambda: arm_watch.gate[-1][1] == "STATE_ARMED")
    started.send_signal(signal.SIGINT)
    shown = started.communicate(timeout=60)[0]
    assert started.returncode == 130, shown
    assert "no longer armed" in shown
    assert "no reply from desk_pc" in shown


def test_a_person_stops_the_arm_from_the_other_host(launcher, hosts, arm_watch, tmp_path):
    started = launcher.start(
        "dynamixel_arm", "--headless", "--with", "emulated", "--with", overlay(tmp_path, ARM_AWAY + GOES_ON)
    )
    arm_watch.until(lambda: arm_watch.gate and arm_watch.gate[-1][1] == "STATE_ARMED")
    code, shown = at_terminal(f"{' '.join(hosts.within)} {PARAMOVE} arm estop", "", launcher.environment)
    assert code == 0, shown
    assert arm_watch.gate[-1][1] in ("STATE_STOPPING", "STATE_HOLD")
    assert any("by a person" in fault for fault in arm_watch.gate[-1][2])
    started.send_signal(signal.SIGINT)
    shown = started.communicate(timeout=60)[0]
    assert started.returncode == 130, shown


NODES = load(Workspace.at(ROOT), "dynamixel_arm", ["emulated"]).file
VICTIMS = (*(name for name in NODES.nodes if name != "judge"), "relay_desk_pc", "relay_robot_pc", "agent", "launcher")
MOMENTS = {"starts": None, "moves": 1.5, "carries": 14.0}
"""Seconds since the arm was armed; at the start the victim has just been started."""


def must_follow(victim, number):
    """As on one host; a relay is restarted, and an agent's end is that of the run."""
    if victim.startswith("relay"):
        return Expected.GOES_ON
    return Expected.ENDS if victim == "agent" else expected_of(victim, number, NODES)


class Happened:
    """Events of a launcher."""

    def __init__(self, launcher):
        self._launcher = launcher

    def of(self, node, *kinds):
        file = self._launcher.latest / "events.jsonl"
        events = [json.loads(line) for line in file.read_text().splitlines()] if file.exists() else []
        return [event for event in events if event.get("node") == node and event["event"] in kinds]


@pytest.mark.parametrize("moment", MOMENTS)
@pytest.mark.parametrize("number", SIGNALS)
@pytest.mark.parametrize("victim", VICTIMS)
def test_a_killed_or_stopped_process_on_either_host(launcher, hosts, arm_watch, tmp_path, victim, number, moment):
    file = overlay(tmp_path, ARM_AWAY + (GOES_ON if victim.startswith("relay") else ""))
    started = launcher.start("dynamixel_arm", "--headless", "--with", "emulated", "--with", file)
    happened = Happened(launcher)
    seen = victim if victim in NODES.nodes or victim.startswith("relay") else "recorder"
    arm_watch.until(lambda: happened.of(seen, "started"))
    if MOMENTS[moment] is not None:
        arm_watch.until(lambda: arm_watch.gate and arm_watch.gate[-1][1] == "STATE_ARMED")
        due_s = time.monotonic() + MOMENTS[moment]
        arm_watch.until(lambda: time.monotonic() > due_s)
    pids = {"launcher": lambda: started.pid, "agent": hosts.agent}
    pid = pids.get(victim, lambda: happened.of(victim, "started")[-1]["pid"])()
    begun_s = time.monotonic()
    os.kill(pid, SIGNALS[number])
    expected = must_follow(victim, number)
    if expected is Expected.UNHARMED:
        arm_watch.until(lambda: time.monotonic() > begun_s + 1.5)
        os.kill(pid, signal.SIGCONT)
    elif expected is Expected.GOES_ON:
        arm_watch.until(lambda: len(happened.of(victim, "started")) > 1)
        again_s = 1e-9 * happened.of(victim, "started")[-1]["monotonic_ns"]
        arm_watch.until(lambda: any(1e-9 * event["monotonic_ns"] > again_s for event in happened.of(victim, "ready")))
    if expected in (Expected.UNHARMED, Expected.GOES_ON):
        arm_watch.until(lambda: time.monotonic() > begun_s + 4.0)
        assert started.poll() is None, started.stdout.read()
        started.send_signal(signal.SIGINT)
    shown = started.communicate(timeout=40)[0]
    if expected in (Expected.ENDS, Expected.ENDS_BACK):
        assert started.returncode == exit_codes.FAILURE, shown
        assert ("robot_pc" if victim == "agent" else victim) in shown.splitlines()[-1]
    if (victim, number) == ("agent", "STOP"):
        stopped = not arm_watch.gate or arm_watch.gate[-1][1] in ("STATE_HOLD", "STATE_DISARMED")
        os.kill(pid, signal.SIGCONT)  # a stopped one cannot end its nodes, but the arm has stopped
        assert stopped
    if victim.startswith("relay") and moment != "starts":
        stop = next(one for one in arm_watch.gate if one[0] > begun_s and one[1] != "STATE_ARMED")
        assert stop[0] - begun_s <= STOP_LIMIT_S
    arm_watch.close()  # it runs there, too
    arm_watch.until(lambda: not hosts.processes())
