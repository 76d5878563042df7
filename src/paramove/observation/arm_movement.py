"""The whole movement of an arm from the key points of one or several cameras: for recordings that teach.

The most probable path of shoulder, elbow, wrist and hand given all images at once: a smooth one (white acceleration),
detected with the network's noise, its depths with a constant error, exchanged sides and outliers, with bones of
constant length if they are known, and with the fingertip at a known position at the end if it touches one. Gauss-Newton
steps on a banded system.
"""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from scipy.linalg import solveh_banded

from paramove.cameras import CalibratedCamera, StereoRig
from paramove.documents import Floats, InputError, Ints
from paramove.observation.arm_body import ArmSizes
from paramove.observation.body_key_points import ARM_POINTS, SIDES, BodyKeyPoints
from paramove.observation.key_point_observer import MIN_INLIER, KeyPointObserver, KeyPointOptions

POINTS, DIMENSIONS = len(ARM_POINTS), 3 * len(ARM_POINTS)
SHOULDER, ELBOW, WRIST, HAND = range(POINTS)
SPEED_CHANGES = np.array([1.0, 3.0, 4.0, 4.0])
"""Deviation of the acceleration of the points, m/s², of movements that teach."""
LENGTH_M, TOUCH_M, REST_M, HANGS_M = 0.01, 0.003, 0.03, 0.1
"""Deviation of a bone's length, of a fingertip from what it touches, of the shoulder from where it rests, of a hanging
hand from below it."""
STEPS = 12
JUMP_M, JUMP_FRAMES = 0.25, 9
"""A first guess that is so far from its median over so many images comes from exchanged sides."""
COARSE_M, FINE_M = 0.2, 0.02
"""By how much the path may be off in the first step, and in the last ones, where sides and outliers are judged."""


@dataclass(frozen=True)
class ArmMovement:
    """A path of an arm.

    Attributes:
        times_s: (T,).
        points: Shoulder, elbow, wrist, middle of the hand, (T, 4, 3), m, in the world.
        sides: Whose points are the arm's in each image, (K, T): 0 as named, 1 exchanged, 2 none of it, -1 no image.
    """

    times_s: Floats
    points: Floats
    sides: Ints

    @property
    def fingertip(self) -> Floats:
        """As far beyond the middle of the hand as the wrist is before it, (T, 3), m."""
        return np.asarray(2.0 * self.points[:, HAND] - self.points[:, WRIST])

    @property
    def lengths(self) -> Floats:
        """Upper arm, forearm, wrist to the middle of the hand, (T, 3), m."""
        return np.asarray(np.linalg.norm(np.diff(self.points, axis=1), axis=2))


def reconstructed(
    cameras: Sequence[CalibratedCamera], times_s: ArrayLike, key_points: Sequence[Sequence[BodyKeyPoints | None]], *,
    sizes: ArmSizes | None = None, shoulder: ArrayLike | None = None, touched: tuple[ArrayLike, float] | None = None,
    hangs_until_s: float = -np.inf,
) -> ArmMovement:  # fmt: skip
    """The movement of a right arm.

    Args:
        cameras: One or more. times_s: of the images, increasing, (T,).
        key_points: Of each camera, of each time; None for a missing image.
        sizes: Of the arm; without, the bones' lengths are free, which needs two cameras.
        shoulder: Where it rests, (3,), m; needed with one camera.
        touched: Where the fingertip is at the end, (3,), m, and from which time on, s.
        hangs_until_s: Until then the arm hangs down from the shoulder; used if sizes are given.

    Raises InputError for too few images, or for one camera without sizes or shoulder.
    """
    times = np.asarray(times_s, dtype=np.float64)
    if len(times) < 3 or not (np.diff(times) > 0.0).all() or any(len(one) != len(times) for one in key_points):
        raise InputError(f"three or more increasing times and key points of each expected, found {len(times)} times")
    if len(cameras) == 1 and (sizes is None or shoulder is None):
        raise InputError("one camera gives no depth: the arm's sizes and the position of the shoulder are needed")
    comparing = KeyPointObserver(sizes or ArmSizes(), cameras, KeyPointOptions(wrist=1e-3))
    rest = None if shoulder is None else np.asarray(shoulder, dtype=np.float64)
    points = _first_guess(cameras, key_points, sizes or ArmSizes(), rest)
    sides = np.full((len(cameras), len(times)), -1)
    too_deep = np.zeros((len(cameras), POINTS))
    for step in range(STEPS):
        model = max(FINE_M, COARSE_M * 0.5**step)
        system = _System(times)
        for number, camera in enumerate(cameras):
            for frame, detected in enumerate(key_points[number]):
                if detected is not None and detected.has_person:
                    sides[number, frame] = _see(
                        system, comparing, camera, frame, points[frame], detected, model, too_deep[number]
                    )
            too_deep[number] = _depth_errors(camera, points, key_points[number], sides[number])
        if sizes is not None:
            for bone, length in enumerate((sizes.upper_arm, sizes.forearm, 0.5 * sizes.hand)):
                system.add_length(points, bone, length)
            hanging = slice(0, int(np.searchsorted(times, hangs_until_s)))
            down = np.array([0.0, 0.0, -(sizes.upper_arm + sizes.forearm + 0.5 * sizes.hand)])
            system.add_position(points, hanging, {HAND: 1.0, SHOULDER: -1.0}, down, HANGS_M)
        if rest is not None:
            system.add_position(points, slice(None), {SHOULDER: 1.0}, rest, REST_M)
        if touched is not None:
            there, tip = np.asarray(touched[0], dtype=np.float64), {HAND: 2.0, WRIST: -1.0}
            last = slice(min(int(np.searchsorted(times, touched[1])), len(times) - 1), None)
            system.add_position(points, last, tip, there, TOUCH_M)
        points = points + system.solved(points)
    return ArmMovement(times, points, sides)


