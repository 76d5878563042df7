"""How goals went whose places lie within the training of the movement model, and how the others."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from paramove.runs.relocations import Relocation

WHERE = ("inside", "outside")


def by_hull(goals: Iterable[Relocation]) -> dict[str, Any]:
    """Counts of the goals to fetch something, by where they fetch it (`from`) and where they bring it (`to`)."""
    fetching = [goal for goal in goals if goal.fetches]
    return {
        place: {
            where: _counts([goal for goal in fetching if getattr(goal, place + "_hull") == where]) for where in WHERE
        }
        for place in ("from", "to")
    }


def _counts(goals: list[Relocation]) -> dict[str, int]:
    tried = [goal for goal in goals if goal.result != "refused"]
    return {
        "tried": len(tried),
        "succeeded": sum(goal.result == "succeeded" for goal in tried),
        "refused": len(goals) - len(tried),
    }
