"""The rendered person: the arm is where the pose says, in the shape that the observation projects."""

from pathlib import Path

import mujoco
import numpy as np
import pytest

from paramove.cameras.calibrated import CalibratedCamera
from paramove.demonstrations.synthetic import RESTING_SHOULDER
from paramove.observation.arm_body import ArmSizes
from sim import human
from sim.human import PersonLook, camera_frame, tapered_capsule
from tests.sim.arm_silhouette import ArmSilhouette

ROOT = Path(__file__).resolve().parents[2]
SIZES = ArmSizes()
ELBOW = RESTING_SHOULDER + np.array([0.05, -0.15, -0.2065])
MATRIX = np.array([[330.0, 0.0, 159.5], [0.0, 330.0, 119.5], [0.0, 0.0, 1.0]])


def camera_from_world():
    """From the front and above, looking at the right arm."""
    eye, target = np.array([1.1, -0.6, 1.3]), np.array([-0.1, -0.2, 0.1])
    forward = (target - eye) / np.linalg.norm(target - eye)
    right = np.cross(forward, (0.0, 0.0, 1.0))
    right /= np.linalg.norm(right)
    pose = np.eye(4)
    pose[:3, :3] = np.stack([right, np.cross(forward, right), forward])
    pose[:3, 3] = -pose[:3, :3] @ eye
    return pose


def pose_towards(direction):
    """An arm of the default sizes with the lower arm in a direction."""
    elbow = RESTING_SHOULDER + SIZES.upper_arm * (ELBOW - RESTING_SHOULDER) / np.linalg.norm(ELBOW - RESTING_SHOULDER)
    tip = elbow + SIZES.lower_arm * np.asarray(direction) / np.linalg.norm(direction)
    return np.concatenate([RESTING_SHOULDER, elbow, tip])


@pytest.fixture(scope="module")
def silhouette():
    made = ArmSilhouette(SIZES, MATRIX, 320, 240)
    yield made
    made.close()


def test_tapered_capsule_is_the_hull_of_two_spheres():
    """No vertex is outside both spheres and their cone, and the surface reaches both ends."""
    near, far, length = 0.055, 0.042, 0.26
    vertices, triangles, places = tapered_capsule(length, near, far)
    t = np.linspace(0.0, 1.0, 400)
    centres, radii = t[:, None] * [0.0, 0.0, length], (1 - t) * near + t * far
    outside = np.linalg.norm(vertices[:, None] - centres, axis=2) - radii
    assert np.abs(outside.min(axis=1)).max() < 3e-4
    assert vertices[:, 2].min() == pytest.approx(-near, abs=1e-9)
    assert vertices[:, 2].max() == pytest.approx(length + far, abs=1e-9)
    assert triangles.max() < len(vertices) == len(places)
    a, b, c = (vertices[triangles[:, corner]] for corner in range(3))
    outward = (np.cross(b - a, c - a) * ((a + b + c) / 3 - [0.0, 0.0, length / 2])).sum(axis=1)
    assert (outward > 0).all(), "triangles face outward"


def test_tapered_capsule_without_sides_is_refused():
    with pytest.raises(ValueError, match="no sides"):
        tapered_capsule(0.01, 0.055, 0.042)


@pytest.mark.parametrize("direction", [(1.0, 0.2, -0.2), (0.1, -0.1, -1.0), (0.6, 0.7, 0.4)])
def test_silhouette_is_where_the_points_project(silhouette, direction):
    pose, seen_from = pose_towards(direction), camera_from_world()
    mask = silhouette.mask(pose, seen_from)
    camera = CalibratedCamera("front", 320, 240, MATRIX, np.zeros(0), seen_from)
    points = pose.reshape(3, 3)
    inner = points[2] + 0.006 * (points[1] - points[2]) / SIZES.lower_arm
    for pixel in camera.project(np.array([points[0], points[1], 0.5 * (points[1] + points[2]), inner])):
        column, row = pixel.round().astype(int)
        assert mask[row, column]
    beyond = camera.project(points[2] + 0.03 * (points[2] - points[1]) / SIZES.lower_arm).round().astype(int)
    assert not mask[beyond[1], beyond[0]]
    assert 1000 < mask.sum() < 9000


def test_silhouette_does_not_remember(silhouette):
    first = silhouette.mask(pose_towards((1.0, 0.0, 0.0)), camera_from_world())
    silhouette.mask(pose_towards((0.0, 0.0, -1.0)), camera_from_world())
    np.testing.assert_array_equal(first, silhouette.mask(pose_towards((1.0, 0.0, 0.0)), camera_from_world()))


def test_silhouette_refuses_another_camera():
    shifted = MATRIX + np.array([[0.0, 0.0, 4.0], [0.0, 0.0, 0.0], [0.0, 0.0, 0.0]])
    with pytest.raises(ValueError, match="principal point"):
        ArmSilhouette(SIZES, shifted, 320, 240)


def test_parts_are_put_exactly():
    spec = mujoco.MjSpec()
    human.add_person(spec, SIZES, PersonLook(pattern="checks", hand_shape="pointing"), RESTING_SHOULDER)
    model = spec.compile()
    data = mujoco.MjData(model)
    pose = pose_towards((1.0, 0.1, 0.0))
    shoulder, elbow, tip = pose.reshape(3, 3)
    wrist = tip + SIZES.hand * np.array([-0.8, 0.0, 0.6])
    human.place_arm(model, data, pose, wrist)
    human.place_torso(model, data, (0.02, 0.0, 0.0))
    mujoco.mj_forward(model, data)
    for name, place in (("upper_arm", shoulder), ("forearm", elbow), ("hand", wrist)):
        np.testing.assert_allclose(data.body(name).xpos, place, rtol=0.0, atol=1e-12)
    forward = data.body("hand").xmat.reshape(3, 3)[:, 2]
    np.testing.assert_allclose(wrist + SIZES.hand * forward, tip, rtol=0.0, atol=1e-12)
    np.testing.assert_allclose(data.body("torso").xpos - RESTING_SHOULDER, (0.02, 0.0, 0.0), rtol=0.0, atol=1e-12)


def test_camera_frame_turns_back_into_the_pose():
    pose = camera_from_world()
    position, quaternion = camera_frame(pose)
    rotation = np.zeros(9)
    mujoco.mju_quat2Mat(rotation, quaternion)
    world_from_optical = rotation.reshape(3, 3) @ np.diag((1.0, -1.0, -1.0))
    np.testing.assert_allclose(world_from_optical.T, pose[:3, :3], rtol=0.0, atol=1e-12)
    np.testing.assert_allclose(position, -pose[:3, :3].T @ pose[:3, 3], rtol=0.0, atol=1e-12)


def test_described_person_is_the_one_of_the_code():
    """The file in robot_description has the default sizes."""
    model = mujoco.MjModel.from_xml_path(str(ROOT / "robot_description" / "human" / "human.xml"))
    spec = mujoco.MjSpec()
    human.add_person(spec, SIZES, PersonLook(), RESTING_SHOULDER)
    now = spec.compile()
    assert model.ngeom == now.ngeom
    np.testing.assert_allclose(model.geom_size, now.geom_size, rtol=0.0, atol=1e-5)
    np.testing.assert_allclose(model.body("hand").ipos, (0.0, 0.0, SIZES.hand / 2), rtol=0.0, atol=1e-6)
