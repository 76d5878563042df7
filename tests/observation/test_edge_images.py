"""Edge images are what the equations say, whatever the brightness."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from paramove.observation import ObservationOptions
from paramove.observation.edge_images import BINS_PER_LEVEL, DIRECTIONS, MARGIN, REACH_PX, EdgeImages

PLAIN = ObservationOptions(smoothing_px=0.0, width_px=64, height_px=48)


def picture(seed=0, width=64, height=48, strongest=200):
    rng = np.random.default_rng(seed)
    return rng.integers(20, strongest, (height, width, 3), dtype=np.uint8)


def seen(image, options=PLAIN):
    edges = EdgeImages(options)
    edges.see(image)
    edges.fill(0, edges.count)
    return edges


def inside(edges, flat):
    """An edge image without its margin, 1 for 1."""
    return flat.reshape(-1, edges.stride)[MARGIN:-MARGIN, MARGIN:-MARGIN] / 255.0


def gradients(image):
    """The thesis's g(x, y), (H, W, 2), of the channel with the largest gradient."""
    whole = image.astype(float)
    found = np.zeros((*image.shape, 2))
    found[:-1, :-1, :, 0] = whole[:-1, 1:] - whole[:-1, :-1]
    found[:-1, :-1, :, 1] = whole[1:, :-1] - whole[:-1, :-1]
    best = (found**2).sum(axis=3).argmax(axis=2)
    return np.take_along_axis(found, best[:, :, None, None], axis=2)[:, :, 0]


def test_intensities_are_those_of_equation_6_24():
    image = picture()
    edges = seen(image)
    g = gradients(image)
    size = np.linalg.norm(g, axis=2)
    normalised = g / np.maximum(size, edges.scale)[..., None]
    for i in range(DIRECTIONS):
        along = np.abs(normalised @ [np.sin(i * np.pi / DIRECTIONS), np.cos(i * np.pi / DIRECTIONS)])
        norm = np.maximum(np.linalg.norm(normalised, axis=2), 1e-12)
        assert_allclose(inside(edges, edges.intensities[i]), norm * (along / norm) ** 2, rtol=0.0, atol=0.6 / 255.0)


def test_n_pixels_reach_one_and_no_larger_scale_would_do():
    image = picture(width=320, height=240)
    edges = seen(image, ObservationOptions(smoothing_px=0.0))
    size = np.linalg.norm(gradients(image), axis=2)
    assert (size >= edges.sharpness).sum() >= 1000
    assert (size >= edges.sharpness + 2.0 / BINS_PER_LEVEL).sum() < 1000


@pytest.mark.parametrize("i", range(DIRECTIONS))
def test_distance_images_are_those_of_equation_6_25(i):
    edges = seen(picture(1))
    found, expected = inside(edges, edges.distances[i]), np.zeros((48, 64))
    intensity = np.pad(inside(edges, edges.intensities[i]), REACH_PX)
    angle = i * np.pi / DIRECTIONS
    for step in range(-REACH_PX, REACH_PX + 1):
        dx, dy = round(step * np.sin(angle)), round(step * np.cos(angle))
        there = intensity[REACH_PX + dy : REACH_PX + dy + 48, REACH_PX + dx : REACH_PX + dx + 64]
        expected = np.maximum(expected, there * (1.0 - abs(step) / REACH_PX))
    assert_allclose(found, expected, rtol=0.0, atol=1.6 / 255.0)


def test_the_distance_image_of_the_simple_likelihood_is_that_of_equation_6_23():
    options = ObservationOptions(likelihood="simple", smoothing_px=0.0, width_px=64, height_px=48)
    edges = seen(picture(2), options)
    intensity, found = inside(edges, edges.intensities[0]), inside(edges, edges.distances[0])
    rows, columns = np.indices(intensity.shape)
    for y, x in ((0, 0), (10, 50), (24, 32), (47, 63), (30, 3)):
        near = 1.0 - np.hypot(rows - y, columns - x) / REACH_PX
        assert_allclose(found[y, x], (intensity * near).max(), rtol=0.0, atol=1.6 / 255.0)


def test_an_edge_lies_half_a_pixel_before_its_gradient():
    """The edge between columns 19 and 20 is at 19.5; its forward difference is stored at 19."""
    image = np.full((48, 64, 3), 40, np.uint8)
    image[:, 20:] = 160
    edges = seen(image)
    across = inside(edges, edges.intensities[DIRECTIONS // 2])  # n = (1, 0)
    assert (across[:-1, 19] == 1.0).all()
    assert across[:, :19].max() == across[:, 20:].max() == 0.0
    assert inside(edges, edges.intensities[0]).max() == 0.0  # n = (0, 1)


def test_the_strongest_channel_decides():
    image = np.full((48, 64, 3), 100, np.uint8)
    image[:, 30:, 2] = 180
    image[:, 30:, 0] = 90
    edges = seen(image)
    assert inside(edges, edges.intensities[DIRECTIONS // 2])[10, 29] == 1.0
    assert edges.sharpness == pytest.approx(80.0)


def test_brightness_changes_nothing():
    """A picture of half the contrast has the same edge images, but for its rounding to grey levels."""
    bright = (picture(3, strongest=120) // 2) * 2
    first, second = seen(bright), seen(bright // 2 + 50)
    assert second.sharpness == pytest.approx(first.sharpness / 2.0, abs=1.0 / BINS_PER_LEVEL)
    assert_allclose(inside(first, first.distances[3]), inside(second, second.distances[3]), rtol=0.0, atol=0.02)


def test_a_black_image_is_not_sharp_and_has_no_edges():
    noise = np.random.default_rng(0).integers(0, 2, (48, 64, 3), dtype=np.uint8)
    edges = seen(noise)
    assert edges.sharpness < 2.0
    assert seen(np.zeros((48, 64, 3), np.uint8)).distances.max() == 0
