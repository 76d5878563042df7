"""An application outside the clone, with messages and topics of its own: written, run, repeated, shown, recorded."""

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from paramove.bus import topics
from paramove.recording import read
from tests.hosts.conftest import free_ports
from tests.supervision.conftest import until
from tests.supervision.test_two_hosts import STAND_IN

BIN = Path(sys.executable).parent
PARAMOVE = BIN / "paramove"


@pytest.fixture
def folder(tmp_path, short_folder, monkeypatch):
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(short_folder))
    monkeypatch.setenv("PATH", f"{BIN}{os.pathsep}{os.environ['PATH']}")
    assert paramove(tmp_path, "new", "my_robot").returncode == 0
    monkeypatch.setattr(topics, "_own_by_folder", {})
    monkeypatch.chdir(tmp_path / "my_robot")
    return tmp_path / "my_robot"


@pytest.fixture(params=["clone", pytest.param("wheel", marks=pytest.mark.long)])
def command(request, tmp_path):
    """The command of the clone, or that of its wheel, installed elsewhere."""
    if request.param == "clone":
        return PARAMOVE
    installed = request.getfixturevalue("installed")
    script = tmp_path / "paramove"
    script.write_text(f'#!/bin/sh\nPYTHONPATH="{installed}" exec {sys.executable} -m paramove.cli.main "$@"\n')
    script.chmod(0o755)
    return script


def paramove(folder, *words, command=PARAMOVE):
    return subprocess.run([command, *words], cwd=folder, capture_output=True, text=True, timeout=180, check=False)


def test_a_new_application_runs_the_same_every_time_and_is_recorded(folder):
    recordings = []
    for name in ("first", "second"):
        run = paramove(folder, "launch", "my_robot", "--runs", name)
        assert run.returncode == 0, run.stdout + run.stderr
        assert "The cart is at" in run.stdout
        recordings.append(folder / name / "latest" / "recording.mcap")
    first, second = (list(until_the_arrival(recording)) for recording in recordings)
    assert {topic for topic, _, _ in first} == {"cart/state", "cart/command", "speech"}
    assert first == second


@pytest.fixture
def two_hosts(folder, command, tmp_path, short_folder, monkeypatch):
    """A second host, which this one trusts; with the overlay `two_hosts` the driver runs there."""
    there = tmp_path / "there" / "my_robot"
    (folder / "launch" / "overlays" / "two_hosts.yaml").parent.mkdir(exist_ok=True)
    (folder / "launch" / "overlays" / "two_hosts.yaml").write_text(
        "hosts:\n"
        f"  here: {{address: 127.0.0.1, port: {free_ports()}}}\n"
        f"  there: {{ssh: other, address: 127.0.0.1, port: {free_ports()}, folder: {there}, command: {command}}}\n"
        "nodes: {driver: {host: there}}\n"
    )
    shutil.copytree(folder, there)
    (short_folder / "there").mkdir(mode=0o700)
    elsewhere = {"XDG_RUNTIME_DIR": str(short_folder / "there"), "XDG_CONFIG_HOME": str(tmp_path / "config_there")}
    (tmp_path / "environment.json").write_text(json.dumps(elsewhere))
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path / "config_here"))
    monkeypatch.setenv("PARAMOVE_SSH", f"{sys.executable} {STAND_IN} {tmp_path / 'environment.json'}")
    trust = ("host", "trust", "other", "--folder", str(there), "--command", str(command))
    trusted = paramove(folder, *trust, command=command)
    assert trusted.returncode == 0, trusted.stderr


@pytest.mark.usefixtures("two_hosts")
def test_on_two_hosts_it_runs_as_on_one(folder, command):
    recordings = []
    for name, words in (("one", ()), ("two", ("--with", "two_hosts"))):
        run = paramove(folder, "launch", "my_robot", "--runs", name, *words, command=command)
        assert run.returncode == 0, run.stdout + run.stderr
        recordings.append(list(until_the_arrival(folder / name / "latest" / "recording.mcap")))
    assert recordings[0] == recordings[1]


@pytest.mark.long
@pytest.mark.usefixtures("two_hosts")
@pytest.mark.parametrize("command", ["clone"], indirect=True)
def test_a_parameter_of_a_node_on_the_other_host_can_be_changed(folder, monkeypatch):
    change_in_lockstep(folder, monkeypatch, "--with", "two_hosts")


def until_the_arrival(recording):
    """Topic, time and bytes of the messages; how long the world lasts afterwards is for the launcher's clock to say."""
    for one in read(recording, ["cart/state", "cart/command", "speech"]):
        yield one.topic, one.log_ns, one.message.SerializeToString(deterministic=True)
        if one.topic == "speech":
            return


