"""What crosses between the hosts of a launch file, and what must not."""

from __future__ import annotations

import pytest

from paramove.documents import DocumentError, InputError
from paramove.hosts import HostKeys
from paramove.supervision import application, load
from paramove.supervision.distribution import crossing, distributed
from paramove.workspace import Workspace

OVERLAY = """
hosts:
  robot_pc: {{address: 10.0.0.1}}
  camera_pc: {{ssh: lab-cam, address: 10.0.0.2, port: 50000}}
nodes: {{{nodes}}}
"""
CAMERA = "camera: {host: camera_pc}, colour_tracker: {host: camera_pc}"


CHANGES = "parameters/set"


@pytest.fixture
def launch(tmp_path):
    def made(nodes=CAMERA, *overlays, text=OVERLAY):
        file = tmp_path / "two.yaml"
        file.write_text(text.format(nodes=nodes))
        return load(Workspace.here(), "rule_learning", [*(overlays or ("sim",)), str(file)], robot="koch_v1_1")

    return made


def test_exactly_what_the_other_host_needs_crosses(launch):
    its = launch()
    perceived = ("camera/image", "objects/tracked", "status/camera", "status/colour_tracker")
    stops = ("operator/stop", "operator/estop")
    assert crossing(its, application.check(its, Workspace.here())) == {
        ("robot_pc", "camera_pc"): {name: name for name in ("camera/image_raw", "clock", "arm/safety", CHANGES)},
        ("camera_pc", "robot_pc"): {name: name for name in (*perceived, *stops)},
    }


def test_each_host_gets_a_relay_that_knows_the_other_by_its_pinned_key(launch, tmp_path):
    keys = HostKeys(tmp_path / "keys")
    its = launch()
    interfaces = application.check(its, Workspace.here())
    with pytest.raises(InputError, match="paramove host trust lab-cam"):
        distributed(its, interfaces, keys)
    keys.trust("lab-cam", "k" * 40)
    nodes = distributed(its, interfaces, keys).file.nodes
    robot, camera = nodes["relay_robot_pc"], nodes["relay_camera_pc"]
    assert (robot.host, camera.host, nodes["camera"].host, nodes["simulator"].host) == (
        None,
        "camera_pc",
        "camera_pc",
        None,
    )
    assert (camera.parameters["address"], camera.parameters["port"]) == ("10.0.0.2", 50000)
    assert camera.parameters["clock_from"] == "robot_pc"
    assert "clock_from" not in robot.parameters
    there, here = robot.parameters["peers"]["camera_pc"], camera.parameters["peers"]["robot_pc"]
    assert (there["key"], here["key"]) == ("k" * 40, keys.own().public)
    assert here["wants"] == there["gives"]
    assert here["gives"] == there["wants"]
    assert "status/relay_camera_pc" in there["gives"]
    assert here["outside"] == ["parameters/set"], "what nodes publish is published there when it comes"
    assert there["outside"] == ["operator/estop", "operator/stop"]


@pytest.mark.parametrize(
    ("nodes", "overlays", "text", "words"),
    [
        ("camera: {host: camerapc}", (), OVERLAY, "camera_pc"),
        (CAMERA, ("sim",), "bus: {{lockstep: false}}" + OVERLAY, "lockstep"),
        (CAMERA, ("sim",), OVERLAY.replace("ssh: lab-cam, ", ""), "one host without `ssh`"),
        ("judge: {host: camera_pc}", ("sim",), OVERLAY, "truth/"),
    ],
)
def test_what_cannot_be_distributed_is_rejected(launch, nodes, overlays, text, words):
    its = launch(nodes, *overlays, text=text)
    with pytest.raises(DocumentError, match=words):
        application.check(its, Workspace.here())


def test_from_a_host_without_nodes_a_person_can_stop_the_arm(launch, tmp_path):
    keys = HostKeys(tmp_path / "keys")
    keys.trust("lab-cam", "k" * 40)
    its = launch("")
    peers = distributed(its, application.check(its, Workspace.here()), keys).file.nodes["relay_robot_pc"].parameters
    assert {*peers["peers"]["camera_pc"]["gives"]} == {"operator/stop", "operator/estop", "status/relay_camera_pc"}
    assert {*peers["peers"]["camera_pc"]["wants"]} == {"arm/safety"}


