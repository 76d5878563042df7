"""Which states miss a goal, and why."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from studies.imitation.errors import SIGNIFICANT, largest, ranges
from studies.imitation.experiment import THESIS_TARGETS, Comparison, Experiment, Target


@dataclass(frozen=True)
class LimitUse:
    """What joint limits do to the synthesised movements of one target, over all demonstrators.

    Attributes:
        target: The target.
        joint: Joint that the closed form would put outside its limits.
        states: States in which it would, in words, counted from 1.
        outside_deg: By how much at most.
        elbow_turn_deg: How far the elbow is turned there at most, to keep the limits.
        gripper_moved_mm: How far the gripper is moved outward there at most, so that the elbow can bend enough.
    """

    target: Target
    joint: str
    states: str
    outside_deg: float
    elbow_turn_deg: float
    gripper_moved_mm: float


def limit_uses(experiment: Experiment) -> list[LimitUse]:
    """Which joint limits are met, where, and what is done about it."""
    uses = []
    for target in THESIS_TARGETS:
        movements = [comparison.synthesised for comparison in experiment.of(target)]
        outside = np.max([movement.outside for movement in movements], axis=0)
        turned = np.max([np.abs(movement.within_limits.elbow_turn) for movement in movements], axis=0)
        shifts = [movement.within_limits.gripper - movement.proposed.gripper for movement in movements]
        moved = np.max([np.linalg.norm(shift, axis=1) for shift in shifts], axis=0)
        for column, joint in enumerate(experiment.joints):
            at = np.flatnonzero(outside[:, column] > 0.0)
            if at.size:
                worst = np.rad2deg([outside[at, column].max(), turned[at].max()])
                uses.append(
                    LimitUse(
                        target, joint, ranges(at + 1), float(worst[0]), float(worst[1]), 1000.0 * float(moved[at].max())
                    )
                )
    return uses


def misses(experiment: Experiment, target: Target, name: str, goal: float) -> str:
    """The significant states whose median error over the demonstrators is above the goal, and how many are limited."""
    comparisons = experiment.of(target)
    errors = [comparison.errors() for comparison in comparisons]
    values = np.median([getattr(one, name) for one in errors], axis=0)
    above = errors[0].significant & (values > goal)
    limited = np.any([one.limited for one in errors], axis=0)
    if not above.any():
        return f"in no state is the median above {goal:g} mm; the largest of each movement is elsewhere"
    text = f"states {ranges(errors[0].state[above])} are above {goal:g} mm"
    limited_above = above & limited
    if limited_above.any():
        text += f"; in {ranges(errors[0].state[limited_above])} a joint limit moves the elbow"
    return text


def proportions(experiment: Experiment, target: Target) -> dict[str, float]:
    """Lengths of the scaled person's arm when the target is reached, of the robot's, and the distance reached, mm."""
    lengths = []
    for comparison in experiment.of(target):
        pose, state = comparison.against.proposed, comparison.reach_state - 1
        elbow, gripper = pose.elbow[state], pose.gripper[state]
        lengths.append([np.linalg.norm(elbow), np.linalg.norm(gripper - elbow), np.linalg.norm(gripper)])
    upper_arm, forearm, distance = 1000.0 * np.median(lengths, axis=0)
    robot = 1000.0 * np.array(experiment.lengths)
    nearest = min(float(_nearest_mm(comparison)) for comparison in experiment.of(target))
    return {
        "person_upper_arm": float(upper_arm),
        "person_forearm": float(forearm),
        "robot_upper_arm": float(robot[0]),
        "robot_forearm": float(robot[1]),
        "distance_at_target": float(distance),
        "nearest_gripper": nearest,
    }


def _nearest_mm(comparison: Comparison) -> float:
    significant = slice(SIGNIFICANT[0] - 1, SIGNIFICANT[1])
    return 1000.0 * float(np.linalg.norm(comparison.synthesised.proposed.gripper[significant], axis=1).min())


def why(experiment: Experiment) -> list[str]:
    """A message about every goal that is missed at a target of the thesis."""
    messages = []
    for target in THESIS_TARGETS:
        messages += _of_effective_error(experiment, target) + _of_imitation_error(experiment, target)
    return messages


def _of_effective_error(experiment: Experiment, target: Target) -> list[str]:
    worst = [largest(e.effective, e.significant) for e in (c.errors() for c in experiment.of(target))]
    if np.median([value for value in worst if value is not None]) <= 6.0:
        return []
    sizes = proportions(experiment, target)
    return [
        f"Effective elbow error, {target.name}: {misses(experiment, target, 'effective', 6.0)}. On the way over the "
        f"edge of the table the hand passes {sizes['nearest_gripper']:.0f} mm from the shoulder, nearer than the "
        f"{1000.0 * experiment.min_reach:.0f} mm at which the robot's elbow is bent fully. There the elbow can go "
        "round a circle as wide as the upper arm is long, so that each degree of swivel costs 2 mm."
    ]


def _of_imitation_error(experiment: Experiment, target: Target) -> list[str]:
    sizes = proportions(experiment, target)
    errors = [comparison.errors() for comparison in experiment.of(target)]
    floor = np.median([largest(e.min_imitation, e.significant) for e in errors])
    if floor <= 12.5:
        return []
    return [
        f"Imitation error, {target.name}: {misses(experiment, target, 'imitation', 12.5)}. So is the reference's "
        f"({floor:.1f} mm), which no method can undercut: of all positions of the elbow that leave the gripper where "
        "it is, 5.2.4 takes the nearest to the person's. The person's scaled upper arm is "
        f"{sizes['person_upper_arm']:.0f} mm long and the forearm {sizes['person_forearm']:.0f} mm, the robot's "
        f"{sizes['robot_upper_arm']:.0f} and {sizes['robot_forearm']:.0f} mm. The more the arm is bent, the more of "
        f"this difference shows: the target is {sizes['distance_at_target']:.0f} mm from the shoulder, and on the way "
        f"the hand passes at {sizes['nearest_gripper']:.0f} mm. "
        'To be compared with the thesis is what synthesis adds to it ("more than the reference\'s").'
    ]
