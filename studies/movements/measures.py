"""Numbers for single movements: synthesis, parameters, regions, rejection."""

from __future__ import annotations

from typing import Literal

import numpy as np
from scipy.stats import chi2, rankdata

from paramove.alignment import movement_distance
from paramove.documents import Floats
from paramove.hmm import resample
from studies.movements.method import FRAMES, Estimate

ThetaKind = Literal["direction", "place", "raster"]

GRID_CM = np.array([80.0, 30.0])
"""Width and depth of the synthetic demonstrator's grid, whose coordinates run from 0 to 1."""


def synthesis_errors(synthesised: Floats, recorded: Floats, tip: int) -> dict[str, float]:
    """A synthesised movement (100, D) against a recorded one (T, D), cm.

    dtw, dtw_cut: root mean square over the body points after time warping, of all frames and without 15 % at both
    ends; rms: frame by frame at equal fractions of the duration; tip_rms: the same of the fingertip alone; end:
    distance of the fingertips in the last frame.
    """
    truth = resample(recorded, FRAMES)
    difference = (synthesised - truth).reshape(FRAMES, -1, 3)
    distances = np.linalg.norm(difference, axis=2)
    points = difference.shape[1]
    return {
        "dtw": 100.0 * movement_distance(synthesised, truth, n_points=points, cut=0.0),
        "dtw_cut": 100.0 * movement_distance(synthesised, truth, n_points=points, cut=0.15),
        "rms": 100.0 * float(np.sqrt((distances**2).mean())),
        "tip_rms": 100.0 * float(np.sqrt((distances[:, tip] ** 2).mean())),
        "end": 100.0 * float(distances[-1, tip]),
    }


def theta_error(estimated: Floats, true: Floats, kind: ThetaKind) -> float:
    """Angle between directions (azimuth, elevation) in degrees, or distance of positions in cm."""
    if kind == "direction":
        cosine = float(_unit(estimated) @ _unit(true))
        return float(np.degrees(np.arccos(np.clip(cosine, -1.0, 1.0))))
    scale = GRID_CM if kind == "raster" else 100.0
    return float(np.linalg.norm((estimated - true) * scale))


def _unit(direction: Floats) -> Floats:
    azimuth, elevation = direction
    flat = np.cos(elevation)
    return np.array([flat * np.cos(azimuth), flat * np.sin(azimuth), np.sin(elevation)])


def covered(estimate: Estimate, true: Floats, fraction: float = 0.95) -> float | None:
    """1 if the true theta lies in the region of this probability, else 0; None without one."""
    if estimate.covariance is None:
        return None
    return float(squared_deviations(estimate.theta, estimate.covariance, true) <= chi2.ppf(fraction, len(true)))


def squared_deviations(theta: Floats, covariance: Floats, true: Floats) -> float:
    """Squared distance of the true theta in deviations; infinite for what is no covariance."""
    difference = true - theta
    try:
        squared = float(difference @ np.linalg.solve(covariance, difference))
    except np.linalg.LinAlgError:
        return np.inf
    return squared if squared >= 0.0 else np.inf


def auroc(genuine: Floats, others: Floats) -> float:
    """Probability that a genuine movement scores higher than another one; ties count half."""
    ranks = rankdata(np.concatenate([genuine, others]))
    n, m = len(genuine), len(others)
    return float((ranks[:n].sum() - n * (n + 1) / 2.0) / (n * m))
