"""A recording as the real one lies on disk, of an arm drawn as a bright shape."""

from __future__ import annotations

import json
from pathlib import Path

import cv2
import numpy as np

from paramove.cameras.calibrated import CalibratedCamera
from paramove.observation import BodyKeyPoints
from paramove.observation.arm_observer import ArmObserver
from studies.real_images import pointing_model, seated_person
from studies.real_images.scores import FLESH_M, middle_of_hand

LENS = [600.0, 0.0, 0.0, 0.0, 600.0, 0.0, 320.0, 240.0, 1.0]


def write_lens(folder: Path) -> CalibratedCamera:
    """The file of the lens, and the camera that it makes."""
    lens = {"width": 640, "height": 480, "intrinsic_matrix": LENS}
    (folder / seated_person.INTRINSICS).write_text(json.dumps(lens), encoding="utf-8")
    return seated_person.camera(folder)


def true_poses(camera: CalibratedCamera, theta: tuple[float, float] = (0.8, 0.5)) -> np.ndarray:
    """At 10 Hz: half a second on the knee, then to a direction, and held. (T, 9), m, in the world."""
    placement = seated_person.by_hand(camera).placement
    rest = placement.in_model(seated_person.resting_pose(camera))
    arm = seated_person.SIZES.scaled(1.0 / placement.scale)
    shown = pointing_model.movement(np.array(theta), arm, rest, np.random.default_rng(5))
    return placement.in_world(np.concatenate([np.repeat(shown[:1], 5, axis=0), shown[: 2 * 60 : 6]]))


def write_recording(folder: Path) -> np.ndarray:
    """Pictures, lens and reference of 25 frames; the true poses."""
    camera = write_lens(folder)
    poses = true_poses(camera)
    (folder / "color").mkdir()
    room = np.full((480, 640, 3), 60, np.uint8)
    for x in range(20, 640, 60):  # a room without edges would be taken for darkness
        cv2.rectangle(room, (x, 300), (x + 30, 470), (30 + x // 5, 120, 150 - x // 5), -1)
    observer, noise = ArmObserver(seated_person.SIZES, [camera], threads=1), np.random.default_rng(3)
    for number, pose in enumerate(poses):
        image = room.copy()
        cv2.fillPoly(image, [observer.outline(pose, 0).round().astype(np.int32)], (190, 200, 210))
        image = cv2.add(image, noise.integers(0, 6, image.shape, dtype=np.uint8))
        cv2.imwrite(str(folder / "color" / f"{number:05d}.jpg"), image)
    middle = middle_of_hand(poses)
    np.savez(folder / "hand_reference.npz", uv=camera.project(middle), xyz_m=seated_person.in_camera(middle, camera))
    (folder / "depth").mkdir()
    for number, points in enumerate(key_points(camera, poses)):
        depth = np.zeros((480, 640), np.uint16)
        x, y = points.positions[0, 0].astype(int)
        shoulder = seated_person.in_camera(poses[number : number + 1, :3], camera)[0]
        depth[y - 9 : y + 10, x - 9 : x + 10] = round(1000.0 * (shoulder[2] - FLESH_M))
        cv2.imwrite(str(folder / "depth" / f"{number:05d}.png"), depth)
    return poses


def key_points(camera: CalibratedCamera, poses: np.ndarray) -> list[BodyKeyPoints]:
    """As a network would detect them without any error; the left arm hangs beside the right one."""
    found = []
    for pose in poses:
        shoulder, elbow, hand = pose.reshape(3, 3)
        wrist = elbow + seated_person.SIZES.forearm / seated_person.SIZES.lower_arm * (hand - elbow)
        arm = np.stack([shoulder, elbow, wrist, middle_of_hand(pose)[0]])
        right, ahead = camera.project(arm), seated_person.in_camera(arm, camera)[:, 2]
        left = right[0] + [[90.0, 0.0], [95.0, 70.0], [90.0, 130.0], [88.0, 150.0]]
        depths = np.stack([ahead - ahead[0], np.zeros(4)])
        found.append(BodyKeyPoints(np.stack([right, left]), np.full((2, 4), 4.0), depths, np.ones((2, 4)), 1.0))
    return found
