"""Goals that cannot be done are refused at once, with the reason and what would work; the arm does not move."""

from __future__ import annotations

import math
import re

import pytest

from paramove.msgs.relocation_pb2 import RelocationGoal, RelocationStatus
from tests.motion.fake_driver import Cell, goal
from tests.motion.reaching import OPENINGS
from tests.nodes.bad_messages import variants

PLACE, TARGET = (0.177, -0.02), OPENINGS[1]
RELOCATE = RelocationGoal.KIND_RELOCATE
OTHERS = [(0.17, 0.06), (0.18, -0.09)]


@pytest.mark.parametrize(
    ("source", "target", "avoid", "reason"),
    [
        ((0.30, 0.0), TARGET, (), r"reach|cm"),
        (PLACE, (0.40, 0.0), (), r"reach|cm"),
        ((0.05, 0.0), TARGET, (), r"reach|cm|clear|mm"),
        ((-0.15, 0.10), TARGET, (), r"reach|cm|clear|mm"),
        (PLACE, (0.135, -0.30), (), r"reach|cm|clear|mm"),
        ((*PLACE, -0.135), TARGET, (), r"come within .* of surface"),
        ((*PLACE, -0.30), TARGET, (), r"reach|cm|surface"),
        ((1e6, 0.0), TARGET, (), r"an arm reaches no farther than 2 m"),
        (PLACE, TARGET, [PLACE], r"come within .* of standing"),
        (PLACE, TARGET, [TARGET], r"come within .* of standing"),
        (PLACE, TARGET, [(0.17, 0.06)] * 9, r"9 .*8"),
        ((math.nan, 0.0), TARGET, (), "position 'from' is .*nan.* finite numbers in m are needed"),
        (PLACE, (0.1, math.inf), (), "position 'to' is .*inf.* finite numbers in m are needed"),
        (PLACE, TARGET, [(math.nan, 0.0)], "avoid are .*nan.* finite numbers in m are needed"),
    ],
)
def test_places_that_cannot_be_reached_are_refused(source, target, avoid, reason: str) -> None:
    cell = Cell()
    last = cell.do(goal(RELOCATE, source=source, target=target, avoid=list(avoid)), timeout_ticks=30)
    assert last.state == RelocationStatus.STATE_REJECTED
    assert re.search(reason, last.reason), last.reason
    assert "\n" not in last.reason
    assert cell.driver.heard == []


@pytest.mark.parametrize("number", range(2))
def test_every_fault_of_a_goal_is_refused_or_done(number: int) -> None:
    """One fault at a time, each for an arm at rest; half of them each, for the time that it takes."""
    good = goal(RELOCATE, source=PLACE, target=TARGET, avoid=OTHERS)
    for fault, bad in list(variants(good))[number::2]:
        cell = Cell()
        for _ in range(3):
            cell.tick()  # the arm is known to rest at its base pose
        cell.synthesizer.on_goal(bad)
        cell.tick()
        assert cell.statuses, fault
        accepted = cell.statuses[0].state == RelocationStatus.STATE_ACCEPTED
        assert accepted or cell.statuses[0].reason, fault
        assert not accepted or not re.search(
            r"=(nan|-?inf|-?1e\+300)|frame=|kind=|(from|to) missing|empty|^id=''", fault
        )
