"""The background is learned where no arm is, and tells what has changed from what has not."""

from __future__ import annotations

import cv2
import numpy as np
import pytest

from paramove.documents.input_error import InputError
from paramove.observation.arm_body import ArmSizes
from paramove.observation.arm_observer import ArmObserver
from paramove.observation.background import FULL, Background
from paramove.observation.options import ObservationOptions
from paramove.observation.presence import Presence
from tests.observation.views import four_cameras, some_poses

TRUE = some_poses(1, seed=5)[0]

WIDTH, HEIGHT = 48, 36
NOTHING = np.zeros((HEIGHT, WIDTH), np.uint8)


def scene(seed: int = 0, noise: float = 2.0, draw: int = 1) -> np.ndarray:
    """A coloured room with a little noise."""
    room = np.random.default_rng(seed).uniform(60.0, 190.0, (HEIGHT, WIDTH, 3))
    return np.clip(room + noise * np.random.default_rng(draw).standard_normal(room.shape), 0, 255).astype(np.uint8)


def learned(hidden: np.ndarray = NOTHING, images: int = 20) -> Background:
    background = Background(WIDTH, HEIGHT, still_weight=0.2)
    for number in range(images):
        background.see(scene(draw=number))
        background.learn(hidden, 0.1)
    return background


def change_of(background: Background, image: np.ndarray) -> np.ndarray:
    background.see(image)
    return background.change.reshape(HEIGHT + 2, WIDTH + 2)[1:-1, 1:-1].astype(int)


def test_nothing_is_known_before_the_first_image_was_learned():
    background = Background(WIDTH, HEIGHT, 0.2)
    assert not change_of(background, scene()).any()
    assert (background.weights == 1.0).all()


def test_the_same_room_has_not_changed_and_its_edges_count_less():
    background = learned()
    change = change_of(background, scene(draw=99))
    assert (change < -0.5 * FULL).mean() > 0.9
    assert change.max() < 0.5 * FULL
    assert (background.weights < 1.0).mean() > 0.4


def test_what_only_moved_by_two_pixels_says_nothing_and_what_moved_further_has_changed():
    """The clothes of a person who sways or sits a little otherwise than before."""
    background, image, found = learned(), scene(draw=99), []
    for pixels in (2, 5):
        shirt = image.copy()
        shirt[10:22, 12:28] = image[10:22, 12 + pixels : 28 + pixels]
        found.append(change_of(background, shirt)[10:22, 12:28])
    swayed, moved = found
    assert np.abs(swayed).mean() < 0.15 * FULL
    assert moved.mean() > 0.3 * FULL


def test_what_stands_before_it_has_changed_and_edges_about_it_count():
    background, image = learned(), scene(draw=99)
    image[10:20, 12:24] = (20, 230, 20)
    change = change_of(background, image)
    assert (change[10:20, 12:24] == FULL).mean() > 0.95
    assert (background.weights[8:22, 10:26] == 1.0).all()


def test_a_shadow_is_no_change():
    background, image = learned(), scene(draw=99)
    image[10:20, 12:24] = (0.6 * image[10:20, 12:24]).astype(np.uint8)
    assert (change_of(background, image)[10:20, 12:24] <= 0).mean() > 0.95


@pytest.mark.parametrize("gain", [0.7, 1.25])
def test_a_camera_that_changes_its_exposure_sees_no_change(gain):
    background = learned()
    image = np.clip(gain * scene(draw=99).astype(np.float64), 0, 255).astype(np.uint8)
    assert (change_of(background, image) < 0).mean() > 0.85


def test_what_the_arm_hides_is_unknown_until_the_arm_has_been_away():
    hidden = NOTHING.copy()
    hidden[5:15, 5:15] = 1
    background = learned(hidden)
    assert not change_of(background, scene(draw=98))[5:15, 5:15].any()
    for number in range(3):
        background.see(scene(draw=number))
        background.learn(NOTHING, 0.1)
    assert not change_of(background, scene(draw=98))[5:15, 5:15].any()
    for number in range(3):
        background.see(scene(draw=number))
        background.learn(NOTHING, 0.1)
    assert (change_of(background, scene(draw=97))[5:15, 5:15] < 0).mean() > 0.9


def test_an_object_that_stays_becomes_background_slowly():
    background = learned()

    def with_object(draw: int) -> np.ndarray:
        image = scene(draw=draw)
        image[10:20, 12:24] = (20, 230, 20)
        return image

    for number in range(20):  # 2 s
        background.see(with_object(number))
        background.learn(NOTHING, 0.1)
    assert (change_of(background, with_object(98))[10:20, 12:24] > 0).mean() > 0.9
    for number in range(1200):
        background.see(with_object(number % 20))
        background.learn(NOTHING, 0.1)
    assert (change_of(background, with_object(98))[10:20, 12:24] < 0).mean() > 0.9


