"""One clip tracked as an application would track it, and the stored estimates (thesis 6.7)."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from time import perf_counter
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from paramove.action_space import ActionTracker, DetectedTarget, PersonPlacement, TrackEstimate, track_frame
from paramove.observation import HAND, ArmObserver, Likelihood, ObservationOptions
from paramove.phmm import ParametricHMM
from sim.persons.clips import TABLE, Clip, read_clip
from sim.persons.performances import Act
from studies.chapter6.vocabularies import Knowledge, knowledge_of

LENGTH_DIGITS = 4
"""Lengths are stored in m to 0.1 mm."""


def tracked_clip(
    folder: Path, views: Sequence[int], likelihood: Likelihood = "matched", seed: int = 0, data: Path | None = None,
    known: str | None = None,
) -> dict[str, Any]:  # fmt: skip
    """Tracks the clip of a folder and returns estimates and truth of all frames as plain JSON.

    The tracker gets images, calibrated cameras, the measured sizes and the measured shoulder; truth is read after it
    has ended.

    Args:
        views: numbers of the cameras, from 0. seed: of the filter. data: folder of recorded people.
        known: kind whose models the tracker gets, see `knowledge_of`; by default that of the clip's kind.
    """
    clip = read_clip(folder)
    knowledge = knowledge_of(known or clip.kind, clip.number, data)
    follower = Follower(clip, views, knowledge, likelihood, seed)
    for time_s, images in zip(clip.times_s, clip.frames(views), strict=True):
        follower.see(float(time_s), [images[view] for view in views])
    return {"values": follower.estimates(), "truth": _truth(clip, knowledge), "sight": _sight(clip, views)}


class Follower:
    """Tracks one clip frame by frame and stores the estimates."""

    def __init__(
        self, clip: Clip, views: Sequence[int], knowledge: Knowledge, likelihood: Likelihood, seed: int
    ) -> None:
        self.placement = PersonPlacement.of_arm(clip.shoulder, clip.sizes.length)
        self._knowledge = knowledge
        cameras = [clip.cameras[view] for view in views]
        options = ObservationOptions(likelihood=likelihood)
        self._observer = ArmObserver(clip.sizes, cameras, options, table=TABLE, threads=1)
        self._tracker = ActionTracker(knowledge.vocabulary, knowledge.grammar, self.placement, seed=seed)
        self._estimates: list[TrackEstimate] = []
        self._detected: list[dict[str, Any]] = []
        self._seconds: list[float] = []

    def see(self, time_s: float, images: Sequence[NDArray[np.uint8] | None]) -> None:
        """One frame."""
        begin = perf_counter()
        self._observer.look(images)
        estimate = track_frame(self._tracker, self._observer, time_s)
        self._seconds.append(perf_counter() - begin)
        self._estimates.append(estimate)
        if estimate.target is not None:
            self._detect(time_s, estimate.target)

    def _detect(self, time_s: float, target: DetectedTarget) -> None:
        """The latest report of each target, the time of its first report, and all actions that it was reported with."""
        if not self._detected or self._detected[-1]["number"] != target.number:
            self._detected.append({"number": target.number, "said_s": round(time_s, 4), "actions": []})
        last = self._detected[-1]
        if target.action not in last["actions"]:
            last["actions"].append(target.action)
        position = self._knowledge.pointed(target.place, self.placement)
        last |= {
            "time_s": round(target.time_s, 4),
            "place": _lengths(position),
            "deviation": round(target.deviation, 4),
        }

    def estimates(self) -> dict[str, Any]:
        """All estimates, one entry per frame; lengths in m."""
        estimates, names = self._estimates, self._knowledge.vocabulary.names
        pointed = [self._knowledge.pointed(one.targets[one.action], self.placement) for one in estimates]
        posterior = np.array([[one.actions[name] for name in names] for one in estimates])
        histograms = np.array([one.tau_histogram for one in estimates])
        return {
            "times_s": [round(one.time_s, 4) for one in estimates],
            "poses": _lengths([one.pose[:9] for one in estimates]),
            "best_hands": _lengths([one.pose_best[HAND] for one in estimates]),
            "hand_deviations": _lengths([np.sqrt(np.diagonal(one.covariance)[HAND]) for one in estimates]),
            "effective": [round(one.effective_sample_size, 1) for one in estimates],
            "lost": [int(one.lost) for one in estimates],
            "actions": {name: np.round(posterior[:, i], 4).tolist() for i, name in enumerate(names)},
            "tau": {name: np.round(histograms[:, i], 3).tolist() for i, name in enumerate(names)},
            "theta_deviation": [round(one.theta[one.action].deviation, 4) for one in estimates],
            "pointed": _lengths(pointed),
            "detected": self._detected,
            "seconds": [round(one, 5) for one in self._seconds],
        }


def _truth(clip: Clip, knowledge: Knowledge) -> dict[str, Any]:
    truth = clip.truth
    return {
        "poses": _lengths(truth.poses),
        "acts": [
            {
                "action": act.action,
                "start_s": act.start_s,
                "end_s": act.end_s,
                "targets": _lengths(act.targets),
                "arrives_s": act.arrives_s.tolist(),
                "leaves_s": act.leaves_s.tolist(),
                "grasp_s": None if np.isnan(act.grasp_s) else act.grasp_s,
                "from_true_poses": target_from_true_poses(clip, act, knowledge),
            }
            for act in truth.acts
        ],
    }


def target_from_true_poses(clip: Clip, act: Act, knowledge: Knowledge) -> list[float] | None:
    """The target that the action's model infers from all true poses of a performance at once, (3,), m.

    No tracker can be expected to do much better: persons move otherwise than the model learned. None for an action
    that has no model of its own. A recorded person's model knows the path out only.
    """
    names = knowledge.vocabulary.names
    if act.action not in names:
        return None
    action = knowledge.vocabulary.actions[names.index(act.action)]
    if not isinstance(action.model, ParametricHMM):
        return None
    truth = clip.truth
    last_s = float(act.arrives_s[0]) if clip.kind == "recorded" else act.end_s
    inside = (clip.times_s >= act.start_s) & (clip.times_s <= last_s)
    placement = PersonPlacement.of_arm(truth.shoulder, truth.sizes.length)
    points = np.concatenate([truth.poses, truth.wrist], axis=1)[inside, : action.pose_size]
    theta = action.model.estimate(placement.in_model(points)).theta
    position = knowledge.pointed(placement.in_world(action.target(theta)), placement)
    target: list[float] = _lengths(position)
    return target


def _sight(clip: Clip, views: Sequence[int]) -> dict[str, Any] | None:
    """Of a single view: where the camera is, (3,), m, and its focal length, px."""
    if len(views) != 1:
        return None
    camera = clip.truth.cameras[views[0]]
    return {"position": _lengths(camera.position), "focal_px": round(float(camera.matrix[0, 0]), 1)}


def _lengths(values: ArrayLike) -> Any:
    return np.round(np.asarray(values, dtype=np.float64), LENGTH_DIGITS).tolist()
