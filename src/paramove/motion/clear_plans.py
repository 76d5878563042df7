"""Plans that keep clear of obstacles: the first of several alternatives that is reachable and clear.

After an interruption, when the arm rests somewhere on a path, a plan begins with a straight line of joint angles from
the measured pose to its start. No movement was learned for that.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import partial

import numpy as np

from paramove.documents import Floats
from paramove.motion.arm_pose import UnreachablePoseError
from paramove.motion.clearance import ClearanceChecker
from paramove.motion.gripper_arm import GripperArm
from paramove.motion.plans import USUAL, Grasp, NoPlanError, PlannedMotion, RestPose, check_number
from paramove.motion.relocation import RelocationPlanner
from paramove.motion.timing import PEAK_ACCELERATION, PEAK_VELOCITY, minimum_jerk

MIN_CLEARANCE = 0.005  # m, of planned paths from table, body and standing objects
_HIGHER_ENTRY = 0.065
_HIGHER_CARRY = np.array([0.0, 0.0, 0.012])
_BEHIND_ROW = 0.004
_MIN_TO_STANDING = 0.003  # m, where no alternative keeps more: positions of standing objects are known to about 2 mm
_HALF_OPEN = 0.45  # ξ; an object of 20 mm is released at less than half of it
NOT_AT_BASE = "the arm is not at its base pose; send a goal of kind REST first"
_HIGH = 0.055  # m above the working plane's grasp height: an empty hand there has left the objects below it
LIMIT_FRACTION = 0.5  # of the operating velocity and acceleration: people do not expect this motion
MIN_DURATION_S = 0.5
JOINED_WITHIN = np.deg2rad(0.01)


def joint_motion(
    planner: RelocationPlanner, start: Floats, end: Floats, phase: str, holding: bool = False
) -> PlannedMotion:
    """All joints together from `start` to `end`, from rest to rest.

    Args:
        planner: Its arm, the limits of the joints, and the period of the samples.
        start, end: Arm joints and fingers, [6], rad.
        phase: Name of the motion's only phase.
        holding: Whether an object is held.
    """
    distance, period = np.abs(end - start), planner.options.sample_period
    by_velocity = PEAK_VELOCITY * distance / (LIMIT_FRACTION * planner.velocity)
    by_acceleration = np.sqrt(PEAK_ACCELERATION * distance / (LIMIT_FRACTION * planner.acceleration))
    duration = max(MIN_DURATION_S, float(by_velocity.max()), float(by_acceleration.max()))
    n = int(np.ceil(duration / period))
    angles = start + minimum_jerk(np.arange(n + 1) / n)[:, None] * (end - start)
    gripper = planner.arm.kinematics.forward(angles[:, :5]).gripper
    times: Floats = period * np.arange(n + 1, dtype=np.float64)
    return PlannedMotion(times, angles, gripper, np.full(n + 1, holding), ((phase, 0.0),), 0.0)


def joined(first: PlannedMotion, then: PlannedMotion) -> PlannedMotion:
    """One motion after the other; the second begins at rest where the first ends.

    Raises:
        ValueError: It begins elsewhere.
    """
    if np.abs(first.angles[-1] - then.angles[0]).max() > JOINED_WITHIN:
        raise ValueError("the second motion begins where the first does not end")
    later = first.times[-1]
    return PlannedMotion(
        times=np.concatenate([first.times, later + then.times[1:]]),
        angles=np.concatenate([first.angles, then.angles[1:]]),
        gripper=np.concatenate([first.gripper, then.gripper[1:]]),
        holding=np.concatenate([first.holding, then.holding[1:]]),
        phases=(*first.phases, *((name, later + start) for name, start in then.phases)),
        elbow_turn=max(first.elbow_turn, then.elbow_turn),
    )


_Alternative = Callable[[], PlannedMotion]
_Choices = Mapping[str, object]
"""Phase -> choice of an alternative in it. Equal choices give equal motions in a phase; so do phases not named."""


class ClearPlans:
    """`MotionPlans` of a humanoid's arm: tries the alternatives of a motion in order of preference.

    Args:
        arm: Its joints and fingers.
        planner: Builds motions from the converted movement.
        checker: Measures their distance from table, body and standing objects.
    """

    def __init__(self, arm: GripperArm, planner: RelocationPlanner, checker: ClearanceChecker) -> None:
        self.arm, self.planner, self._checker = arm, planner, checker
        self.offer_opening, self.closed_opening = planner.options.offer_opening, planner.options.closed_opening

    def within_training(self, position: Floats) -> bool | None:
        """Whether the movement was trained around this position."""
        return self.planner.movement.within_training(position)

    def fetch(
        self, source: Floats, standing: Floats, start: RestPose | None = None, grasp: Grasp = USUAL
    ) -> PlannedMotion:
        """Reach from before the object as in 5.2.5; if not clear, or at a second attempt, lower the hand over it."""
        _check_at_base(start)
        grasp.check_height(self._checker.surface.object_height)
        heights = (self.planner.options.entry_height, _HIGHER_ENTRY)
        first = grasp.attempt % 2 == 0
        kinds = [(height, above) for above in (first, not first) for height in heights]
        alternatives = [partial(self.planner.fetch, source, height, above) for height, above in kinds]
        choices = [{"approach": kind, "lower": kind, "reach": kind[1]} for kind in kinds]
        return self._first(alternatives, standing, choices)

    def deliver(self, start: RestPose, target: Floats, standing: Floats) -> PlannedMotion:
        """Carry straight; if that is not clear, first back to the target's row, or higher. Withdraw back, else up.

        Where the open fingers would touch a neighbour, the hand is opened less.
        """
        here = start.gripper
        back = np.array([target[0] + _BEHIND_ROW, here[1], here[2]])
        detours: list[list[Floats]] = [[], [back], [back + _HIGHER_CARRY]]
        leavings = [(upward, opened) for opened in (None, _HALF_OPEN) for upward in (False, True)]
        kinds = [(number, leaving) for leaving in leavings for number in range(len(detours))]
        alternatives = [
            partial(self.planner.deliver, here, target, [self.planner.far_enough(p) for p in detours[number]], *leaving)
            for number, leaving in kinds
        ]
        choices = [
            {"carry": number, "release": leaving[1], "withdraw": leaving, "retreat": leaving}
            for number, leaving in kinds
        ]
        return self._first(alternatives, standing, choices)

    def hold(self, start: RestPose, position: Floats, standing: Floats) -> PlannedMotion:
        """Carry a held object to `position` and stay there: straight, else over start or position, else above both."""
        here = start.gripper
        corners = [np.array([*side[:2], max(here[2], position[2])]) for side in (here, position)]
        above = [corner + _HIGHER_CARRY for corner in corners]
        detours: list[list[Floats]] = [[], *([corner] for corner in corners), above]
        alternatives = [
            partial(self.planner.hold, here, position, [self.planner.far_enough(corner) for corner in detour])
            for detour in detours
        ]
        return self._first(alternatives, standing)

    def leave(self, here: RestPose, opening: float, standing: Floats) -> PlannedMotion:
        """Open the hand and go back to the base pose, withdrawing back, else up."""
        alternatives = [partial(self.planner.leave, here.gripper, opening, upward) for upward in (False, True)]
        return self._first(alternatives, standing)

    def home(self, here: RestPose, opening: float, holding: bool, standing: Floats) -> PlannedMotion:
        """From wherever the arm rests to the base pose; after a planned motion as `leave`.

        From measured angles, a held object is put down where it is. An empty hand is opened and withdrawn as after a
        placing; where it is already above all objects, or where that is not possible, the arm goes straight in joint
        angles.
        """
        if not here.measured:
            return self.leave(here, opening, standing)
        planner, hand = self.planner, here.gripper
        opening = 0.0 if holding else self.arm.opening_of(float(here.angles[-1]))
        start = np.array([*here.angles[:-1], self.arm.angle_of(opening)])
        grasped = self._checker.grasp_height
        below = np.array([hand[0], hand[1], min(hand[2], grasped)])
        put_down: list[_Alternative] = [partial(planner.deliver, hand, below, [], upward) for upward in (False, True)]
        leave: list[_Alternative] = [partial(planner.leave, hand, opening, upward) for upward in (False, True)]
        learned = [
            partial(self._from, start, alternative, holding)
            for alternative in ([*put_down, *leave] if holding else leave)
        ]
        straight = partial(joint_motion, planner, start, planner.base_angles, "retreat")
        high = hand[2] > grasped + _HIGH and not holding
        return self._first([straight, *learned] if high else [*learned, straight], standing)

    def _from(self, start: Floats, alternative: _Alternative, holding: bool) -> PlannedMotion:
        """The motion, preceded by a straight path to its first sample."""
        motion = alternative()
        return joined(joint_motion(self.planner, start, motion.angles[0], "gather", holding), motion)

    def reach(self, position: Floats, standing: Floats, start: RestPose | None = None) -> PlannedMotion:
        """Go to `position` with an open hand."""
        _check_at_base(start)
        return self._first([partial(self.planner.offer, position)], standing)

    def fingers(self, here: RestPose, opening: float, end: float, standing: Floats) -> PlannedMotion:
        """Open or close the hand where it is."""
        return self._first([partial(self.planner.fingers, here.gripper, opening, end)], standing)

    def _first(
        self, alternatives: Sequence[_Alternative], standing: Floats, choices: Sequence[_Choices] | None = None
    ) -> PlannedMotion:
        """The first reachable and clear alternative; `choices` skips those that would fail like a previous one."""
        check_number(standing)
        reasons = []
        in_the_way = set()
        next_best: tuple[float, PlannedMotion | None] = (0.0, None)
        hopeless: list[tuple[str, object]] = []
        for number, alternative in enumerate(alternatives):
            if choices and any(choices[number].get(phase) == choice for phase, choice in hopeless):
                continue
            try:
                motion = alternative()
            except UnreachablePoseError as error:
                reasons.append(str(error))
                continue
            closest = self._checker.smallest(motion.angles, standing, motion.holding, every=6)
            if closest.distance >= MIN_CLEARANCE:
                return motion
            if closest.standing is not None:
                in_the_way.add(closest.standing)
                if closest.distance >= max(_MIN_TO_STANDING, next_best[0]):
                    next_best = closest.distance, motion
            phase = [name for name, start in motion.phases if start <= motion.times[closest.sample]][-1]
            if choices:
                hopeless.append((phase, choices[number].get(phase)))
            reasons.append(
                f"{closest.pair[0]} would come within {closest.distance * 1000:.1f} mm of {closest.pair[1]} "
                f"in {phase} (allowed {MIN_CLEARANCE * 1000:.0f} mm)"
            )
        if next_best[1] is not None:
            return next_best[1]
        raise NoPlanError("; ".join(dict.fromkeys(reasons)), frozenset(in_the_way))


def _check_at_base(start: RestPose | None) -> None:
    if start is not None:
        raise NoPlanError(NOT_AT_BASE)
