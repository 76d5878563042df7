"""A folder of recordings of people that do not exist, with the layout of the real ones."""

from pathlib import Path

import numpy as np

from paramove.documents.array_types import Floats

TABLE_POINTS = ("sternum", "shoulder", "elbow", "wrist", "knuckle", "index", "thumb")
POINTING_POINTS = ("indexFinger", "hand", "forearm", "upperArm", "rightShoulder", "hmd", "leftShoulder")
RIGHT_SHOULDER = np.array([0.0, -0.2, 0.0])
"""Right shoulder of a person, body frame with the origin between the shoulders, m."""


def moved_arm(target: Floats, frames: int, size: float) -> Floats:
    """Shoulder, elbow, wrist, knuckle, index, thumb of a right arm in the body frame. Shape (frames, 6, 3), m."""
    start = size * np.array([0.25, -0.15, -0.25])
    share = np.linspace(0.0, 1.0, frames)
    share = 10 * share**3 - 15 * share**4 + 6 * share**5
    index = start + share[:, None] * (target - start)
    shoulder = np.broadcast_to(size * RIGHT_SHOULDER, index.shape)
    wrist = shoulder + 0.8 * (index - shoulder)
    middle = 0.5 * (shoulder + wrist)
    half = size * 0.30
    down = np.sqrt(np.maximum(half**2 - ((wrist - shoulder) ** 2).sum(axis=1) / 4.0, 0.0))
    elbow = middle - down[:, None] * np.array([0.0, 0.0, 1.0])
    return np.stack([shoulder, elbow, wrist, 0.5 * (wrist + index), index, index + np.array([0.0, 0.02, 0.0])], axis=1)


def held(points: Floats, before: int, after: int) -> Floats:
    """With rest before and after. Shape (before + T + after, P, 3)."""
    return np.concatenate([np.repeat(points[:1], before, axis=0), points, np.repeat(points[-1:], after, axis=0)])


def table_places(action: str) -> Floats:
    """Where an action ends, body frame of a person of size one, m."""
    return np.array({"across": [0.40, 0.10, -0.2], "forward": [0.50, -0.2, -0.2], "comb": [0.1, -0.1, 0.2]}[action])


def write_table(folder: Path, persons: int = 3, repetitions: int = 2) -> None:
    """Persons sit along the laboratory's y, the last one turned by half a circle; sizes differ; both hands; mm."""
    rng = np.random.default_rng(0)
    rows: list[tuple[str, int, str, int, Floats, Floats]] = []
    for person in range(1, persons + 1):
        size = 0.9 + 0.1 * person
        turned = -1.0 if person == persons else 1.0
        for hand in ("L", "R"):
            mirror = np.array([1.0, -1.0 if hand == "L" else 1.0, 1.0])
            for action in ("across", "forward", "comb"):
                place = size * (table_places(action) + 0.04 * rng.standard_normal(3) * (action != "comb"))
                for repetition in range(repetitions):
                    arm = moved_arm(place, 60 + 10 * repetition + (40 if action == "comb" else 0), size)
                    sternum = np.broadcast_to([0.0, 0.0, -0.02], (len(arm), 1, 3))
                    body = held(np.concatenate([sternum, arm], axis=1), 20, 30) * mirror
                    target = place * mirror if action != "comb" else np.full(3, np.nan)
                    rows.append(
                        (action, person, hand, repetition, _table_room(body, turned), _table_room(target, turned))
                    )
    _write(folder / "table_reach", rows, TABLE_POINTS, "mm", "Vicon lab frame, z up", 100.0, 1000.0)


def _table_room(points: Floats, turned: float) -> Floats:
    """From the body frame to the laboratory: x right, y forward, z up."""
    return np.stack([-turned * points[..., 1], turned * points[..., 0], points[..., 2]], axis=-1)


def write_pointing(folder: Path, persons: int = 2, repetitions: int = 2) -> None:
    """Persons point at 3 x 3 targets; one movement of each is marked as not usable; m."""
    rows: list[tuple[str, int, str, int, Floats, Floats]] = []
    ids: list[int] = []
    for person in range(1, persons + 1):
        size = 0.9 + 0.1 * person
        for number, (left, up) in enumerate((y, z) for y in (1.0, 0.0, -1.0) for z in (-1.0, 0.0, 1.0)):
            target = np.array([2.0, left, up])
            ray = target - size * RIGHT_SHOULDER
            tip = size * RIGHT_SHOULDER + 0.6 * size * ray / np.linalg.norm(ray)
            for repetition in range(repetitions):
                shoulder, elbow, wrist, _, index, _ = np.moveaxis(moved_arm(tip, 30 + 4 * repetition, size), 1, 0)
                chain = [index, wrist, 0.5 * (elbow + wrist), 0.5 * (shoulder + elbow), shoulder]
                others = [np.broadcast_to(p, index.shape) for p in ([0.0, 0.0, 0.3], [0.0, 0.2, 0.0])]
                body = held(np.stack(chain + others, axis=1), 10, 15)
                rows.append(("point", person, "R", repetition, _unity(body), _unity(target)))
                ids.append(number)
    _write(folder / "pointing27", rows, POINTING_POINTS, "m", "Unity, x right, y up, z forward", 45.45, 1.0, ids)


def _unity(points: Floats) -> Floats:
    return np.stack([-points[..., 1], points[..., 2], points[..., 0]], axis=-1)


def _write(
    folder: Path,
    rows: list[tuple[str, int, str, int, Floats, Floats]],
    points: tuple[str, ...],
    unit: str,
    axes: str,
    rate_hz: float,
    scale: float,
    ids: list[int] | None = None,
) -> None:
    folder.mkdir(parents=True, exist_ok=True)
    lengths = [len(row[4]) for row in rows]
    rest = (20, 30) if ids is None else (10, 15)
    arrays = {
        "flat": np.concatenate([scale * row[4].reshape(len(row[4]), -1) for row in rows]).astype(np.float32),
        "flat_time": np.concatenate([np.arange(length) / rate_hz for length in lengths]),
        "offsets": np.concatenate([[0], np.cumsum(lengths)]),
        "points": np.array(points),
        "unit": np.array(unit),
        "axes": np.array(axes),
        "action": np.array([row[0] for row in rows]),
        "subject": np.array([row[1] for row in rows]),
        "repetition": np.array([row[3] for row in rows]),
        "target": scale * np.array([row[5] for row in rows]),
        "segment": np.array([(rest[0], length - rest[1]) for length in lengths]),
        "ok": np.ones(len(rows), dtype=bool),
    }
    if ids is None:
        arrays["hand"] = np.array([row[2] for row in rows])
    else:
        arrays["target_id"] = np.array(ids)
        arrays["ok"][0] = False
    np.savez(folder / "data.npz", allow_pickle=False, **arrays)