ARM_AWAY = """
hosts:
  desk_pc: {{address: 10.0.0.1}}
  robot_pc: {{ssh: arm, address: 10.0.0.2}}
  wall_pc: {{ssh: wall, address: 10.0.0.3, may_arm: {may_arm}}}
after_run: null
nodes: {{arm_driver: {{host: robot_pc}}, dynamixel_emulator: {{host: robot_pc}}, judge: null}}
"""


@pytest.mark.parametrize("may_arm", [True, False])
def test_who_may_arm_may_move_and_may_stop_an_arm_on_another_host(tmp_path, may_arm):
    """All of them stop it; the launcher's arms it, and another one that may; only the synthesizer's host moves it."""
    keys, file = HostKeys(tmp_path / "keys"), tmp_path / "two.yaml"
    for number, name in enumerate(("arm", "wall")):
        keys.trust(name, str(number) * 40)
    file.write_text(ARM_AWAY.format(may_arm=str(may_arm).lower()))
    its = load(Workspace.here(), "dynamixel_arm", ["emulated", str(file)])
    nodes = distributed(its, application.check(its, Workspace.here()), keys).file.nodes
    peers = nodes["relay_robot_pc"].parameters["peers"]
    desk, wall = {*peers["desk_pc"]["gives"]}, {*peers["wall_pc"]["gives"]}
    assert desk == {
        "arm/trajectory", "operator/arm", "operator/arm_at_start", "operator/stop", "operator/estop", CHANGES
    }  # fmt: skip
    assert wall == {"operator/stop", "operator/estop", *(["operator/arm"] if may_arm else [])}
    assert "arm/safety" in peers["wall_pc"]["wants"]
    assert (peers["desk_pc"]["commands"], peers["wall_pc"]["commands"]) == (True, may_arm)
    assert 0.0 < nodes["arm_driver"].parameters["link_timeout_s"] <= 0.1
    assert "link_timeout_s" not in nodes["synthesizer"].parameters
    assert nodes["relay_desk_pc"].restart == "on-failure"


def test_a_robot_and_its_driver_need_one_host(tmp_path):
    file = tmp_path / "two.yaml"
    file.write_text(OVERLAY.format(nodes="arm_driver: {host: camera_pc}"))
    its = load(Workspace.here(), "rule_learning", ["sim", str(file)])
    with pytest.raises(DocumentError, match="wire/hoap3"):
        application.check(its, Workspace.here())


TWO_ARMS = """
hosts:
  desk_pc: {address: 10.0.0.1}
  robot_pc: {ssh: arm, address: 10.0.0.2}
include: {left: {without: [recorder, judge]}}
nodes: {left_arm_driver: {host: robot_pc}, left_dynamixel_emulator: {host: robot_pc}}
"""


def test_one_of_two_arms_may_be_on_another_host(tmp_path):
    keys, file = HostKeys(tmp_path / "keys"), tmp_path / "two.yaml"
    keys.trust("arm", "1" * 40)
    file.write_text(TWO_ARMS)
    its = load(Workspace.here(), "two_arms", [str(file)])
    nodes = distributed(its, application.check(its, Workspace.here()), keys).file.nodes
    gives = nodes["relay_robot_pc"].parameters["peers"]["desk_pc"]["gives"]
    assert {name: gives[name] for name in ("left/arm/trajectory", "left/operator/arm", "operator/stop")} == {
        "left/arm/trajectory": "arm/trajectory",
        "left/operator/arm": "operator/arm",
        "operator/stop": "operator/stop",
    }
    assert [name for name in gives if name.startswith("right/")] == ["right/arm/safety"], "which crosses to every host"
    wants = nodes["relay_robot_pc"].parameters["peers"]["desk_pc"]["wants"]
    assert "left/arm/safety" in wants
    assert 0.0 < nodes["left_arm_driver"].parameters["link_timeout_s"] <= 0.1
    assert "link_timeout_s" not in nodes["right_arm_driver"].parameters
