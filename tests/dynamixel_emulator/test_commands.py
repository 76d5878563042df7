"""The command line, used without paramove."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
from dynamixel_sdk import COMM_SUCCESS, PacketHandler, PortHandler

from dynamixel_emulator.arms import ARMS
from dynamixel_emulator.commands import MISSING, STOPPED, UNUSABLE, control_of, main

COMMAND = [sys.executable, "-m", "dynamixel_emulator"]
TORQUE_ENABLE, GOAL_POSITION = 64, 116


@contextmanager
def emulator(*arguments: str, stop_signal: int = signal.SIGINT) -> Iterator[None]:
    with subprocess.Popen([*COMMAND, *arguments], stdout=subprocess.PIPE, text=True) as running:
        assert running.stdout is not None
        assert "Ctrl-C" in running.stdout.readline()
        yield
        running.send_signal(stop_signal)
        assert running.wait(20) == 0


def run(*arguments: str) -> str:
    done = subprocess.run([*COMMAND, *arguments], capture_output=True, text=True, check=False, timeout=60)
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_an_arm_by_name_replies_to_the_sdk_and_has_the_injected_faults(tmp_path: Path) -> None:
    link = tmp_path / "koch-port"
    with emulator("koch", "--port", str(link)):
        port, packets = PortHandler(str(link)), PacketHandler(2.0)
        assert port.openPort()
        assert port.setBaudRate(1_000_000)
        for _, number, _ in ARMS["koch"].servos:
            _, result, error = packets.ping(port, number)
            assert (result, error) == (COMM_SUCCESS, 0)
        assert packets.write1ByteTxRx(port, 3, TORQUE_ENABLE, 1) == (COMM_SUCCESS, 0)
        assert packets.write4ByteTxRx(port, 3, GOAL_POSITION, 2100) == (COMM_SUCCESS, 0)
        state = json.loads(run("status", "--port", str(link), "--json"))
        assert [one["id"] for one in state["servos"]] == [1, 2, 3, 4, 5, 6]
        assert [one["torque_enable"] for one in state["servos"]] == [0, 0, 1, 0, 0, 0]
        assert state["servos"][2]["goal_position"] == 2100
        assert run("fault", "overload", "elbow_flex", "--port", str(link)) == ""
        rows = [line.split() for line in run("status", "--port", str(link)).splitlines()]
        (elbow,) = (words for words in rows if words[:2] == ["3", "xl330_m288"])
        assert elbow[4:6] == ["off", "32"]
        port.closePort()
        run("fault", "unplug", "--port", str(link))
        assert not link.exists()
        assert run("fault", "plug_in", "--port", str(link)).strip() == os.readlink(link)
    assert not link.is_symlink()
    assert not control_of(link).exists()


def test_servos_by_model_and_id_a_baud_rate_and_a_world(tmp_path: Path) -> None:
    link, world = tmp_path / "port", Path(__file__).parents[2] / "robot_description" / "koch_v1_1" / "scene.xml"
    servos = ("xl430_w250:7", "xm430_w210:8")
    with emulator(*servos, "--port", str(link), "--baud-rate", "57600", stop_signal=signal.SIGTERM):
        port, packets = PortHandler(str(link)), PacketHandler(2.0)
        assert port.openPort()
        assert port.setBaudRate(57600)
        assert packets.ping(port, 8)[0] == 1030
        port.closePort()
    with emulator("koch", "--port", str(link), "--world", str(world)):
        state = json.loads(run("status", "--port", str(link), "--json"))
        assert len(state["servos"]) == 6


@pytest.mark.parametrize(
    ("arguments", "code", "facts"),
    [
        (("coch",), UNUSABLE, ("'coch'", "'koch'")),
        (("xl430:1",), UNUSABLE, ("'xl430'", "xl430_w250")),
        (("xl430_w250:999",), UNUSABLE, ("xl430_w250:999", "0 to 252")),
        (("koch", "--baud-rate", "1234"), UNUSABLE, ("1234", "57600")),
        (("koch", "--world", "no.xml"), MISSING, ("no.xml",)),
        (("koch", "--port", "no/folder"), MISSING, ("no/folder",)),
        (("fault", "unplug"), MISSING, ("dynamixel-port.control",)),
        (("status",), MISSING, ("dynamixel-port.control",)),
    ],
)
def test_an_error_message_names_what_is_valid(
    arguments: tuple[str, ...],
    code: int,
    facts: tuple[str, ...],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    before = signal.pthread_sigmask(signal.SIG_BLOCK, ())
    assert main(arguments) == code
    assert signal.pthread_sigmask(signal.SIG_BLOCK, ()) == before
    message = capsys.readouterr().err
    for fact in facts:
        assert fact in message
    assert list(tmp_path.iterdir()) == []


def test_an_emulator_whose_world_becomes_unstable_ends_with_the_cause(tmp_path, monkeypatch, capsys) -> None:
    def step(*_: object) -> None:
        raise RuntimeError("the world broke")

    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("dynamixel_emulator.world.MujocoMechanics.step", step)
    (tmp_path / "world.xml").write_text(
        '<mujoco><worldbody><body><joint name="servo_1"/><geom size="0.1" mass="1"/></body></worldbody></mujoco>'
    )
    assert main(("xl430_w250:1", "--world", "world.xml")) == STOPPED
    message = capsys.readouterr().err
    assert "the world broke" in message
    assert len(message.splitlines()) == 1


def test_an_unknown_fault_is_rejected_with_a_suggestion(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    link = tmp_path / "port"
    with emulator("koch", "--port", str(link)):
        assert main(("fault", "unplugg", "--port", str(link))) == UNUSABLE
        assert "'unplug'" in capsys.readouterr().err


def test_it_does_not_import_paramove_and_imports_mujoco_only_for_a_world() -> None:
    program = "import sys; import dynamixel_emulator.commands; print(*{name.split('.')[0] for name in sys.modules})"
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert {"paramove", "sim", "mujoco"}.isdisjoint(done.stdout.split())