def _see(
    system: _System, comparing: KeyPointObserver, camera: CalibratedCamera, frame: int, arm: Floats,
    detected: BodyKeyPoints, model: float, too_deep: Floats,
) -> int:  # fmt: skip
    """Adds the key points of an image, of the side that is the likelier one; that side.

    `too_deep`: constant error of the depths of each point, (4,), m.
    """
    own, total = comparing.densities(arm[None], camera, detected, model)
    side = int(comparing.hypotheses(total)[:, 0].argmax())
    if side >= len(SIDES):
        return side
    weights = np.exp(own - total)[side, 0]
    turn = camera.camera_from_world[:3, :3]
    local = arm @ turn.T + camera.camera_from_world[:3, 3]
    scale = np.diag(camera.matrix)[:2]
    for point in np.flatnonzero(weights > MIN_INLIER):
        x, y, z = local[point]
        if z <= 0.0:
            continue
        slopes = scale[:, None] * (turn[:2] - np.array([[x / z], [y / z]]) * turn[2]) / z
        off = detected.positions[side, point] - camera.project(arm[point])
        rows = np.zeros((2, DIMENSIONS))
        rows[:, 3 * point : 3 * point + 3] = slopes
        system.add(frame, rows, off, weights[point] / detected.deviations[side, point] ** 2)
        deviation = comparing.options.depths[point]
        depth = detected.depths_at(local[SHOULDER, 2], scale[0])[side, point]
        if np.isfinite(deviation) and np.isfinite(depth):
            row = np.zeros((1, DIMENSIONS))
            row[0, 3 * point : 3 * point + 3], row[0, :3] = turn[2], -turn[2]
            behind = depth - too_deep[point] - (z - local[SHOULDER, 2])
            system.add(frame, row, np.array([behind]), weights[point] / deviation**2)
    return side


def _depth_errors(
    camera: CalibratedCamera, points: Floats, detected: Sequence[BodyKeyPoints | None], sides: Ints
) -> Floats:
    """By how much a camera's points are detected too far behind the shoulder in the whole movement, (4,), m.

    The most probable constant error, which is as large as those of single images.
    """
    ahead = camera.depths(points)
    behind = ahead - ahead[:, :1]
    off = [
        one.depths_at(at[SHOULDER], camera.matrix[0, 0])[side] - found
        for one, side, at, found in zip(detected, sides, ahead, behind, strict=True)
        if one is not None and 0 <= side < len(SIDES)
    ]
    return np.asarray(np.nansum(off, axis=0) / (len(off) + 1.0)) if off else np.zeros(POINTS)


