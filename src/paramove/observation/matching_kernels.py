"""Kernels of the contour matching: the objective function (6.26) and its maximisation (thesis 6.6.4).

A shift of one key point changes the gradients of the two segments that it ends and two distortions; the rest of the
objective is kept. A key point is not tried again with a useless step until it or a neighbour has moved by
half of that step or more: that skips three of five trials and costs about a thousandth of the objective.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from paramove.documents import Bytes
from paramove.hmm import compiled, compiled_arithmetic
from paramove.observation.contour_kernels import Contour
from paramove.observation.segment_sums import trial_sums

Floats32 = NDArray[np.float32]
Ints32 = NDArray[np.int32]

ITERATIONS = 15
"""The 16th would be the first with steps of 1/16 px, and images are compared by whole pixels."""
GRADIENTS, SHIFTS, DISTORTIONS = 7.5, 1.0, 4.0
"""Factors of alpha_1(x) = 7.5 x^2, alpha_2(x) = x, alpha_3(x) = 4 x."""
MIN_GAIN = 1e-9
"""Minimum improvement of E."""
LENGTHWISE = np.float32(0.11)
"""Factor of |q|^2 in c."""

STEP_BITS = np.array([(i & -i).bit_length() - 1 for i in range(1, ITERATIONS + 1)], np.int32)
"""Steps 1, 0.5, 1, 0.25, 1, 0.5, 1, 0.125, ...: the i-th is 2 to the minus number of zeros at the end of i."""


class Shifts(NamedTuple):
    """Of the matching, all (K_max,) or (4, K_max).

    Attributes:
        shift: s^k along the normals, px.
        sums: of the bytes of the distance images along segment k.
        bends: distortion c(s^k, s^{k+1}).
        slopes: of q and q_perp with s^k and with s^{k+1}, per px.
        fruitless: bits of the steps that were of no use since the last change nearby.
    """

    shift: Floats32
    sums: Ints32
    bends: Floats32
    slopes: Floats32
    fruitless: Ints32


@compiled
def new_shifts(maximum: int) -> Shifts:
    """Arrays for this many key points."""
    return Shifts(
        np.zeros(maximum, np.float32),
        np.zeros(maximum, np.int32),
        np.zeros(maximum, np.float32),
        np.zeros((4, maximum), np.float32),
        np.zeros(maximum, np.int32),
    )


@compiled_arithmetic
def bend(slopes: Floats32, k: int, here: np.float32, there: np.float32) -> np.float32:
    """c(s^k, s^{k+1}) = 0.11 |q|^2 + |q_perp|^2.5."""
    q = slopes[1, k] * there - slopes[0, k] * here
    across = slopes[3, k] * there - slopes[2, k] * here
    return np.float32(LENGTHWISE * q * q + across * across * np.sqrt(abs(across)))


@compiled_arithmetic
def prepare_slopes(number: int, unit: float, contour: Contour, shifts: Shifts) -> None:
    """q and q_perp are linear in the shifts: their slopes, with a pixel counting `unit`."""
    for k in range(number):
        after = k + 1 if k + 1 < number else 0
        mx = contour.keys[0, after] - contour.keys[0, k]
        my = contour.keys[1, after] - contour.keys[1, k]
        size = np.float32(unit) / np.sqrt(max(mx * mx + my * my, np.float32(1e-6)))
        mx, my = mx * size, my * size
        for side in range(2):
            end = k if side == 0 else after
            nx, ny = contour.normals[0, end], contour.normals[1, end]
            shifts.slopes[side, k] = mx * nx + my * ny
            shifts.slopes[2 + side, k] = mx * ny - my * nx


@compiled_arithmetic
def begin(images: Bytes, stride: int, number: int, unit: float, contour: Contour, shifts: Shifts) -> int:
    """All shifts 0; the sum of bytes along the contour."""
    prepare_slopes(number, unit, contour, shifts)
    zero, total = np.float32(0.0), 0
    for k in range(number):
        shifts.shift[k], shifts.fruitless[k], shifts.bends[k] = zero, 0, zero
        _, shifts.sums[k], _, _ = trial_sums(images, contour.lanes, k, zero, zero, zero, zero, np.float32(stride))
        total += shifts.sums[k]
    return total


@compiled_arithmetic
def match(images: Bytes, stride: int, number: int, points: int, unit: float, contour: Contour, shifts: Shifts) -> float:
    """Maximise E (6.26) from s = 0; leaves the shifts in `shifts` and returns E.

    images: distance images, 255 for 1; points: that are compared; unit: what a pixel counts in the penalties.
    """
    s, bends, sums, fruitless, row = shifts.shift, shifts.bends, shifts.sums, shifts.fruitless, np.float32(stride)
    total = begin(images, stride, number, unit, contour, shifts)
    gain = GRADIENTS / (255.0 * points) ** 2
    shift_cost, bend_cost = SHIFTS * unit * unit / number, DISTORTIONS / number
    gradients, cost = gain * total * total, 0.0  # E = gradients - cost
    for iteration in range(ITERATIONS):
        bit = np.int32(1 << STEP_BITS[iteration])
        step = np.float32(1.0) / np.float32(bit)
        for k in range(number):
            if fruitless[k] & bit:
                continue
            before, after = k - 1 if k > 0 else number - 1, k + 1 if k + 1 < number else 0
            left, here, right = s[before], s[k], s[after]
            up, down = here + step, here - step
            up_a, up_b, down_a, down_b = trial_sums(images, contour.lanes, k, left, here, right, step, row)
            up_c, up_d = bend(shifts.slopes, before, left, up), bend(shifts.slopes, k, up, right)
            down_c, down_d = bend(shifts.slopes, before, left, down), bend(shifts.slopes, k, down, right)
            rest_sum = total - sums[before] - sums[k]
            rest_cost = cost - shift_cost * here * here - bend_cost * (bends[before] + bends[k])
            up_sum, down_sum = rest_sum + up_a + up_b, rest_sum + down_a + down_b
            up_cost = rest_cost + shift_cost * up * up + bend_cost * (up_c + up_d)
            down_cost = rest_cost + shift_cost * down * down + bend_cost * (down_c + down_d)
            higher, lower = gain * up_sum * up_sum - up_cost, gain * down_sum * down_sum - down_cost
            if max(higher, lower) <= gradients - cost + MIN_GAIN:
                fruitless[k] |= bit
                continue
            if higher >= lower:
                s[k], sums[before], sums[k], bends[before], bends[k] = up, up_a, up_b, up_c, up_d
                total, cost = up_sum, up_cost
            else:
                s[k], sums[before], sums[k], bends[before], bends[k] = down, down_a, down_b, down_c, down_d
                total, cost = down_sum, down_cost
            gradients = gain * total * total
            larger = (bit - 1) >> 1  # bits of steps more than twice as large
            fruitless[before] &= larger
            fruitless[k] &= larger
            fruitless[after] &= larger
    return gradients - cost
