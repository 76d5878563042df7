"""How near rows may bring parts to each other: as near as a speed allows, and out of contact only slowly."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from benchmarks.safety_steps import limits_at
from paramove.safety.clearance import clearance_fault
from paramove.safety.gate_io import Fault

FAST, SLOW = limits_at(0.001), limits_at(0.01)


class Gap:
    """The first joint's angle is the distance; asked poses are kept."""

    def __init__(self) -> None:
        self.asked: list[float] = []

    def distances(self, q: np.ndarray) -> tuple[float, str, str]:
        self.asked.append(float(q[0]))
        return float(q[0]), "hand", "torso"


def fault(distances: list[float] | np.ndarray, start: float, limits: object = SLOW) -> Fault | None:
    rows = np.zeros((len(distances), 3))
    rows[:, 0] = distances
    return clearance_fault(Gap(), np.array([start, 0.0, 0.0]), rows, limits, len(rows))  # type: ignore[arg-type]


def test_rows_are_looked_at_every_20_ms_and_at_the_end() -> None:
    gap = Gap()
    rows = np.zeros((50, 3))
    rows[:, 0] = 1 + np.arange(50)
    assert clearance_fault(gap, np.zeros(3) + 0.5, rows, FAST, 50) is None
    assert gap.asked == [0.5, 20.0, 40.0, 50.0]
    gap = Gap()
    assert clearance_fault(gap, np.zeros(3) + 0.5, rows[:5], SLOW, 5) is None
    assert gap.asked == [0.5, 2.0, 4.0, 5.0]
    gap = Gap()
    assert clearance_fault(gap, np.zeros(3) + 0.5, rows[:1], FAST, 1) is None
    assert gap.asked == [0.5, 1.0]
    gap = Gap()
    assert clearance_fault(gap, np.zeros(3) + 0.5, rows[:3], limits_at(0.02), 3) is None
    assert gap.asked == [0.5, 1.0, 2.0, 3.0]


@pytest.mark.parametrize(
    ("start", "end", "passes"),
    [
        (0.5, 0.020, True),  # from afar to the beginning of the zone
        (0.5, 0.0199, False),
        (0.0160, 0.0150, True),  # 50 mm/s at 15 mm
        (0.0161, 0.0150, False),
        (0.0150, 0.0150, True),
        (0.0050, 0.0049, False),
        (0.0040, 0.0040, True),
        (0.0040, 0.0050, True),
        (-0.0100, -0.0090, True),
        (-0.0100, 0.0030, False),  # apart, but at 0.65 rad/s, allowed 0.6
        (-0.0080, 0.0030, True),
        (-0.0100, 0.0050, True),  # at 5 mm any speed apart will do
        (-0.0100, 0.0060, True),
        (float("nan"), 0.0100, False),
        (0.0100, float("nan"), False),
    ],
)
def test_two_rows_of_20_ms(start: float, end: float, passes: bool) -> None:
    found = fault([start, end], start)
    assert (found is None) is passes
    if found is not None:
        assert (found.code, found.joint) == ("clearance", "")


def test_exactly_as_fast_as_allowed_passes() -> None:
    limits = replace(limits_at(0.125), velocity=np.full(3, 5.0))
    assert fault([0.0], -0.125, limits) is None  # apart at a fifth of 5 rad/s
    assert fault([0.001], -0.125, limits) is not None
    limits = limits_at(1.0)
    assert fault([0.0], 1e-4, limits) is None  # 0.1 mm/s may be none
    assert fault([0.0], 1.1e-4, limits) is not None


@pytest.mark.parametrize(
    ("distance", "said"),
    [
        (0.01794, "within 17.9 mm at row 0, at 24103 mm/s, allowed 65 mm/s there"),
        (0.017874, "within 17.9 mm at row 0, at 24106 mm/s, allowed 64 mm/s there"),
    ],
)
def test_millimetres_are_thousandths_of_metres(distance: float, said: str) -> None:
    found = fault([distance], 0.5, limits_at(0.02))
    assert found is not None
    assert said in found.detail


def test_the_sentence_names_the_two_the_place_and_what_is_allowed() -> None:
    found = fault([0.0141, 0.0120, 0.0105, 0.0100], 0.0141)
    assert found is not None
    assert found.detail == (
        "hand and torso come within 12.0 mm at row 1, at 105 mm/s, allowed 35 mm/s there, and below 5 mm only slowly "
        "apart"
    )
    rows = np.zeros((4, 3))
    rows[:, 0] = [0.3, 0.3, 0.3, 0.01]
    stop = clearance_fault(Gap(), rows[0], rows, SLOW, 3)
    assert stop is not None
    assert "10.0 mm in the stop after these rows, at" in stop.detail
    last = clearance_fault(Gap(), rows[0], rows, SLOW, 4)
    assert last is not None
    assert "at row 3" in last.detail