class _System:
    """Normal equations of a path: blocks of each frame, and of its acceleration."""

    def __init__(self, times: Floats) -> None:
        self._times = times
        self._blocks = np.zeros((len(times), DIMENSIONS, DIMENSIONS))
        self._right = np.zeros((len(times), DIMENSIONS))

    def add(self, frame: int, rows: Floats, off: Floats, weight: float) -> None:
        """Rows (R, 12) of slopes in the points of a frame, and what is missing, (R,)."""
        self._blocks[frame] += weight * rows.T @ rows
        self._right[frame] += weight * rows.T @ off

    def add_length(self, points: Floats, bone: int, length: float) -> None:
        """The length of a bone in all frames, m."""
        along = points[:, bone + 1] - points[:, bone]
        found = np.linalg.norm(along, axis=1)
        for frame, (line, size) in enumerate(zip(along, found, strict=True)):
            row = np.zeros((1, DIMENSIONS))
            row[0, 3 * bone + 3 : 3 * bone + 6] = line / max(size, 1e-6)
            row[0, 3 * bone : 3 * bone + 3] = -row[0, 3 * bone + 3 : 3 * bone + 6]
            self.add(frame, row, np.array([length - size]), LENGTH_M**-2.0)

    def add_position(
        self, points: Floats, frames: slice, parts: dict[int, float], position: Floats, deviation: float
    ) -> None:
        """A sum of points at a position, (3,), m, in some frames."""
        rows = np.zeros((3, DIMENSIONS))
        for point, factor in parts.items():
            rows[:, 3 * point : 3 * point + 3] = factor * np.eye(3)
        for frame in range(len(points))[frames]:
            self.add(frame, rows, position - rows @ points[frame].ravel(), deviation**-2.0)

    def solved(self, points: Floats) -> Floats:
        """The step (T, 4, 3), m, with smooth acceleration."""
        count = len(self._times)
        bands = np.zeros((3 * DIMENSIONS, count * DIMENSIONS))
        right = self._right.copy()
        for at in range(DIMENSIONS):  # the blocks on the diagonal
            for below in range(DIMENSIONS - at):
                bands[below, at::DIMENSIONS] += self._blocks[:, at + below, at]
        flat, steps = points.reshape(count, DIMENSIONS), np.diff(self._times)
        before, after = steps[:-1], steps[1:]
        parts = np.stack([2 / (before * (before + after)), -2 / (before * after), 2 / (after * (before + after))])
        # White acceleration: its variance per frame grows with the rate.
        weights = np.repeat(SPEED_CHANGES, 3) ** -2.0 * (0.5 * (before + after))[:, None] / 0.1
        acceleration = sum(parts[i][:, None] * flat[i : count - 2 + i] for i in range(3))
        for i in range(3):
            right[i : count - 2 + i] -= weights * parts[i][:, None] * acceleration
            for j in range(i + 1):
                columns = (np.arange(j, count - 2 + j)[:, None] * DIMENSIONS + np.arange(DIMENSIONS)).ravel()
                bands[(i - j) * DIMENSIONS, columns] += (weights * (parts[i] * parts[j])[:, None]).ravel()
        bands[0] += 1e-6
        return np.asarray(solveh_banded(bands, right.ravel(), lower=True).reshape(count, POINTS, 3))


def _first_guess(
    cameras: Sequence[CalibratedCamera], key_points: Sequence[Sequence[BodyKeyPoints | None]], sizes: ArmSizes,
    shoulder: Floats | None,
) -> Floats:  # fmt: skip
    """Where two cameras' rays meet; with one, along its rays by the network's depths. Gaps are filled linearly."""
    detected = np.array(
        [[np.full((POINTS, 2), np.nan) if one is None else one.positions[0] for one in row] for row in key_points]
    )  # (K, T, 4, 2)
    count = detected.shape[1]
    if len(cameras) > 1:
        flat = detected.reshape(len(cameras), -1, 2)
        points = StereoRig(cameras).triangulate(flat).points.reshape(count, POINTS, 3)
    else:
        assert shoulder is not None
        points = np.stack([_along_rays(cameras[0], one, shoulder) for one in key_points[0]])
    points = _without_jumps(points)
    if shoulder is None and not np.isfinite(points[:, SHOULDER]).any():
        raise InputError("no image in which two cameras detect the shoulder: are all of them on, and is it in view?")
    lying = sizes.upper_arm * np.arange(POINTS)[:, None] * np.array([0.0, 0.0, -0.5])
    default = lying + (np.nanmedian(points[:, SHOULDER], axis=0) if shoulder is None else shoulder)
    frames = np.arange(count)
    for point in range(POINTS):
        for axis in range(3):
            column = points[:, point, axis]
            known = np.isfinite(column)
            filled = np.interp(frames, frames[known], column[known]) if known.any() else default[point, axis]
            points[:, point, axis] = filled
    return points


def _without_jumps(points: Floats) -> Floats:
    """NaN where a point (T, 4, 3) is farther than `JUMP_M` from its median over `JUMP_FRAMES`: sides were exchanged."""
    padded = np.pad(points, ((JUMP_FRAMES // 2, JUMP_FRAMES // 2), (0, 0), (0, 0)), constant_values=np.nan)
    windows = np.lib.stride_tricks.sliding_window_view(padded, JUMP_FRAMES, axis=0)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RuntimeWarning)  # a window may have no point at all
        off = np.linalg.norm(points - np.nanmedian(windows, axis=-1), axis=2)
    return np.where((off > JUMP_M)[..., None], np.nan, points)


def _along_rays(camera: CalibratedCamera, detected: BodyKeyPoints | None, shoulder: Floats) -> Floats:
    if detected is None:
        return np.full((POINTS, 3), np.nan)
    turn, shift = camera.camera_from_world[:3, :3], camera.camera_from_world[:3, 3]
    away = float((turn @ shoulder + shift)[2])
    depth = away + detected.depths_at(away, camera.matrix[0, 0])[0]
    rays = np.column_stack([camera.normalised(detected.positions[0]), np.ones(POINTS)])
    return np.asarray((depth[:, None] * rays - shift) @ turn)
