"""The matching finds what it should, and its objective is Equation (6.26)."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from paramove.observation import ArmSizes, ObservationOptions, fitted_poses
from paramove.observation.contour_kernels import EVERY, NORMAL_STEP, fill_segments, new_contour, place_key_points
from paramove.observation.edge_images import DIRECTIONS, MARGIN, EdgeImages
from paramove.observation.likelihood_kernels import SCRATCH, outline, strengths
from paramove.observation.matching_kernels import STEP_BITS, begin, match, new_shifts
from paramove.observation.segment_sums import LANES
from paramove.observation.silhouette_kernels import new_canvas
from tests.observation.scenes import cluttered, displaced
from tests.observation.test_silhouette import BODY, drawn, kernel_camera
from tests.observation.views import four_cameras, some_poses

UNIT = 0.25
CAMERA = four_cameras(fovy_deg=30.0)[1]
TRUE = some_poses(1, seed=3)[0]


@pytest.fixture(scope="module")
def edges():
    made = EdgeImages(ObservationOptions())
    made.see(made.smoothed(cluttered(drawn(TRUE, CAMERA))))
    made.fill(0, made.count)
    return made


def prepared(pose):
    """Contour, number of compared points, number of key points."""
    contour = new_contour(320, 240)
    count = outline(pose, BODY, kernel_camera(CAMERA), new_canvas(320, 240), contour)
    number = place_key_points(count, 7.0, contour)
    points = fill_segments(number, (320 + 2 * MARGIN) * (240 + 2 * MARGIN), contour)
    return contour, points, number


class Objective:
    """Equation (6.26) from the contour pixels alone, all of it, in double precision."""

    def __init__(self, contour, number, edges):
        points = contour.starts[number]
        loop = np.stack([contour.x[:points], contour.y[:points]], axis=1).astype(float)
        self.images = edges.distances.reshape(DIRECTIONS, -1, edges.stride) / 255.0
        count = max(round(points / 7.0), -(-points // 8))
        self.starts = np.arange(count) * points // count
        chord = loop[(self.starts + NORMAL_STEP) % points] - loop[self.starts - NORMAL_STEP]
        self.normals = np.stack([-chord[:, 1], chord[:, 0]], axis=1) / np.linalg.norm(chord, axis=1, keepdims=True)
        lengths = np.diff(np.append(self.starts, points))
        segment = np.repeat(np.arange(count), lengths)
        beyond = np.arange(points) - self.starts[segment]
        compared = beyond % EVERY == 0
        self.pixels, self.segment = loop[compared], segment[compared]
        self.share = (beyond / lengths[segment])[compared]
        self.after = (self.segment + 1) % count
        n = self.between(self.normals)
        self.n = n / np.linalg.norm(n, axis=1, keepdims=True)
        angles = np.arange(DIRECTIONS) * np.pi / DIRECTIONS
        cosines = np.abs(self.n @ np.stack([np.sin(angles), np.cos(angles)]))
        self.b = cosines.argmax(axis=1)
        self.or_b = DIRECTIONS - 1 - (cosines + 1e-5 >= cosines.max(axis=1, keepdims=True))[:, ::-1].argmax(axis=1)
        self.keys = loop[self.starts] + 0.5 * self.normals - 0.5

    def between(self, values):
        share = self.share if values.ndim == 1 else self.share[:, None]
        return (1.0 - share) * values[self.segment] + share * values[self.after]

    def gradients(self, s):
        """Distance image at each shifted contour point, rounded to pixels: least and greatest.

        A point at the border of two pixels or a normal between two directions may be rounded either way, as single
        precision is exact to 1e-4 px.
        """
        place = self.pixels - 0.5 + (0.5 + self.between(s))[:, None] * self.n
        found = []
        for nudge in 1e-4 * np.array([[1, 1], [1, -1], [-1, 1], [-1, -1]]):
            x, y = np.floor(place + 0.5 + nudge).astype(int).T + MARGIN
            found += [self.images[self.b, y, x], self.images[self.or_b, y, x]]
        return np.min(found, axis=0), np.max(found, axis=0)

    def bends(self, s):
        m0 = np.roll(self.keys, -1, axis=0) - self.keys
        moved = self.keys + s[:, None] * self.normals
        m = np.roll(moved, -1, axis=0) - moved
        size = np.linalg.norm(m0, axis=1)
        q = ((m * m0).sum(axis=1) / size - size) * UNIT
        across = (m * np.stack([-m0[:, 1], m0[:, 0]], axis=1)).sum(axis=1) / size * UNIT
        return 0.11 * np.abs(q) ** 2 + np.abs(across) ** 2.5

    def __call__(self, s):
        """Least and greatest E."""
        penalties = ((UNIT * s) ** 2).mean() + 4.0 * self.bends(s).mean()
        return tuple(7.5 * gradients.mean() ** 2 - penalties for gradients in self.gradients(s))


def test_the_step_sizes_are_the_thesiss():
    assert_allclose(0.5 ** STEP_BITS[:8], [1, 0.5, 1, 0.25, 1, 0.5, 1, 0.125], rtol=0.0, atol=0.0)
    assert len(STEP_BITS) == 15


def test_the_incremental_objective_is_the_full_one(edges):
    for pose in [TRUE, *displaced(TRUE, 20, 0.03), *some_poses(20)]:
        contour, points, number = prepared(pose)
        full, shifts = Objective(contour, number, edges), new_shifts(number + 1)
        assert len(full.starts) == number
        total = begin(edges.distances.reshape(-1), edges.stride, number, UNIT, contour, shifts)
        minimum, maximum = (values.sum() for values in full.gradients(np.zeros(number)))
        assert minimum - 1e-3 <= total / 255.0 <= maximum + 1e-3
        energy = match(edges.distances.reshape(-1), edges.stride, number, points, UNIT, contour, shifts)
        minimum, maximum = full(shifts.shift[:number].astype(float))
        assert minimum - 1e-5 <= energy <= maximum + 1e-5
        assert maximum - minimum < 0.5
        assert energy > full(np.zeros(number))[1]


def exact_optimum(full, number, reach=8.0, step=0.5):
    """The largest E on a grid of shifts, by dynamic programming around the loop.

    7.5 x^2 is the largest of its tangents 15 t x - 7.5 t^2, and with a tangent the objective is a sum over segments.
    """
    grid = np.arange(-reach, reach + step / 2, step)
    m0 = np.roll(full.keys, -1, axis=0) - full.keys
    m0 = m0 / np.linalg.norm(m0, axis=1, keepdims=True)
    across = np.stack([-m0[:, 1], m0[:, 0]], axis=1)
    best = -np.inf
    gains, costs = [], []
    for k in range(number):
        own = full.segment == k
        after = (k + 1) % number
        share = full.share[own][:, None, None]
        s = (1.0 - share) * grid[:, None] + share * grid[None, :]
        n = full.n[own][:, None, None]
        place = full.pixels[own][:, None, None] - 0.5 + (0.5 + s)[..., None] * n
        index = np.floor(place + 0.5).astype(int) + MARGIN
        gains.append(
            full.images[full.b[own][:, None, None], index[..., 1], index[..., 0]].sum(axis=0) / len(full.pixels)
        )
        here, there = grid[:, None], grid[None, :]
        q = UNIT * (there * (full.normals[after] @ m0[k]) - here * (full.normals[k] @ m0[k]))
        p = UNIT * (there * (full.normals[after] @ across[k]) - here * (full.normals[k] @ across[k]))
        costs.append(((UNIT * here) ** 2 + 4.0 * (0.11 * q**2 + np.abs(p) ** 2.5)) / number)
    for tangent in np.linspace(0.2, 1.0, 9):
        loop = 15.0 * tangent * gains[0] - costs[0]
        for gain, cost in zip(gains[1:], costs[1:], strict=True):
            link = 15.0 * tangent * gain - cost
            loop = (loop[:, :, None] + link[None]).max(axis=1)
        best = max(best, np.diag(loop).max() - 7.5 * tangent**2)
    return best


def test_the_matching_comes_near_to_the_exact_optimum(edges):
    shares = []
    for pose in displaced(TRUE, 12, 0.02, seed=1):
        contour, points, number = prepared(pose)
        shifts = new_shifts(number + 1)
        energy = match(edges.distances.reshape(-1), edges.stride, number, points, UNIT, contour, shifts)
        shares.append(energy / exact_optimum(Objective(contour, number, edges), number))
    assert np.median(shares) > 0.97
    assert min(shares) > 0.8


def matched(pose, edges):
    """Compared points of the outline, px, the same after the matching, their shifts, and the mean strength there."""
    contour, points, number = prepared(fitted_poses(pose[None], ArmSizes())[0])
    full, shifts = Objective(contour, number, edges), new_shifts(number + 1)
    match(edges.distances.reshape(-1), edges.stride, number, points, UNIT, contour, shifts)
    values = np.empty((SCRATCH, len(contour.lanes[0])), np.float32)
    strengths(edges.intensities.reshape(-1), edges.stride, number, 0.03, contour, shifts, values)
    s, before = full.between(shifts.shift[:number].astype(float)), full.pixels + 0.5 * full.n
    return before, before + s[:, None] * full.n, s, values[0, LANES : (number + 1) * LANES].sum() / points


def test_the_matching_moves_a_displaced_contour_onto_the_arm(edges):
    """Shifted 1.2 cm in any direction across the view, the matched contour lies where the true one does."""
    sideways, downward = CAMERA.camera_from_world[:2, :3]
    turns = np.linspace(0.0, 2.0 * np.pi, 16, endpoint=False)
    shifts = 0.012 * (np.cos(turns)[:, None] * sideways + np.sin(turns)[:, None] * downward)
    moved = [matched(TRUE + np.tile(shift, 3), edges) for shift in shifts]
    contour, _, own_shifts, strength = matched(TRUE, edges)
    between = 0.5 * (contour + np.roll(contour, -1, axis=0))
    line = np.concatenate([contour, between])

    def apart(points):
        return np.linalg.norm(points[:, None] - line[None], axis=2).min(axis=1).mean()

    assert np.mean([apart(before) for before, _, _, _ in moved]) > 1.9
    assert np.mean([apart(after) for _, after, _, _ in moved]) < 1.0
    assert np.abs(own_shifts).mean() < 0.5
    assert strength > 0.9 > 0.6 > np.mean([one for _, _, _, one in moved]) - 0.35
