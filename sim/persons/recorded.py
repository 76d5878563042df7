"""Pointing of recorded people (pointing27) as arm poses: to be rendered, and to train the model of the others.

The markers are on the skin. The elbow is where the forearm's line, prolonged, stays at the same distance from the
shoulder: one length per person, by least squares. Then it is moved so that the upper arm has one length in all frames.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from paramove.demonstrations import (
    FRAME,
    RESTING_SHOULDER,
    Demonstrations,
    RecordedMovement,
    data_folder,
    load_recordings,
)
from paramove.documents import Floats, read_arrays
from paramove.hmm import resample
from paramove.observation import BENT_POSE_POINTS, ArmSizes
from paramove.phmm import MovementDescription

DATA_SET = "pointing27"
RATE_HZ = 50.0
USUAL_HEIGHT = 1.75
WHOLE_ARM = 0.705
"""Shoulder to fingertip, m, to which all persons' movements are scaled: the default demonstrator's arm."""
LEFTMOST, DOWNMOST = 0.70, -0.50
AZIMUTH_SPAN, ELEVATION_SPAN = 1.40, 1.00
"""rad; theta (u, v) of a direction runs from left to right and from below upwards over these spans."""
FORWARD_SHARES = np.linspace(0.0, 0.30, 31)
"""Candidates for the elbow's distance behind the forearm's marker, m."""


@dataclass(frozen=True)
class RecordedPointing:
    """One movement at 50 Hz, from the beginning of the recording to its end, in the models' frame and scale.

    Attributes:
        subject, target_id, repetition: who pointed where, and for which time.
        poses: shoulder, elbow, fingertip (T, 9), m; the resting shoulder is the demonstrator's.
        wrist: (T, 3), m.
        theta: direction of the target as (u, v), see `direction_coordinates`.
        segment: first frame and one past the last of the movement.
        sizes: of the person's arm, m, in the same scale.
        height: of the person over 1.75 m: how large the body is rendered.
    """

    subject: int
    target_id: int
    repetition: int
    poses: Floats
    wrist: Floats
    theta: Floats
    segment: tuple[int, int]
    sizes: ArmSizes
    height: float


def direction_coordinates(direction: ArrayLike) -> Floats:
    """Theta (u, v) of azimuth (positive to the left) and elevation from the resting shoulder, rad. (..., 2)."""
    angles = np.asarray(direction, dtype=np.float64)
    u = (LEFTMOST - angles[..., 0]) / AZIMUTH_SPAN
    return np.stack([u, (angles[..., 1] - DOWNMOST) / ELEVATION_SPAN], axis=-1)


def direction_place(theta: ArrayLike, distance: float = 2.0) -> Floats:
    """The place (..., 3), m, in the models' frame, `distance` from the shoulder in the direction theta (..., 2)."""
    u, v = np.moveaxis(np.asarray(theta, dtype=np.float64), -1, 0)
    azimuth, elevation = LEFTMOST - AZIMUTH_SPAN * u, DOWNMOST + ELEVATION_SPAN * v
    flat = np.cos(elevation)
    line = np.stack([flat * np.cos(azimuth), flat * np.sin(azimuth), np.sin(elevation)], axis=-1)
    return np.asarray(RESTING_SHOULDER + distance * line)


def recorded_pointing(folder: str | Path | None = None) -> tuple[RecordedPointing, ...]:
    """All usable movements. Raises RecordingsError where the recordings are absent."""
    recordings = load_recordings(DATA_SET, folder, rate_hz=RATE_HZ)
    names = recordings.point_names
    marker_indices = [names.index(name) for name in ("rightShoulder", "forearm", "hand", "indexFinger")]
    arrays = read_arrays(data_folder(folder) / DATA_SET / "data.npz", only=["subject_height"])
    heights = np.asarray(arrays["subject_height"], dtype=np.float64) / USUAL_HEIGHT
    result: list[RecordedPointing] = []
    for subject in recordings.subjects:
        own = recordings.of(subject=subject)
        markers = [one.points.reshape(len(one.points), -1, 3)[:, marker_indices] for one in own]
        result.extend(_of_person(own, markers, float(heights[subject - 1])))
    return tuple(result)


