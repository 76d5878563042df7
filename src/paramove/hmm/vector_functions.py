"""Functions of many numbers in plain arithmetic, which becomes vector instructions.

numba's own exponential function and logarithm call the C library once per number.
"""

import numpy as np

from paramove.documents import Floats, Ints
from paramove.hmm.compilation import compiled_arithmetic, compiled_sums

UNDERFLOW = -230.0  # of a fraction that is negligible: 1e-100
LOG2_E = 1.4426950408889634
LN2_HIGH = 0.693147180369123816490  # the upper 33 bits of ln 2, and the rest
LN2_LOW = 1.90821492927058770002e-10
ROUNDING = 6755399441055744.0  # 1.5 * 2^52: adding it rounds to an integer, which is then in the lowest bits
ROUNDING_BITS = 0x4338000000000000  # of that number


@compiled_arithmetic
def exp_of_negative(values: Floats, n: int, bits: Ints, result: Floats) -> None:
    """e^x of the first n values, none above 0; 0 where x is below UNDERFLOW. Plain arithmetic, which is vectorised.

    x = k ln 2 + r with |r| <= ln 2 / 2; the exponent of 2^k is written into the bits of a number.
    """
    rounded = bits.view(np.float64)
    for j in range(n):
        rounded[j] = max(values[j], UNDERFLOW) * LOG2_E + ROUNDING
    for j in range(n):
        k = rounded[j] - ROUNDING
        r = (max(values[j], UNDERFLOW) - k * LN2_HIGH) - k * LN2_LOW
        # Taylor series to r^13 / 13!: the next term is below 5e-18.
        tail = 1 / 479001600 + r * (1 / 6227020800)
        tail = 1 / 3628800 + r * (1 / 39916800 + r * tail)
        tail = 1 / 40320 + r * (1 / 362880 + r * tail)
        tail = 1 / 720 + r * (1 / 5040 + r * tail)
        tail = 1 / 24 + r * (1 / 120 + r * tail)
        tail = 1 / 2 + r * (1 / 6 + r * tail)
        result[j] = 1.0 + r * (1.0 + r * tail)
    for j in range(n):
        bits[j] = (bits[j] + 1023) << 52
    for j in range(n):
        result[j] = result[j] * rounded[j] if values[j] >= UNDERFLOW else 0.0


@compiled_arithmetic
def log_of_one_plus(values: Floats, n: int, result: Floats) -> None:
    """ln(1 + x) of the first n values in [0, 1]: 2 artanh(x / (2 + x)), whose argument is at most 1/3."""
    for j in range(n):
        s = values[j] / (2.0 + values[j])
        q = s * s
        total = 1 / 31 + q * (1 / 33 + q * (1 / 35))
        total = 1 / 27 + q * (1 / 29 + q * total)
        total = 1 / 23 + q * (1 / 25 + q * total)
        total = 1 / 19 + q * (1 / 21 + q * total)
        total = 1 / 15 + q * (1 / 17 + q * total)
        total = 1 / 11 + q * (1 / 13 + q * total)
        total = 1 / 7 + q * (1 / 9 + q * total)
        total = 1 / 3 + q * (1 / 5 + q * total)
        result[j] = 2.0 * s * (1.0 + q * total)


@compiled_arithmetic
def log_of_positive(values: Floats, n: int, bits: Ints, result: Floats) -> None:
    """ln x of the first n values, normal numbers above 0: x = 2^k m with m in [0.7, 1.42), ln m = 2 artanh of at most
    0.172. `bits` is scratch space for n numbers."""
    numbers, mantissas = bits.view(np.float64), result.view(np.int64)
    for j in range(n):
        numbers[j] = values[j]
    for j in range(n):
        # Rounded so that m begins at sqrt(1/2): adding 2^52 (1 - its mantissa) carries into the exponent above it.
        shifted = bits[j] + 0x00095F619980C433
        mantissas[j] = bits[j] - ((shifted >> 52) - 1023 << 52)
        bits[j] = (shifted >> 52) + ROUNDING_BITS - 1023
    for j in range(n):
        k, m = numbers[j] - ROUNDING, result[j]
        s = (m - 1.0) / (m + 1.0)
        q = s * s
        total = 1 / 19 + q * (1 / 21)
        total = 1 / 15 + q * (1 / 17 + q * total)
        total = 1 / 11 + q * (1 / 13 + q * total)
        total = 1 / 7 + q * (1 / 9 + q * total)
        total = 1 / 3 + q * (1 / 5 + q * total)
        result[j] = 2.0 * s * (1.0 + q * total) + k * LN2_LOW + k * LN2_HIGH


@compiled_sums
def add_multiple(factor: float, row: Floats, total: Floats) -> None:
    """Add `factor` times a row to `total`."""
    for j in range(len(row)):
        total[j] += factor * row[j]


@compiled_sums
def dot(first: Floats, second: Floats) -> float:
    """Sum of products."""
    total = 0.0
    for j in range(len(first)):
        total += first[j] * second[j]
    return total
