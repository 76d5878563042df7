import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from paramove.cameras.frames import Frame, decode, encode
from paramove.msgs.tracked_objects_pb2 import TrackedObject, TrackedObjects
from paramove.objects.colour_tracker import Colour, ColourTracker
from paramove.objects.homography import PlaneHomography
from tests.objects.scene import COLOURS, WORKING_AREA, Look, Scene

LOOKS = 12


def _by_name(tracked: TrackedObjects) -> dict[str, TrackedObject]:
    return {found.name: found for found in tracked.objects}


def _centre(tracked: TrackedObjects, name: str) -> tuple[float, float]:
    found = _by_name(tracked)[name]
    return found.u_px, found.v_px


def _plane_errors_mm(look: Look, seed: int) -> list[float]:
    """Calibrate with one object at the four corners, then locate all three at random places; errors in mm."""
    draw, tracker, errors = np.random.default_rng(seed), ColourTracker(), []
    with Scene(look, seed) as scene:
        corners = []
        for corner in WORKING_AREA:
            scene.stand("yellow", *corner)
            image = decode(encode(Frame(scene.image(), 0, 0)))
            corners.append(_centre(tracker.update(image), "yellow"))
        homography = PlaneHomography.fit(corners, WORKING_AREA)
        for _ in range(3):
            places = {}
            for name, least_y in zip(COLOURS, (-0.12, -0.045, 0.03), strict=True):
                places[name] = (draw.uniform(0.12, 0.19), least_y + draw.uniform(0, 0.025))
                scene.stand(name, *places[name])
            tracked = tracker.update(decode(encode(Frame(scene.image(), 0, 0))))
            assert sorted(_by_name(tracked)) == sorted(COLOURS)  # all found, and no hand where there is none
            for name, place in places.items():
                located = homography.plane_from_image(*_centre(tracked, name))
                errors.append(1000 * float(np.hypot(located[0] - place[0], located[1] - place[1])))
    return errors


@pytest.mark.parametrize("distorted", [False, True])
def test_locates_objects_on_the_plane_whatever_the_look(distorted: bool) -> None:
    errors = [e for seed in range(LOOKS) for e in _plane_errors_mm(Look.random(seed, distorted), seed)]
    assert np.median(errors) < 0.5
    assert max(errors) < 2.0


@pytest.mark.parametrize("seed", range(0, LOOKS, 4))
def test_finds_the_hand_beside_the_arm_and_its_fingertip(seed: int) -> None:
    with Scene(Look.random(seed), seed) as scene:
        scene.stand("green", 0.15, 0.06)
        scene.put("arm", (0.10, -0.08, 0.05))
        scene.put("hand", (0.24, -0.02, 0.05))
        found = _by_name(ColourTracker().update(scene.image()))
        tip = scene.project(np.array([0.24 - 0.071, -0.02, 0.046]))
    assert sorted(found) == ["green", "magenta"]
    assert found["magenta"].kind == TrackedObject.KIND_HAND
    nearest = min(np.hypot(p.u_px - tip[0], p.v_px - tip[1]) for p in found["magenta"].outline)
    assert nearest < 3.0


def test_confidence_tells_how_much_is_hidden() -> None:
    tracker = ColourTracker()
    with Scene(Look()) as scene:
        scene.stand("blue", 0.15, -0.05)
        for _ in range(10):
            seen = _by_name(tracker.update(scene.image()))["blue"]
        scene.put("arm", (0.19, -0.062, 0.03))
        hidden = _by_name(tracker.update(scene.image()))["blue"]
    assert seen.confidence > 0.95
    assert hidden.confidence < 0.8
    assert hidden.confidence == pytest.approx(hidden.area_px / seen.area_px, abs=0.05)


def _drawn(u: float, v: float, level: float = 1.0) -> np.ndarray:
    """A green rectangle of 14 x 32 px around (u, v) on grey; pixels at its borders are mixed by their covered share."""
    across = np.clip(7.5 - np.abs(np.arange(480) - u), 0, 1)
    down = np.clip(16.5 - np.abs(np.arange(360) - v), 0, 1)
    covered = np.outer(down, across)[:, :, None]
    mixed = covered * np.array([40.0, 150.0, 25.0]) + (1 - covered) * 55.0
    return np.round(mixed * level).astype(np.uint8)


@settings(deadline=None, max_examples=40, derandomize=True)
@given(st.floats(30, 440), st.floats(40, 320), st.floats(0.5, 1.6))
def test_centre_to_a_part_of_a_pixel_at_any_place_and_brightness(u: float, v: float, level: float) -> None:
    tracked = ColourTracker().update(_drawn(u, v, level))
    assert [found.name for found in tracked.objects] == ["green"]
    green = tracked.objects[0]
    assert (green.u_px, green.v_px) == (pytest.approx(u, abs=0.2), pytest.approx(v, abs=0.2))
    assert (green.width_px, green.height_px) == (pytest.approx(14, abs=1.2), pytest.approx(32, abs=1.2))


@pytest.mark.parametrize("fill", [0, 90, 255])
def test_finds_nothing_in_grey_noise(fill: int) -> None:
    noise = np.random.default_rng(0).normal(fill, 6, (360, 480, 3))
    tracked = ColourTracker().update(np.clip(noise, 0, 255).astype(np.uint8))
    assert list(tracked.objects) == []


def test_a_region_cut_in_two_stays_one() -> None:
    image = _drawn(200, 150)
    cv2.line(image, (180, 150), (220, 150), (200, 200, 200), 4)
    green = ColourTracker().update(image).objects[0]
    assert green.height_px == pytest.approx(32, abs=2)
    assert green.v_px == pytest.approx(150, abs=1)
    assert not green.twin


@pytest.mark.parametrize(("scale", "twin"), [(1.0, True), (0.7, True), (0.5, False)])
def test_another_object_of_its_colour_is_noticed_apart_from_it(scale: float, twin: bool) -> None:
    image = _drawn(200, 150)
    half_width, half_height = round(7 * scale), round(16 * scale)
    image[200 - half_height : 200 + half_height, 300 - half_width : 300 + half_width] = image[150, 200]
    (green,) = ColourTracker().update(image).objects
    assert green.twin == twin


@pytest.mark.parametrize("array", [np.zeros((360, 480), np.uint8), np.zeros((360, 480, 3), np.float64)])
def test_refuses_what_is_no_image(array: np.ndarray) -> None:
    with pytest.raises(ValueError, match=r"\[H, W, 3\] uint8 expected"):
        ColourTracker().update(array)


def test_refuses_colours_that_cannot_be() -> None:
    with pytest.raises(ValueError, match=r"hues within 0\.\.360"):
        Colour("odd", (30.0, 400.0))
    with pytest.raises(ValueError, match="each name once"):
        ColourTracker([Colour("a", (0, 20)), Colour("a", (40, 60))])