def recorded_demonstrations(
    without_subject: int | None = None,
    folder: str | Path | None = None,
    *,
    of_subject: int | None = None,
    without_target: int | None = None,
) -> Demonstrations:
    """Training movements, theta (u, v) of the direction. Poses with the wrist (T, 12) at 50 Hz: the way out only.

    Either of all persons without one, or of one person without the movements to one target.
    """
    chosen = [
        one
        for one in recorded_pointing(folder)
        if one.subject != without_subject
        and (of_subject is None or one.subject == of_subject)
        and (without_target is None or one.target_id != without_target)
    ]
    sequences = [np.concatenate([one.poses, one.wrist], axis=1)[slice(*one.segment)] for one in chosen]
    theta = np.array([one.theta for one in chosen])
    duration = float(np.mean([len(sequence) - 1 for sequence in sequences]) / RATE_HZ)
    description = MovementDescription(
        "recorded_pointing", BENT_POSE_POINTS, "m", FRAME, ("u", "v"), duration, rate_hz=RATE_HZ
    )
    return Demonstrations([resample(one, max(len(one), 40)) for one in sequences], theta, description)


def _of_person(own: tuple[RecordedMovement, ...], markers: list[Floats], height: float) -> list[RecordedPointing]:
    behind = _elbow_behind_marker(np.concatenate(markers))
    arms = [_arm_points(one, behind) for one in markers]
    everything = np.concatenate(arms)
    upper = float(np.median(np.linalg.norm(everything[:, 1] - everything[:, 0], axis=1)))
    for points in arms:
        line = points[:, 1] - points[:, 0]
        points[:, 1] = points[:, 0] + upper * line / np.linalg.norm(line, axis=1, keepdims=True)
    everything = np.concatenate(arms)
    parts = [float(np.median(np.linalg.norm(everything[:, end] - everything[:, end - 1], axis=1))) for end in (2, 3)]
    lower = float(np.percentile(np.linalg.norm(everything[:, 3] - everything[:, 1], axis=1), 98))
    forearm, hand = (lower * part / sum(parts) for part in parts)
    for points in arms:
        points[:, 2] = _bent_wrist(points, forearm, hand)
    scale = WHOLE_ARM / (upper + forearm + hand)
    default = ArmSizes()
    sizes = replace(default, upper_arm=scale * upper, forearm=scale * forearm, hand=scale * hand)
    result = []
    for one, points in zip(own, arms, strict=True):
        resting = points[: max(1, one.segment[0])].mean(axis=0)[0]
        placed = RESTING_SHOULDER + scale * (points - resting)
        poses = placed[:, [0, 1, 3]].reshape(len(placed), 9)
        theta = direction_coordinates(one.direction)
        result.append(
            RecordedPointing(
                one.subject, one.target_id, one.repetition, poses, placed[:, 2], theta, one.segment, sizes, height
            )
        )
    return result


def _bent_wrist(points: Floats, forearm: float, hand: float) -> Floats:
    """The wrist on its side of the line from elbow to fingertip so that both lengths hold. (T, 4, 3) -> (T, 3), m.

    Where the line is longer than both, the wrist is on it.
    """
    elbow, wrist, tip = points[:, 1], points[:, 2], points[:, 3]
    distance = np.linalg.norm(tip - elbow, axis=1, keepdims=True)
    axis = (tip - elbow) / distance
    along = (forearm**2 - hand**2 + distance**2) / (2.0 * distance)
    height = np.sqrt(np.maximum(forearm**2 - along**2, 0.0))
    off = wrist - elbow
    off = off - (off * axis).sum(axis=1, keepdims=True) * axis
    return np.asarray(elbow + along * axis + height * off / np.linalg.norm(off, axis=1, keepdims=True))


def _elbow_behind_marker(markers: Floats) -> float:
    """Distance, m, behind the forearm's marker at which the shoulder's distance varies least. Markers (T, 4, 3)."""
    shoulder, forearm, back = markers[:, 0], markers[:, 1], _backward(markers)
    spreads = [np.std(np.linalg.norm(forearm + far * back - shoulder, axis=1)) for far in FORWARD_SHARES]
    return float(FORWARD_SHARES[int(np.argmin(spreads))])


def _backward(markers: Floats) -> Floats:
    line = markers[:, 1] - markers[:, 2]
    return np.asarray(line / np.linalg.norm(line, axis=1, keepdims=True))


def _arm_points(markers: Floats, behind: float) -> Floats:
    """Shoulder, elbow, wrist, fingertip of markers of shoulder, forearm, hand, finger. (T, 4, 3) -> (T, 4, 3)."""
    elbow = markers[:, 1] + behind * _backward(markers)
    wrist = 0.25 * markers[:, 1] + 0.75 * markers[:, 2]  # the hand's marker is on its back
    return np.stack([markers[:, 0], elbow, wrist, markers[:, 3]], axis=1)
