"""A recorded run of the pointing application: estimates, ground truth, and their errors."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from paramove.bus import topics
from paramove.documents import Floats
from paramove.msgs.gesture_pb2 import Gesture
from paramove.runs.after_a_run import rounded
from paramove.runs.recorded_run import RunFolderError, recording_in

FARTHEST_M = 0.10
MEDIAN_M = 0.04
"""Goals of a run: maximum and median error of the answers."""
LATE_S = 1.0
"""A gesture that comes so long after the hand has left still answers that pointing."""


@dataclass(frozen=True)
class Pointing:
    """One demonstration and the gestures that answer it.

    Attributes:
        number: from 1.
        target: the true target, (3,), m.
        arrived_s, left_s: when the end of the hand was there.
        answers: times, targets (2,) and certainties of the gestures meanwhile.
    """

    number: int
    target: Floats
    arrived_s: float
    left_s: float
    answers: tuple[tuple[float, Floats, float], ...]

    @property
    def error(self) -> float:
        """Of the first answer, m; infinite without one."""
        return float(np.linalg.norm(self.answers[0][1] - self.target[:2])) if self.answers else float("inf")

    @property
    def delay_s(self) -> float:
        """From arriving to the first answer."""
        return self.answers[0][0] - self.arrived_s if self.answers else float("inf")


@dataclass(frozen=True)
class PointingRun:
    """A run. T estimates of the action tracker, or arm poses of a body tracker.

    Attributes:
        folder: Of the run.
        time_s: of the estimates, (T,).
        hand, true_hand: (T, 3), m; NaN where it was not detected, and in `true_hand` where no truth was recorded.
        hand_deviation: largest standard deviation of the hand, (T,), m; 0 where a body tracker reports none.
        pointed_deviation: of the estimated target, (T,), m; NaN where a body tracker reports none.
        effective: effective sample sizes, (T,); NaN without particles.
        unsure: whether the estimate was lost or degraded, or a body tracker did not detect the hand, (T,).
        pointings: demonstrations, empty if no truth was recorded.
        spurious: times and targets of gestures that answer nothing.
        gestures: how many there were.
    """

    folder: Path
    time_s: Floats
    hand: Floats
    true_hand: Floats
    hand_deviation: Floats
    pointed_deviation: Floats
    effective: Floats
    unsure: NDArray[np.bool_]
    pointings: tuple[Pointing, ...]
    spurious: tuple[tuple[float, Floats], ...]
    gestures: int

    def summary(self) -> dict[str, Any]:
        """All numbers, as plain JSON."""
        numbers: dict[str, Any] = {
            "estimates": len(self.time_s),
            "seconds": float(self.time_s[-1] - self.time_s[0]) if len(self.time_s) else 0.0,
            "gestures": self.gestures,
            "unsure_share": float(self.unsure.mean()) if len(self.unsure) else 0.0,
        }
        if not self.pointings:  # of a real person there is no truth
            return numbers | {"success": None, "reason": "without truth nothing is judged"}
        errors = np.array([one.error for one in self.pointings])
        missed = self.hand - self.true_hand
        missed = missed[np.isfinite(missed).all(axis=1)]
        rms = np.sqrt((missed**2).mean(axis=0)) if len(missed) else np.full(3, np.nan)
        good = bool(errors.max() <= FARTHEST_M and np.median(errors) <= MEDIAN_M and not self.spurious)
        return numbers | {
            "success": good,
            "reason": "" if good else self._reason(errors),
            "pointings": [
                {
                    "target": [round(float(value), 4) for value in one.target],
                    "error_cm": rounded(100 * one.error),
                    "delay_s": rounded(one.delay_s),
                    "certainty": rounded(one.answers[0][2]) if one.answers else None,
                    "answers": len(one.answers),
                }
                for one in self.pointings
            ],
            "target_error_cm": {
                "median": rounded(100 * float(np.median(errors))),
                "worst": rounded(100 * errors.max()),
            },
            "hand_rms_cm": [rounded(100 * float(value)) for value in rms],
            "spurious": len(self.spurious),
        }

    def _reason(self, errors: Floats) -> str:
        unanswered = [
            str(one.number) for one, error in zip(self.pointings, errors, strict=True) if not np.isfinite(error)
        ]
        if unanswered:
            return f"pointing {', '.join(unanswered)} was not answered"
        if self.spurious:
            return f"{len(self.spurious)} gestures where nobody pointed"
        worst = int(errors.argmax())
        return f"pointing {worst + 1} was answered {100 * errors[worst]:.1f} cm from its target"


def load_pointing_run(folder: Path) -> PointingRun:
    """Read a run. Raises RunFolderError if there are no estimates in it."""
    estimates: list[tuple[float, Any]] = []
    poses: list[tuple[float, Any]] = []
    gestures: list[tuple[float, Floats, float]] = []
    needed = {topics.ACTION_ESTIMATE.name, topics.HUMAN_ARM_POSE.name, topics.GESTURES.name}
    for recorded in recording_in(folder, "recording").read(needed):
        time_s = recorded.log_ns * 1e-9
        if recorded.topic != topics.GESTURES.name:
            (estimates if recorded.topic == topics.ACTION_ESTIMATE.name else poses).append((time_s, recorded.message))
        elif recorded.message.kind == Gesture.KIND_POINTED_AT:
            target = np.array([recorded.message.x, recorded.message.y])
            gestures.append((time_s, target, recorded.message.confidence))
    if not estimates and not poses:
        raise RunFolderError(
            f"{folder}: no action estimates and no arm poses recorded; a run of launch/pointing.yaml expected"
        )
    truth = _truth(folder)
    pointings = _pointings(truth, gestures)
    answered = {time for one in pointings for time, _, _ in one.answers}
    times = np.array([time for time, _ in estimates or poses])
    estimated = _of_estimates([one for _, one in estimates]) if estimates else _of_poses([one for _, one in poses])
    return PointingRun(
        folder=folder,
        time_s=times,
        true_hand=_true_hands(truth, times),
        **estimated,
        pointings=pointings,
        spurious=tuple((time, target) for time, target, _ in gestures if truth and time not in answered),
        gestures=len(gestures),
    )


def _of_estimates(messages: list[Any]) -> dict[str, Any]:
    return {
        "hand": np.array([_xyz(one.hand) for one in messages]),
        "hand_deviation": np.array([max(_deviations(one.hand)) for one in messages]),
        "pointed_deviation": np.array([max(_deviations(one.pointed)) for one in messages]),
        "effective": np.array([one.effective_sample_size for one in messages]),
        "unsure": np.array([one.lost or one.degraded for one in messages]),
    }


def _of_poses(messages: list[Any]) -> dict[str, Any]:
    undetected = (np.nan,) * 3
    hand = np.array([next((_xyz(p) for p in one.points if p.name == "index"), undetected) for one in messages])
    unknown = np.full(len(hand), np.nan)
    return {
        "hand": hand,
        "hand_deviation": np.zeros(len(hand)),
        "pointed_deviation": unknown,
        "effective": unknown,
        "unsure": np.isnan(hand).any(axis=1),
    }


def _truth(folder: Path) -> list[tuple[float, Any]]:
    try:
        recording = recording_in(folder, "truth")
    except RunFolderError:
        return []
    return [(recorded.log_ns * 1e-9, recorded.message) for recorded in recording.read({topics.TRUTH_ARM.name})]


def _pointings(truth: list[tuple[float, Any]], gestures: list[tuple[float, Floats, float]]) -> tuple[Pointing, ...]:
    pointings = []
    for number in sorted({message.performance for _, message in truth} - {0}):
        own = [(time, message) for time, message in truth if message.performance == number]
        there = [time for time, message in own if message.at_target]
        if not there:
            continue
        target = own[0][1].target
        answers = tuple(one for one in gestures if there[0] - LATE_S <= one[0] <= own[-1][0])
        position = np.array([target.x, target.y, target.z])
        pointings.append(Pointing(number, position, there[0], there[-1], answers))
    return tuple(pointings)


def _true_hands(truth: list[tuple[float, Any]], times: Floats) -> Floats:
    """True positions of the hand at these times, (T, 3), m; NaN without truth."""
    if not truth:
        return np.full((len(times), 3), np.nan)
    known = np.array([time for time, _ in truth])
    hands = np.array([next(_xyz(p) for p in message.points if p.name == "hand") for _, message in truth])
    return np.stack([np.interp(times, known, column) for column in hands.T], axis=1)


def _xyz(point: Any) -> tuple[float, float, float]:
    return point.x, point.y, point.z


def _deviations(point: Any) -> tuple[float, float, float]:
    return point.x_deviation, point.y_deviation, point.z_deviation
