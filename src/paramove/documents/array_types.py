"""Types of arrays; the docstring of each array gives its shape and unit."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Bytes = NDArray[np.uint8]
Image = NDArray[Any]
"""uint8, [H, W] or [H, W, 3] in the order blue, green, red; OpenCV's annotations know only integer and floating."""
