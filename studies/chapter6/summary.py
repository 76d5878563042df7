"""The numbers of the report on chapter 6, from all tracks."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from paramove.documents import Floats
from sim.persons.performances import KINDS
from studies.chapter6.experiments import ALL_VIEWS, TRACKED_KINDS
from studies.chapter6.measures import DUAL, LOST_M, RECOGNISED, Track

FOUR, SINGLE, TWO = "four views", "single views", "cameras 2 and 4"
TABLE_KINDS = ("pointing", "pouring", "box", "complex")
"""Seen by four cameras, with targets within reach."""
SLOW_KINDS = tuple(kind.name for kind in KINDS if not kind.one_view)
FAST_KIND = "pointing_50fps"
TRACKED_CM = 100.0 * LOST_M[1]
"""Frames with a greater error are those of a lost arm: the part along the line of sight is then chance."""
PHASES = ("elsewhere", "at the target")


def case_of(track: Track) -> str:
    """Which sets of views belong together in the tables: all four, two, or one of the four."""
    return FOUR if track.views == ALL_VIEWS else SINGLE if len(track.views) == 1 else TWO


def chosen(
    tracks: Iterable[Track],
    *,
    kinds: Sequence[str] | None = None,
    case: str | None = None,
    likelihood: str = "matched",
) -> list[Track]:
    """The tracks of some kinds and views with one likelihood."""
    return [
        track
        for track in tracks
        if track.likelihood == likelihood
        and (kinds is None or track.kind in kinds)
        and (case is None or case_of(track) == case)
    ]


def summarised(tracks: Sequence[Track]) -> dict[str, Any]:
    """All numbers; lengths in cm, angles in degrees."""
    return {
        "cases": cases(tracks),
        "table 6.1": table_6_1(chosen(tracks, kinds=[FAST_KIND])),
        "recognition": {case: recognition(chosen(tracks, kinds=["box"], case=case)) for case in (FOUR, SINGLE, TWO)},
        "complex": {case: dual(chosen(tracks, kinds=["complex"], case=case)) for case in (FOUR, SINGLE, TWO)},
        "models": models(tracks),
        "tracks": [track_numbers(track) for track in tracks],
        "cameras": cameras(chosen(tracks, kinds=SLOW_KINDS, case=SINGLE)),
    }


def models(tracks: Sequence[Track]) -> dict[str, Any]:
    """For each kind the errors, cm, of the target that the model infers from all true poses of an execution at once."""
    errors_by_kind = {}
    for kind in TRACKED_KINDS:
        clips = {track.clip: track for track in tracks if track.kind == kind}
        errors = 100.0 * np.array([error for track in clips.values() for error in track.model_errors()])
        if len(errors):
            errors_by_kind[kind] = {"of": len(errors), "median": quantile(errors, 0.5), "p90": quantile(errors, 0.9)}
    return errors_by_kind


def track_numbers(track: Track) -> dict[str, Any]:
    """One track: errors in cm, and of each performance the longest time for which the hand was off, s."""
    return {
        "clip": track.clip,
        "kind": track.kind,
        "views": [view + 1 for view in track.views],
        "likelihood": track.likelihood,
        "held_out": track.split == "held_out",
        "hand_rms": (100.0 * np.sqrt((track.hand_errors**2).mean(axis=0))).tolist(),
        "targets": [100.0 * error for error in track.target_errors()],
        "off_s": [track.longest_off_s(act) for act in track.acts],
        "lost": [track.is_lost(act) for act in track.acts],
        "said_lost": [track.reports_lost(act) for act in track.acts],
    }


def cases(tracks: Sequence[Track]) -> list[dict[str, Any]]:
    """One row for each kind, views and likelihood; single views together and one by one."""
    rows = []
    for kind in TRACKED_KINDS:
        for likelihood in ("matched", "simple"):
            own = chosen(tracks, kinds=[kind], likelihood=likelihood)
            for name, part in _by_views(own).items():
                rows.append({"kind": kind, "views": name, "likelihood": likelihood, **accuracy(part)})
    return rows


def _by_views(tracks: Sequence[Track]) -> dict[str, list[Track]]:
    parts = {case: [one for one in tracks if case_of(one) == case] for case in (FOUR, TWO, SINGLE)}
    for camera in range(4):
        parts[f"camera {camera + 1}"] = [one for one in tracks if one.views == (camera,)]
    return {name: part for name, part in parts.items() if part}


def accuracy(tracks: Sequence[Track]) -> dict[str, Any]:
    """Errors of the hand and of targets, lost performances; everything pooled over the tracks."""
    errors = 100.0 * np.concatenate([track.hand_errors for track in tracks])
    apart = np.linalg.norm(errors, axis=1)
    targets = 100.0 * np.array([error for track in tracks for error in track.target_errors()])
    angles = np.degrees([angle for track in tracks for angle in track.target_angles()])
    acts = [(track, act) for track in tracks for act in track.acts]
    lost = [track.is_lost(act) for track, act in acts]
    reported = [track.reports_lost(act) for track, act in acts]
    return {
        "tracks": len(tracks),
        "performances": len(acts),
        "hand_rms": np.sqrt((errors**2).mean(axis=0)).tolist(),
        "hand_median": float(np.median(apart)),
        "hand_p90": quantile(apart, 0.9),
        "pose_rms": float(100.0 * np.sqrt(np.mean(np.concatenate([one.pose_errors for one in tracks]) ** 2))),
        "targets": len(targets),
        "target_median": quantile(targets, 0.5),
        "target_p90": quantile(targets, 0.9),
        "target_median_deg": quantile(angles, 0.5),
        "undetected": int(np.isinf(targets).sum()),
        "lost": int(np.sum(lost)),
        "said_lost": int(np.sum(reported)),
        "lost_and_said": int(np.sum(np.logical_and(lost, reported))),
        "effective_median": float(np.median(np.concatenate([track.effective for track in tracks]))),
        "ms": float(1e3 * np.median(np.concatenate([track.seconds for track in tracks]))),
    }


def quantile(values: Floats, fraction: float) -> float:
    """The smallest value that at least this fraction of the values does not exceed; infinite ones count."""
    return float(np.quantile(values, fraction, method="inverted_cdf"))


def table_6_1(tracks: Sequence[Track]) -> dict[str, Any] | None:
    """Mean, RMS and maximum absolute error of the hand per axis, cm: at 50 fps, of one view."""
    if not tracks:
        return None
    parts_of = {
        "median": [track.median_errors for track in tracks],
        "estimate": [track.best_errors for track in tracks],
        "refined": [track.hand_errors for track in tracks],
    }
    rows = {}
    for name, parts in parts_of.items():
        errors = 100.0 * np.concatenate(parts)
        rows[f"{name}: mean"] = np.abs(errors).mean(axis=0).tolist()
        rows[f"{name}: RMS"] = np.sqrt((errors**2).mean(axis=0)).tolist()
        rows[f"{name}: max"] = np.abs(errors).max(axis=0).tolist()
    return rows


def recognition(tracks: Sequence[Track]) -> dict[str, Any] | None:
    """How many of the carrying actions are recognised when the object is grasped."""
    acts = [(track, act) for track in tracks for act in track.acts]
    if not acts:
        return None
    right = [track.recognised(act) for track, act in acts]
    return {"of": len(right), "right": int(np.sum(right)), "share": float(np.mean(right))}


def dual(tracks: Sequence[Track]) -> dict[str, Any] | None:
    """How many simple and dual pointing actions are recognised, and the errors of both targets of the dual, cm."""
    acts = [(track, act) for track in tracks for act in track.acts]
    if not acts:
        return None
    right = [track.reported_dual(act) == (act.action == DUAL) for track, act in acts]
    named = [track.named_dual(act) == (act.action == DUAL) for track, act in acts]
    late = [(track.late_redirect(act) > RECOGNISED) == (act.action == DUAL) for track, act in acts]
    both = [[100.0 * track.target_error(act, index) for index in (0, 1)] for track, act in acts if act.action == DUAL]
    medians = [quantile(errors, 0.5) for errors in np.array(both).reshape(-1, 2).T] if both else [np.nan, np.nan]
    return {
        "of": len(right),
        "right": int(np.sum(right)),
        "share": float(np.mean(right)),
        "share by the posterior": float(np.mean(late)),
        "share by the name": float(np.mean(named)),
        "dual": len(both),
        "first_median": medians[0],
        "second_median": medians[1],
    }


def cameras(tracks: Sequence[Track]) -> dict[str, Any]:
    """For each camera alone: errors of the hand along the line of sight and across it, and where; its size."""
    by_camera = {}
    for camera in range(4):
        own = [track for track in tracks if track.views == (camera,)]
        if own:
            by_camera[f"camera {camera + 1}"] = _of_camera(own)
    return by_camera


def _of_camera(tracks: Sequence[Track]) -> dict[str, Any]:
    pairs = [track.sight_errors() for track in tracks]
    along = 100.0 * np.concatenate([one for one, _ in pairs])
    across = 100.0 * np.concatenate([one for _, one in pairs])
    errors = 100.0 * np.concatenate([track.hand_errors for track in tracks])
    still = np.concatenate([at_targets(track) for track in tracks])
    distance = np.concatenate([_distances(track) for track in tracks])
    focal = float(np.mean([_sight(track)["focal_px"] for track in tracks]))
    squared = along**2 + across**2
    tracked = squared < TRACKED_CM**2
    deviations = [track.hand_deviations[track.frames_of(act)] for track in tracks for act in track.acts]
    return {
        "depth_rms": _rms(along),
        "across_rms": _rms(across),
        "depth_share": float((along**2).sum() / max(float(squared.sum()), 1e-12)),
        "depth_rms_of_kept": _rms(along[tracked]),
        "across_rms_of_kept": _rms(across[tracked]),
        "depth_share_of_kept": float((along[tracked] ** 2).sum() / max(float(squared[tracked].sum()), 1e-12)),
        "deviations": (100.0 * np.concatenate(deviations).mean(axis=0)).tolist(),
        "hand_rms": np.sqrt((errors**2).mean(axis=0)).tolist(),
        **{
            f"depth_rms {phase}": _rms(along[where])
            for phase, where in zip(PHASES, (~still, still), strict=True)
            if where.any()
        },
        "distance_m": float(distance.mean()),
        "px_per_5cm_across": focal * 0.05 / float(distance.mean()),
        "share_larger_per_5cm_depth": 0.05 / float(distance.mean()),
        "lost": int(sum(track.is_lost(act) for track in tracks for act in track.acts)),
        "performances": sum(len(track.acts) for track in tracks),
    }


def at_targets(track: Track) -> NDArray[np.bool_]:
    """Frames in which the hand is at a target, (T,)."""
    still = np.zeros(len(track.times_s), dtype=np.bool_)
    for act in track.acts:
        for arrives, leaves in zip(act.arrives_s, act.leaves_s, strict=True):
            still |= (track.times_s >= arrives) & (track.times_s <= leaves)
    return still


def _distances(track: Track) -> Floats:
    away = track.true_poses[:, -3:] - np.array(_sight(track)["position"])
    return np.asarray(np.linalg.norm(away, axis=1))


def _sight(track: Track) -> Mapping[str, Any]:
    assert track.sight is not None
    return track.sight


def _rms(values: Floats) -> float:
    return float(np.sqrt(np.mean(values**2))) if len(values) else float("nan")
