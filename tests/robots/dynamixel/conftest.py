"""Emulated servos answer to a ping of all at once."""

import pytest


@pytest.fixture(autouse=True)
def no_turns(monkeypatch):
    """Real ones take turns, which are waited for."""
    monkeypatch.setattr("paramove.robots.dynamixel.bus.servo_chain.TURN_S", 0.0)
