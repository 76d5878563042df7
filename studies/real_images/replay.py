"""The recording played through the parts of the nodes: camera source, image messages, tracker, and its estimates.

The true position of the hand is not used here. Estimates are read from the messages that would be on the bus.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from foxglove_schemas_protobuf.CompressedImage_pb2 import CompressedImage
from foxglove_schemas_protobuf.ImageAnnotations_pb2 import ImageAnnotations

from paramove.action_space import (
    ActionTracker,
    FilterOptions,
    Grammar,
    PropagationOptions,
    TrackerOptions,
    VideoTracker,
    Vocabulary,
    arm_pose_message,
    estimate_message,
    outline_message,
)
from paramove.cameras import CalibratedCamera, EndOfFrames, FrameChecks, decode, encode, open_source
from paramove.documents import Floats, InputError
from paramove.msgs.action_estimate_pb2 import ActionEstimate
from paramove.msgs.arm_pose_pb2 import ArmPose
from paramove.observation import ArmObserver, BodyKeyPoints, PoseNetwork, key_points_from, key_points_message
from studies.real_images import seated_person
from studies.real_images.pointing_model import NAME, pointing_action
from studies.real_images.seated_person import Measures

IMAGES = "color"
RATE_HZ = 10.0
"""Assumed, since the recording has no times: every third frame of a camera at 30 Hz."""
PARTICLES = 1000
RETARGETED = 0.2
CAMERA = "camera_1"


@dataclass(frozen=True)
class ReplayedEstimate:
    """The tracker's estimate of one frame.

    Attributes:
        frame: number of the picture. pose: shoulder, elbow, tip of the index finger (9,), m, in the world.
        outline: of the arm, (N, 2), px. progress: mean of tau. direction: mean of theta (u, v), (2,).
        lost: whether the tracker reports the arm as lost, or sees nothing.
    """

    frame: int
    pose: Floats
    outline: Floats
    progress: float
    direction: Floats
    lost: bool


def replayed(
    folder: Path, key_points: Sequence[BodyKeyPoints] = (), *, rate_hz: float = RATE_HZ, seed: int = 0,
    models: Path | None = None, person: Measures | None = None,
) -> list[ReplayedEstimate]:  # fmt: skip
    """All frames of the recording of a folder. Raises InputError where something of it is missing.

    Args:
        key_points: of each picture; none to track by the outline alone.
        rate_hz: assumed pictures a second. seed: of the filter.
        models: folder of the trained model; by default the user's cache.
        person: measures; by default those that were set by hand.
    """
    camera = seated_person.camera(folder)
    tracker = video_tracker(camera, person or seated_person.by_hand(camera), rate_hz, seed, models)
    estimates = []
    for index, image in camera_messages(folder / IMAGES, camera, rate_hz):
        at_ns = image.timestamp.ToNanoseconds()
        states = list(tracker.see_key_points(CAMERA, at_ns, key_points[index])) if len(key_points) else []
        for tracked in [*states, *tracker.see(CAMERA, at_ns, decode(image))]:
            estimate = estimate_message(tracked, tracker.parameter_names, PARTICLES).SerializeToString()
            pose = arm_pose_message(tracked).SerializeToString()
            outline = outline_message(tracked).SerializeToString()
            estimates.append(_received(index, estimate, pose, outline))
    return estimates


def video_tracker(
    camera: CalibratedCamera, person: Measures, rate_hz: float, seed: int, models: Path | None
) -> VideoTracker:
    """The tracker as the node makes one: seated pointing in a loop, and directions that may slide on."""
    placement = person.placement
    action = pointing_action(person.sizes, person.resting, placement, models)
    options = TrackerOptions(
        filter=FilterOptions(n_particles=PARTICLES), propagation=PropagationOptions(retargeted=RETARGETED)
    )
    tracker = ActionTracker(Vocabulary([action]), Grammar.loop(NAME), placement, options, seed)
    return VideoTracker(tracker, ArmObserver(person.sizes, [camera]), [camera], 1.0 / rate_hz)


def camera_messages(pictures: Path, camera: CalibratedCamera, rate_hz: float) -> Iterator[tuple[int, CompressedImage]]:
    """Number and message of each picture, as the camera node publishes them. Raises InputError."""
    source = open_source(f"folder:{pictures}@{rate_hz:g}", camera.width_px, camera.height_px)
    checks = FrameChecks(camera.width_px, camera.height_px)
    tick = 0
    try:
        while True:
            frame = source.frame(round(tick * 1e9 / rate_hz))
            tick += 1
            if frame is not None:
                yield frame.index, encode(checks.passed(frame))
    except EndOfFrames:
        return
    except RuntimeError as error:
        raise InputError(f"{pictures}: {error}") from error
    finally:
        source.close()


def detected_key_points(folder: Path, network: PoseNetwork) -> list[BodyKeyPoints]:
    """What the network detects in each picture, as a subscriber receives it. Raises InputError."""
    images = camera_messages(folder / IMAGES, seated_person.camera(folder), RATE_HZ)
    return [key_points_from(key_points_message(network.detect(decode(image)), 0)) for _, image in images]


def _received(frame: int, estimate_data: bytes, pose_data: bytes, outline_data: bytes) -> ReplayedEstimate:
    """The three messages, read as a subscriber reads them."""
    estimate, pose = ActionEstimate.FromString(estimate_data), ArmPose.FromString(pose_data)
    outline = ImageAnnotations.FromString(outline_data).points[0].points
    progress = np.array(estimate.progress)
    middles = (np.arange(len(progress)) + 0.5) / len(progress)
    return ReplayedEstimate(
        frame=frame,
        pose=np.array([value for point in pose.points for value in (point.x, point.y, point.z)]),
        outline=np.array([(point.x, point.y) for point in outline]).reshape(-1, 2),
        progress=float(progress @ middles / progress.sum()),
        direction=np.array([parameter.mean for parameter in estimate.actions[0].parameters]),
        lost=estimate.lost or estimate.degraded,
    )
