"""How well a movement reconstructed from several cameras agrees with their images, and with a camera left out."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from paramove.cameras import CalibratedCamera
from paramove.documents import Floats
from paramove.observation import ArmMovement, BodyKeyPoints, reconstructed
from studies.multicam.cameras import RATE_HZ, moved_centre

ROUNDS = 3
EXCHANGED, SEED = 0.25, 0
BONES = ("upper arm", "forearm", "wrist to the middle of the hand")
Tracks = Sequence[Sequence[BodyKeyPoints]]


def with_offsets(cameras: Sequence[CalibratedCamera], tracks: Tracks) -> tuple[list[CalibratedCamera], Floats]:
    """The cameras with the constant offset of each image that explains the first half of the movement; (K, 2), px.

    The file's principal points disagree with the videos by up to 16 px.
    """
    half, offsets, moved = [one[: len(one) // 2] for one in tracks], np.zeros((len(cameras), 2)), list(cameras)
    for _ in range(ROUNDS):
        movement = _reconstructed(moved, half)
        for number, (camera, track) in enumerate(zip(moved, half, strict=True)):
            offsets[number] += np.nanmedian(_residuals(camera, movement, number, track).reshape(-1, 2), axis=0)
        moved = [moved_centre(camera, offset) for camera, offset in zip(cameras, offsets, strict=True)]
    return moved, offsets


def numbers_of(cameras: Sequence[CalibratedCamera], tracks: Tracks) -> dict[str, Any]:
    """All numbers as plain JSON; those with offsets are judged on the half that did not determine them."""
    moved, offsets = with_offsets(cameras, tracks)
    rest = [one[len(one) // 2 :] for one in tracks]
    whole, judged = _reconstructed(moved, tracks), _reconstructed(moved, rest)
    names = [camera.name for camera in cameras]
    left_out = {}
    for number, name in enumerate(names):
        others = [one for one in range(len(cameras)) if one != number]
        movement = _reconstructed([moved[one] for one in others], [rest[one] for one in others])
        seen_as = ArmMovement(movement.times_s, movement.points, judged.sides[number : number + 1])
        left_out[name] = _median_px(_residuals(moved[number], seen_as, 0, rest[number]))
    return {
        "offsets_px": dict(zip(names, offsets.round(1).tolist(), strict=True)),
        "reprojection_px": _reprojection(moved, judged, rest),
        "reprojection_without_offsets_px": _reprojection(cameras, _reconstructed(cameras, rest), rest),
        "deviation_of_lengths_cm": dict(zip(BONES, (100.0 * whole.lengths.std(axis=0)).round(1).tolist(), strict=True)),
        "lengths_cm": dict(zip(BONES, (100.0 * whole.lengths.mean(axis=0)).round(1).tolist(), strict=True)),
        "left_out_px": left_out,
        "exchanged_or_of_nothing": dict(zip(names, (whole.sides > 0).sum(axis=1).tolist(), strict=True)),
        "exchanges": _exchanges(moved, tracks, whole),
    }


def _exchanges(cameras: Sequence[CalibratedCamera], tracks: Tracks, before: ArmMovement) -> dict[str, int]:
    """How many of the images whose sides are exchanged on purpose, in all views, are found to be."""
    rng, counts = np.random.default_rng(SEED), {"exchanged": 0, "found": 0, "wrongly_found": 0}
    chosen = rng.random(before.sides.shape) < EXCHANGED
    mixed = [
        [one.exchanged() if swap else one for one, swap in zip(track, row, strict=True)]
        for track, row in zip(tracks, chosen, strict=True)
    ]
    after = _reconstructed(cameras, mixed)
    clear = before.sides == 0  # where the network itself has them right
    counts["exchanged"] = int((chosen & clear).sum())
    counts["found"] = int((chosen & clear & (after.sides == 1)).sum())
    counts["wrongly_found"] = int((~chosen & clear & (after.sides == 1)).sum())
    return counts


def _reconstructed(cameras: Sequence[CalibratedCamera], tracks: Tracks) -> ArmMovement:
    return reconstructed(cameras, np.arange(len(tracks[0])) / RATE_HZ, tracks)


def _residuals(camera: CalibratedCamera, movement: ArmMovement, number: int, track: Sequence[BodyKeyPoints]) -> Floats:
    """Detected minus projected points, (T, 4, 2), px; NaN in images of nothing."""
    sides = movement.sides[number]
    rows = [
        one.positions[side] if side in (0, 1) else np.full((4, 2), np.nan)
        for one, side in zip(track, sides, strict=True)
    ]
    return np.asarray(np.array(rows) - camera.project(movement.points))


def _reprojection(cameras: Sequence[CalibratedCamera], movement: ArmMovement, tracks: Tracks) -> float:
    rows = [_residuals(camera, movement, number, tracks[number]) for number, camera in enumerate(cameras)]
    return _median_px(np.array(rows))


def _median_px(residuals: Floats) -> float:
    return round(float(np.nanmedian(np.linalg.norm(residuals, axis=-1))), 1)
