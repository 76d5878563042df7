"""The measure of a bus: what it counts and concludes; how fast this machine is, is not asked here."""

import math

import pytest

from dynamixel_emulator.wire_faults import WireFaults
from paramove.robots.dynamixel.bus.bench import bench_bus, held_rates, latency_timer_ms, slow_timer
from tests.robots.dynamixel.small_arm import small_arm


@pytest.fixture
def arm(tmp_path):
    with small_arm(tmp_path / "by-id") as arm:
        yield arm


def test_times_of_a_sound_bus(arm):
    found = bench_bus(arm.chain, [1, 2, 3], 20)
    assert (found.servos, found.complete, found.rounds) == (3, 20, 20)
    assert 0.0 < found.p50_ms <= found.p99_ms <= found.longest_ms
    assert found.errors == {"missing": 0, "damaged": 0, "stray": 0, "echoed": 0}


def test_errors_are_counted_by_kind(arm):
    arm.chain.port.latency_s = 0.01
    arm.emulator.faults = WireFaults(damaged=0.3, seed=1)
    found = bench_bus(arm.chain, [1, 2, 3], 20)
    assert found.errors["damaged"] > 0
    assert found.errors["missing"] >= found.errors["damaged"]
    assert found.complete < 20
    assert found.rates_hz == ()


def test_a_silent_bus_has_no_times(arm):
    arm.chain.port.latency_s = 0.01
    found = bench_bus(arm.chain, [8], 3)
    assert (found.complete, found.rates_hz) == (0, ())
    assert math.isnan(found.p50_ms)


def test_a_rate_is_held_if_its_period_leaves_room():
    assert held_rates(0.5) == (50, 100, 200, 250, 333, 500, 1000)
    assert held_rates(1.7) == (50, 100, 200, 250, 333)
    assert held_rates(16.0) == (50,)
    assert held_rates(17.0) == held_rates(math.nan) == ()


def test_a_slow_latency_timer_is_told_with_the_fix(tmp_path):
    timer = tmp_path / "ttyUSB3" / "latency_timer"
    timer.parent.mkdir()
    timer.write_text("16\n")
    assert latency_timer_ms("/dev/ttyUSB3", tmp_path) == 16
    assert latency_timer_ms("/dev/pts/4", tmp_path) is None
    assert slow_timer("/dev/ttyUSB3", 1) == ""
    assert "echo 1 | sudo tee /sys/bus/usb-serial/devices/ttyUSB3/latency_timer" in slow_timer("/dev/ttyUSB3", 16)
