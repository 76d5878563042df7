"""The emulator's node gives a port and says the truth, as long as the bus is open."""

from pathlib import Path

import pytest

from paramove.bus import topics
from paramove.bus.recorded import RecordedBus
from paramove.bus.ticks import Tick
from paramove.documents.input_error import InputError
from sim import dynamixel_emulator

ROBOTS = Path(__file__).parents[2] / "robot_description"
PERIOD_NS = 66_666_667


class BusWithALook(RecordedBus):
    """Notes what is in the run folder at each tick."""

    seen: list[set[str]]

    def events(self, *wanted, tick=False):
        self.seen = []
        for event in super().events(*wanted, tick=tick):
            self.seen.append({str(path.relative_to(self.run_folder)) for path in self.run_folder.rglob("*")})
            yield event


def test_there_is_a_port_and_a_control_socket_while_it_runs(tmp_path):
    bus = BusWithALook([Tick(number, number * PERIOD_NS) for number in range(1, 4)], run_folder=tmp_path)
    dynamixel_emulator.run(bus, dynamixel_emulator.Config(robot=ROBOTS / "open_manipulator_x", control="control"))
    port = "by-id/usb-paramove_emulated_servos-if00-port0"
    assert bus.seen == [{"by-id", port, "control"}] * 3
    assert not (tmp_path / port).exists()
    assert bus.states[0] == ("ready", f"open_manipulator_x at {tmp_path / port}; 0 packets, no findings")
    published = bus.published_on(topics.TRUTH_STATE)
    assert [word.message.time_ns for word in published] == [PERIOD_NS, 2 * PERIOD_NS, 3 * PERIOD_NS]
    assert len(published[0].message.joint_positions) == 5


def test_a_robot_without_servos_is_rejected(tmp_path):
    with pytest.raises(InputError, match="not a servo arm"):
        dynamixel_emulator.run(RecordedBus(run_folder=tmp_path), dynamixel_emulator.Config(robot=ROBOTS / "hoap3"))
