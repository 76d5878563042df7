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


@pytest.fixture
def launch(tmp_path):
    def made(nodes=CAMERA, *overlays, text=OVERLAY):
        file = tmp_path / "two.yaml"
        file.write_text(text.format(nodes=nodes))
        return load(Workspace.here(), "rule_learning", [*(overlays or ("sim",)), str(file)], robot="koch_v1_1")

    return made


def test_exactly_what_the_other_host_needs_crosses(launch):
    its = launch()
    assert crossing(its, application.check(its, Workspace.here())) == {
        ("robot_pc", "camera_pc"): {name: name for name in ("camera/image_raw", "clock")},
        ("camera_pc", "robot_pc"): {
            name: name for name in ("camera/image", "objects/tracked", "status/camera", "status/colour_tracker")
        },
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


@pytest.mark.parametrize(
    ("nodes", "overlays", "text", "words"),
    [
        ("camera: {host: camerapc}", (), OVERLAY, "camera_pc"),
        (CAMERA, ("sim", "wall_clock"), OVERLAY, "lockstep"),
        (CAMERA, ("sim",), OVERLAY.replace("ssh: lab-cam, ", ""), "one host without `ssh`"),
        ("judge: {host: camera_pc}", ("sim",), OVERLAY, "truth/"),
    ],
)
def test_what_cannot_be_distributed_is_rejected(launch, nodes, overlays, text, words):
    its = launch(nodes, *overlays, text=text)
    with pytest.raises(DocumentError, match=words):
        application.check(its, Workspace.here())


def test_a_host_without_nodes_gets_no_relay(launch, tmp_path):
    keys = HostKeys(tmp_path / "keys")
    keys.trust("lab-cam", "k" * 40)
    its = launch("")
    nodes = distributed(its, application.check(its, Workspace.here()), keys).file.nodes
    assert not [name for name in nodes if name.startswith("relay")]


def test_a_robot_and_its_driver_need_one_host(tmp_path):
    file = tmp_path / "two.yaml"
    file.write_text(OVERLAY.format(nodes="arm_driver: {host: camera_pc}"))
    its = load(Workspace.here(), "rule_learning", ["sim", str(file)])
    with pytest.raises(DocumentError, match="wire/hoap3"):
        application.check(its, Workspace.here())