def test_its_own_tests_pass(folder):
    done = subprocess.run(
        [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider"],
        cwd=folder,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stdout


def test_its_topics_are_shown_with_the_others(folder):
    graph = paramove(folder, "graph", "my_robot")
    assert "cart/command 15 Hz  -> world" in graph.stdout
    (folder / "msgs" / "topics.yaml").write_text("topics: {cart/state: {type: my_robot.CartSate}}\n")
    check = paramove(folder, "launch", "my_robot", "--check")
    assert check.returncode == 78
    assert "msgs/topics.yaml:1:23: there is no message 'my_robot.CartSate'; did you mean 'my_robot.CartState'?" in (
        check.stdout + check.stderr
    )


def test_for_a_node_that_names_no_topic_the_nearest_is_named(folder):
    node = folder / "nodes" / "cart_driver.py"
    node.write_text(node.read_text().replace("(topics.CART_STATE,)", "(topics.CART_STAT,)"))
    check = paramove(folder, "launch", "my_robot", "--check")
    assert check.returncode == 78
    assert "did you mean 'CART_STATE'?" in check.stdout + check.stderr


def test_a_topic_that_only_a_node_knows_is_reported_before_the_start(folder):
    node = folder / "nodes" / "cart_driver.py"
    text = node.read_text().replace(
        "SUBSCRIBES = (topics.CART_STATE,)",
        "from dataclasses import replace\n\nOTHER = replace(topics.CART_STATE, name='cart/other')\n"
        "SUBSCRIBES = (topics.CART_STATE, OTHER)",
    )
    node.write_text(text)
    check = paramove(folder, "launch", "my_robot", "--check")
    answer = check.stdout + check.stderr
    assert check.returncode == 78
    assert "no topic 'cart/other'" in answer
    assert "msgs/topics.yaml" in answer
    assert "Traceback" not in answer


def test_the_bus_shows_a_running_application(folder):
    launch = subprocess.Popen(
        [PARAMOVE, "launch", "my_robot", "--set", "driver.stiffness=1e-9", "--set", "world.ends_after_s=1e7"],
        cwd=folder,
        stdout=subprocess.PIPE,
        text=True,
    )
    try:
        assert launch.stdout is not None
        for line in launch.stdout:
            if "recording to" in line:
                break
        echo = paramove(folder, "topic", "echo", "cart/state", "--count", "1", "--json")
        assert echo.returncode == 0, echo.stderr
        assert "position_m" in json.loads(echo.stdout)["message"]
        rows = json.loads(paramove(folder, "topic", "list", "--json").stdout)
        (row,) = [row for row in rows if row["topic"] == "cart/state"]
        assert row["type"] == "my_robot.CartState"
        assert "(world)" in row["publisher"]
    finally:
        launch.terminate()
        launch.communicate()


def test_a_parameter_that_is_changed_in_lockstep_lands_at_its_recorded_time(folder, monkeypatch):
    change_in_lockstep(folder, monkeypatch)


def change_in_lockstep(folder, monkeypatch, *options):
    """A cart that is hardly pulled is pulled from the recorded time on, and arrives."""
    monkeypatch.setenv("PARAMOVE_DOMAIN", "default")
    settings = ("--set", "driver.stiffness=1e-9", "--set", "world.ends_after_s=1e7", *options)
    launched = subprocess.Popen([PARAMOVE, "launch", "my_robot", *settings], cwd=folder, stdout=subprocess.DEVNULL)
    try:
        shown = ("topic", "echo", "cart/state", "--once", "--seconds", "1")
        until(lambda: paramove(folder, *shown).returncode == 0, "the cart stands there")
        done = paramove(folder, "param", "set", "driver", "stiffness", "4.0", "--wait", "30")
        assert done.returncode == 0, done.stderr
        assert launched.wait(60) == 0  # the cart has arrived
    finally:
        launched.terminate()
        launched.wait(30)
    requests, commands = [], []
    for one in read(folder / "runs" / "latest" / "recording.mcap", ["parameters/set", "cart/command"]):
        if one.topic == "cart/command":
            commands.append((one.publish_ns, one.message.acceleration_m_s2))
        else:
            requests.append(one.message)
    lands_ns = requests[-1].at.ToNanoseconds()  # earlier ones were late
    assert all(abs(pull) < 1e-6 for now_ns, pull in commands if now_ns < lands_ns)
    assert next(pull for now_ns, pull in commands if now_ns >= lands_ns) > 1.0
