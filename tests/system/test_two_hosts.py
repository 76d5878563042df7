"""Rule learning on two hosts, which are two network namespaces joined by a cable: the same run as on one."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections import defaultdict
from pathlib import Path

import pytest

from paramove.recording.reader import read

pytestmark = pytest.mark.long
ROOT = Path(__file__).parents[2]
STAND_IN = ROOT / "tests" / "supervision" / "ssh_stand_in.py"
HERE, THERE = "10.99.0.1", "10.99.0.2"
OVERLAY = """
hosts:
  robot_pc: {{address: {here}}}
  camera_pc: {{ssh: camera-pc, address: {there}, folder: {root}, command: {python} -m paramove.cli.main}}
nodes:
  camera: {{host: camera_pc}}
  colour_tracker: {{host: camera_pc}}
"""


def ip(*words):
    return subprocess.run(["ip", *words], capture_output=True, text=True, check=False)


@pytest.fixture
def namespaces():
    """Names of two network namespaces that reach each other at `HERE` and `THERE`, and nothing else."""
    names = [f"paramove_{side}_{os.getpid()}" for side in ("here", "there")]
    if ip("netns", "add", names[0]).returncode:
        pytest.skip("network namespaces need root")
    try:
        ip("netns", "add", names[1])
        ip("link", "add", "pm_here", "netns", names[0], "type", "veth", "peer", "name", "pm_there", "netns", names[1])
        for name, device, address in zip(names, ("pm_here", "pm_there"), (HERE, THERE), strict=True):
            ip("-n", name, "addr", "add", f"{address}/24", "dev", device)
            for one in (device, "lo"):
                assert ip("-n", name, "link", "set", one, "up").returncode == 0
        yield names
    finally:
        for name in names:
            ip("netns", "del", name)


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


def test_a_seed_is_the_same_run_on_one_host_and_on_two(launcher, namespaces, tmp_path):
    here, there = namespaces
    runtime = launcher.environment["XDG_RUNTIME_DIR"]
    (tmp_path / "environment.json").write_text(
        json.dumps({"XDG_RUNTIME_DIR": f"{runtime}/there", "XDG_CONFIG_HOME": str(tmp_path / "config_there")})
    )
    Path(runtime, "there").mkdir(mode=0o700)
    launcher.environment |= {
        "XDG_CONFIG_HOME": str(tmp_path / "config_here"),
        "PARAMOVE_SSH": f"ip netns exec {there} {sys.executable} {STAND_IN} {tmp_path / 'environment.json'}",
    }
    command = f"{sys.executable} -m paramove.cli.main"
    trusted = [*command.split(), "host", "trust", "camera-pc", "--folder", str(ROOT), "--command", command]
    assert subprocess.run(trusted, cwd=ROOT, env=launcher.environment, check=False).returncode == 0
    overlay = tmp_path / "two_hosts.yaml"
    overlay.write_text(OVERLAY.format(here=HERE, there=THERE, root=ROOT, python=sys.executable))
    options = ("rule_learning", "--robot", "koch_v1_1", "--seed", "1", "--headless", "--with", "sim")
    recordings = []
    for words in (("--with", str(overlay)), ()):
        launcher.within = ("ip", "netns", "exec", here) if words else ()
        code, shown = launcher.run(*options, *words, timeout_s=1500)
        assert code == 0, shown
        recordings.append(content(launcher.latest / "recording.mcap"))
        if words:
            log = (launcher.latest / "logs" / "relay_robot_pc.log").read_text()
            assert "camera_pc: replies within" in log
            assert ip("netns", "pids", there).stdout == "", "a process is left"
    two, one = recordings
    assert {topic: len(some) for topic, some in two.items()} == {topic: len(some) for topic, some in one.items()}
    assert two == one
