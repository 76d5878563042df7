"""The thesis's figures (5.2.7) compared with ours, and the goals made of them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from studies.imitation.experiment import CENTRE, RIGHT_SIDE, Target


@dataclass(frozen=True)
class Row:
    """One line of the comparison.

    Attributes:
        text: What is compared.
        name: Its name among the numbers.
        target: Where.
        thesis: What the thesis reports, mm; None if it gives no figure.
        goal: Not more than this, mm; None if it is no goal.
    """

    text: str
    name: str
    target: Target
    thesis: str | None
    goal: float | None = None


def _both(text: str, name: str, thesis: tuple[str | None, str | None], goal: float | None = None) -> list[Row]:
    return [Row(text, name, target, figure, goal) for target, figure in zip((CENTRE, RIGHT_SIDE), thesis, strict=True)]


ROWS: tuple[Row, ...] = (
    *_both("gripper, synthesis error", "gripper", ("< 8", "< 8"), 8.0),
    *_both("gripper, after time warping", "gripper_aligned", ("< 7", "< 7")),
    *_both("gripper at the target", "gripper_at_target", ("< 2", "< 2"), 2.0),
    *_both("elbow interpolated as a point", "elbow_linear", ("up to 25", "up to 8")),
    *_both("elbow interpolated as part of an arm", "elbow", (None, None)),
    *_both("elbow, effective error", "effective", ("< 6", "< 6"), 6.0),
    *_both("  where no joint limit moves it", "effective_free", (None, None)),
    *_both("  after time warping", "effective_aligned", ("< 5", "< 5")),
    *_both("  elbow interpolated as a point", "effective_linear", (None, None)),
    *_both("  within the joint limits", "effective_executed", (None, None)),
    *_both("imitation error of the reference", "least_imitation", ("about 10", "about 8.5")),
    *_both("imitation error", "imitation", ("≤ 12.5", "≤ 10"), 12.5),
    *_both("  more than the reference's", "imitation_excess", ("2.5", "1.5")),
    *_both("  where no joint limit moves it", "imitation_free", (None, None)),
    *_both("  within the joint limits", "imitation_executed", (None, None)),
    *_both("  at the target", "imitation_at_target", (None, None)),
)


@dataclass(frozen=True)
class Compared:
    """A row with our numbers: median and largest over the demonstrators, mm."""

    row: Row
    median: float | None
    largest: float | None

    @property
    def met(self) -> bool | None:
        """Whether the median meets the goal; None without a goal."""
        if self.row.goal is None or self.median is None:
            return None
        return self.median <= self.row.goal


def compared(numbers: dict[str, Any]) -> list[Compared]:
    """The comparison, from the numbers of an experiment."""
    by_target = {(one["place"], one["reference"]): one["mm"] for one in numbers["places"]}
    ours = [(row, by_target[row.target.name, "own"][row.name]) for row in ROWS]
    return [Compared(row, value["median"], value["max"]) for row, value in ours]


def verdicts(rows: list[Compared]) -> list[dict[str, Any]]:
    """The goals, for JSON."""
    return [
        {
            "what": one.row.text,
            "place": one.row.target.name,
            "goal_mm": one.row.goal,
            "thesis": one.row.thesis,
            "median_mm": one.median,
            "max_mm": one.largest,
            "met": one.met,
        }
        for one in rows
        if one.row.goal is not None
    ]
