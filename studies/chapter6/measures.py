"""What is measured of one track: errors of the hand, of detected targets, lost performances, recognised actions."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import median_filter

from paramove.documents import Floats
from studies.chapter6.vocabularies import BY_OTHERS

TARGET_MARGIN_S = 0.5
"""A target is looked for from so long before the hand arrives until so long after it leaves."""
LOST_M = {1: 0.25}
LOST_OTHERWISE_M = 0.15
"""The hand is off by more than this: with a single view, which does not see depth well, and with several."""
LOST_S = 0.5
"""A performance is lost when the hand is off for as long."""
MEDIAN_FRAMES = 5
RECOGNISED = 0.5
DUAL, REDIRECT = "point_redirect_withdraw", "redirect"


@dataclass(frozen=True)
class Performed:
    """One performance of an action within a track.

    Attributes:
        action: what is performed. start_s, end_s: from leaving the base pose to being there again.
        targets: true positions (n, 3), m. arrives_s, leaves_s: of the hand at each, (n,).
        grasp_s: when an object is grasped; NaN without one.
        from_true_poses: the target that the model infers from all true poses, (3,), m; None without one.
    """

    action: str
    start_s: float
    end_s: float
    targets: Floats
    arrives_s: Floats
    leaves_s: Floats
    grasp_s: float
    from_true_poses: Floats | None = None


class Track:
    """One stored track; lengths in m, times in s.

    Args:
        result: of a piece of work, as `experiments.Piece.run` returns it.
    """

    def __init__(self, result: Mapping[str, Any]) -> None:
        values = result["values"]
        self.clip, self.kind, self.split = str(result["clip"]), str(result["kind"]), str(result["split"])
        self.views = tuple(int(view) for view in result["views"])
        self.likelihood = str(result["likelihood"])
        self.times_s = np.array(values["times_s"])
        self.poses, self.true_poses = np.array(values["poses"]), np.array(result["truth"]["poses"])
        self.best_hands = np.array(values["best_hands"])
        self.hand_deviations = np.array(values["hand_deviations"])
        self.effective = np.array(values["effective"])
        self.reported_lost = np.array(values["lost"], dtype=np.bool_)
        self.actions = {name: np.array(one) for name, one in values["actions"].items()}
        self.tau = {name: np.array(one) for name, one in values["tau"].items()}
        self.theta_deviation = np.array(values["theta_deviation"])
        self.pointed = np.array(values["pointed"])
        self.detected: list[dict[str, Any]] = values["detected"]
        self.seconds = np.array(values["seconds"])
        self.acts = tuple(_performed(act) for act in result["truth"]["acts"])
        self.sight: Mapping[str, Any] | None = result["sight"]

    @property
    def rate_hz(self) -> float:
        """Frames per second."""
        return float(1.0 / np.median(np.diff(self.times_s)))

    @property
    def hand_errors(self) -> Floats:
        """Estimated minus true position of the hand, (T, 3)."""
        return np.asarray(self.poses[:, -3:] - self.true_poses[:, -3:])

    @property
    def pose_errors(self) -> Floats:
        """Root mean square over shoulder, elbow and hand of their distances from the truth, (T,)."""
        apart = (self.poses - self.true_poses).reshape(len(self.poses), 3, 3)
        return np.asarray(np.sqrt((apart**2).sum(axis=2).mean(axis=1)))

    @cached_property
    def median_errors(self) -> Floats:
        """Errors of the best hypotheses' hands (6.16), median filtered over five frames as in table 6.1. (T, 3)."""
        filtered = median_filter(self.best_hands, size=(MEDIAN_FRAMES, 1), mode="nearest")
        return np.asarray(filtered - self.true_poses[:, -3:])

    @property
    def best_errors(self) -> Floats:
        """Errors of the best hypotheses' hands (6.16), (T, 3)."""
        return np.asarray(self.best_hands - self.true_poses[:, -3:])

    @property
    def pointed_errors(self) -> Floats:
        """Distance of the target of theta from the target next arrived at, in each frame, (T,)."""
        arrivals = np.concatenate([act.leaves_s for act in self.acts])
        targets = np.concatenate([act.targets for act in self.acts])
        following = np.minimum(np.searchsorted(arrivals, self.times_s), len(targets) - 1)
        return np.asarray(np.linalg.norm(self.pointed - targets[following], axis=1))

    def frames_of(self, act: Performed) -> NDArray[np.bool_]:
        """Which frames show a performance, (T,)."""
        return np.asarray((self.times_s >= act.start_s) & (self.times_s <= act.end_s))

    def longest_off_s(self, act: Performed) -> float:
        """The longest time without interruption in which the hand is off by more than is allowed."""
        limit = LOST_M.get(len(self.views), LOST_OTHERWISE_M)
        off = (np.linalg.norm(self.hand_errors, axis=1) > limit) & self.frames_of(act)
        longest = run = 0
        for one in off:
            run = run + 1 if one else 0
            longest = max(longest, run)
        return longest / self.rate_hz

    def is_lost(self, act: Performed) -> bool:
        """Whether a performance is lost."""
        return self.longest_off_s(act) >= LOST_S - 1e-9

    def reports_lost(self, act: Performed) -> bool:
        """Whether the tracker reports in a performance that it lost the arm."""
        return bool(self.reported_lost[self.frames_of(act)].any())

    def detection(self, act: Performed, index: int) -> dict[str, Any] | None:
        """The detected target whose time is nearest to when the hand arrives at a target, None if none is near."""
        first, last = act.arrives_s[index] - TARGET_MARGIN_S, act.leaves_s[index] + TARGET_MARGIN_S
        near = [one for one in self.detected if first <= one["time_s"] <= last]
        return min(near, key=lambda one: abs(one["time_s"] - act.arrives_s[index])) if near else None

    def target_error(self, act: Performed, index: int) -> float:
        """Distance of a detected from the true target, m; infinite where none was detected."""
        detected = self.detection(act, index)
        return float("inf") if detected is None else self._apart(np.array(detected["place"]), act.targets[index])

    def target_errors(self) -> list[float]:
        """Of all targets of all performances, m."""
        return [self.target_error(act, index) for act in self.acts for index in range(len(act.targets))]

    def target_angles(self) -> list[float]:
        """Between the directions of detected and true targets from the shoulder, rad; infinite where none is."""
        angles = []
        for act in self.acts:
            for index, true in enumerate(act.targets):
                detected = self.detection(act, index)
                angles.append(float("inf") if detected is None else self._angle(np.array(detected["place"]), true))
        return angles

    def _angle(self, first: Floats, second: Floats) -> float:
        """Between two positions, from the shoulder at the beginning, rad."""
        lines = np.stack([first, second]) - self.true_poses[0, :3]
        across = np.linalg.norm(np.cross(lines[0], lines[1]))
        return float(np.arctan2(across, lines[0] @ lines[1]))

    def model_errors(self) -> list[float]:
        """Of the targets that the models infer from all true poses at once, m: what no tracker can do much better."""
        return [
            self._apart(act.from_true_poses, act.targets[0]) for act in self.acts if act.from_true_poses is not None
        ]

    def _apart(self, position: Floats, true: Floats) -> float:
        """Between two positions, m; without the distance from the shoulder for a recorded person's target."""
        if self.kind in ("recorded", BY_OTHERS):
            shoulder = self.true_poses[0, :3]
            line = position - shoulder
            position = shoulder + np.linalg.norm(true - shoulder) / np.linalg.norm(line) * line
        return float(np.linalg.norm(position - true))

    def posterior_at(self, action: str, time_s: float) -> float:
        """Of an action in the last frame that is not later than a time."""
        frame = max(int(np.searchsorted(self.times_s, time_s + 1e-9)) - 1, 0)
        return float(self.actions[action][frame])

    def recognised(self, act: Performed) -> bool:
        """Whether the performed action is the more probable one when the object is grasped (6.7.2)."""
        return self.posterior_at(act.action, act.grasp_s) > RECOGNISED

    def reported_dual(self, act: Performed) -> bool:
        """Whether a target was reported with a redirect: shortly after redirecting was more than half-way (6.7.3)."""
        late = self.times_s[self.frames_of(act) & (self._late_redirect > RECOGNISED)]
        return any(
            bool(np.any((late <= one["said_s"] + 1e-9) & (late >= one["said_s"] - TARGET_MARGIN_S)))
            for one in self._reported(act)
        )

    def named_dual(self, act: Performed) -> bool:
        """Whether the first report of a target names redirecting; the grammar may have gone on to withdrawing."""
        return any(one["actions"][0] == REDIRECT for one in self._reported(act))

    def late_redirect(self, act: Performed) -> float:
        """Maximum posterior of redirecting with progress above one half, within a performance (6.7.3)."""
        return float(self._late_redirect[self.frames_of(act)].max())

    def _reported(self, act: Performed) -> list[dict[str, Any]]:
        """Targets that the hand reached within a performance or not later than half a second after it."""
        return [one for one in self.detected if act.start_s <= one["time_s"] <= act.end_s + TARGET_MARGIN_S]

    @property
    def _late_redirect(self) -> Floats:
        histogram = self.tau[REDIRECT]
        return np.asarray(histogram[:, histogram.shape[1] // 2 :].sum(axis=1))

    def sight_errors(self) -> tuple[Floats, Floats]:
        """Of a single view: errors of the hand along the line of sight, away positive, and across it. (T,), (T,)."""
        assert self.sight is not None
        line = self.true_poses[:, -3:] - np.array(self.sight["position"])
        line = line / np.linalg.norm(line, axis=1, keepdims=True)
        along = (self.hand_errors * line).sum(axis=1)
        across = np.linalg.norm(self.hand_errors - along[:, None] * line, axis=1)
        return np.asarray(along), np.asarray(across)


def _performed(act: Mapping[str, Any]) -> Performed:
    grasp, inferred = act["grasp_s"], act.get("from_true_poses")
    return Performed(
        str(act["action"]),
        float(act["start_s"]),
        float(act["end_s"]),
        np.array(act["targets"]),
        np.array(act["arrives_s"]),
        np.array(act["leaves_s"]),
        float("nan") if grasp is None else float(grasp),
        None if inferred is None else np.array(inferred),
    )