def test_a_posture_over_what_has_changed_is_likelier_than_one_beside_it():
    """The room is even, so that edges tell nothing: only what has changed does."""
    cameras = four_cameras(width_px=160, height_px=120)[:1]
    away, there = TRUE + 0.0, TRUE + np.tile([0.0, 0.25, 0.1], 3)
    observer = ArmObserver(ArmSizes(), cameras, threads=1)
    room = np.random.default_rng(0).integers(90, 96, (120, 160, 3), dtype=np.uint8)
    for _ in range(3):
        observer.look([room])
        observer.learn(away, 0.1)
    image = room.copy()
    place = observer.outline(there, 0).round().astype(int)
    left, top = place.min(axis=0).clip(0)
    right, bottom = place.max(axis=0)
    image[top : bottom + 1, left : right + 1] = (200, 40, 40)
    observer.look([image])
    elsewhere = TRUE + np.tile([0.0, -0.25, 0.0], 3)
    over, beside = observer.log_likelihoods(np.stack([there, elsewhere]))
    assert over > beside + 10.0


def test_without_weight_nothing_is_learned_as_in_the_thesis():
    cameras = four_cameras(width_px=160, height_px=120)[:1]
    observer = ArmObserver(ArmSizes(), cameras, ObservationOptions(region_weight=0.0), threads=1)
    images = np.random.default_rng(0).integers(0, 255, (3, 120, 160, 3), dtype=np.uint8)
    observer.look([images[0]])
    first = observer.log_likelihoods(TRUE[None])
    observer.learn(TRUE, 0.1)
    observer.look([images[1]])
    observer.learn(TRUE, 0.1)
    observer.look([images[0]])
    np.testing.assert_array_equal(observer.log_likelihoods(TRUE[None]), first)


@pytest.mark.parametrize("wrong", [{"region_weight": -1.0}, {"still_edges": 1.5}, {"hidden_px": -1}])
def test_wrong_options_are_refused(wrong):
    with pytest.raises(InputError, match="region_weight of at least 0"):
        ObservationOptions(**wrong)


def test_presence_tells_an_arm_from_the_background_and_from_a_picture_that_has_changed_all_over():
    cameras = four_cameras(width_px=160, height_px=120)[:1]
    away, there = TRUE + np.tile([0.0, -0.4, 0.0], 3), TRUE + np.tile([0.0, 0.25, 0.1], 3)
    observer = ArmObserver(ArmSizes(), cameras, threads=1)
    room = np.random.default_rng(0).integers(90, 96, (120, 160, 3), dtype=np.uint8)

    def presence(image: np.ndarray) -> Presence:
        observer.look([image])
        observer.log_likelihoods(there[None])
        return observer.presence(there)

    assert presence(room) == Presence(0.0, 0.0)  # nothing is known yet
    for _ in range(3):
        observer.look([room])
        observer.learn(away, 0.1)
    assert presence(room).there < -0.8
    image = room.copy()
    place = observer.outline(there, 0).round().astype(int)
    left, top = place.min(axis=0).clip(0)
    right, bottom = place.max(axis=0)
    image[top : bottom + 1, left : right + 1] = (200, 40, 40)
    found = presence(image)
    assert found.there > 0.8
    assert 1.0 < found.changed < 4.0  # a rectangle about the arm
    elsewhere = room.copy()
    elsewhere[:, :80] = (40, 200, 40)
    assert presence(elsewhere).changed > 8.0
    observer.look([None])
    assert observer.presence(there) == Presence(0.0, 0.0)


def test_presence_looks_along_a_bent_wrist():
    """Of a hand bent by a right angle the line from elbow to fingertip lies beside it."""
    (camera,) = four_cameras(width_px=160, height_px=120)[:1]
    sizes = ArmSizes()
    sideways, downward, _ = camera.camera_from_world[:3, :3]
    shoulder = TRUE[:3]
    elbow = shoulder + sizes.upper_arm * downward
    wrist = elbow + sizes.forearm * sideways
    bent = np.concatenate([shoulder, elbow, wrist - sizes.hand * downward, wrist])
    observer = ArmObserver(sizes, [camera], threads=1)
    room = np.random.default_rng(0).integers(90, 96, (120, 160, 3), dtype=np.uint8)
    for _ in range(3):
        observer.look([room])
        observer.learn(TRUE + np.tile([0.0, -0.4, 0.0], 3), 0.1)
    image = cv2.fillPoly(room.copy(), [observer.outline(bent, 0).round().astype(np.int32)], (200, 40, 40))
    observer.look([image])
    observer.log_likelihoods(bent[None])
    assert observer.presence(bent).there > 0.8
    assert observer.presence(bent[:9]).there < 0.3
