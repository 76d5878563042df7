"""How images and postures are compared; the defaults are the thesis's (6.6.4) with the errata's corrections."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

from paramove.documents import InputError

Likelihood = Literal["matched", "simple"]


@dataclass(frozen=True)
class ObservationOptions:
    """Parameters of the observation model.

    Attributes:
        likelihood: "matched" is G+ (6.27) after contour matching (6.26); "simple" is (6.21), (6.22) with the distance
            image (6.23).
        width_px, height_px: Size at which images are compared; camera images are scaled down to it.
        smoothing_px: Standard deviation of the slight smoothing of the image; 0 for none.
        normalised_pixels: N, number of pixels of a 320 x 240 image that reach a gradient of 1; scales with the area.
        min_gradient: Smallest gradient, grey levels per px, that counts as 1: below it an image is only noise.
        gamma: Of (6.21) and (6.27), for one view; 0.15 in the thesis.
        view_exponent: gamma grows with the number V of views by V to this power, since the views have common errors.
        shift_unit: What a pixel counts in the penalties of (6.26), whose unit the thesis does not give.
        key_point_px: Distance of key points along the contour, at most 7.
        region_weight: Nats for a posture under which everything has changed from the learned background, against one
            under which half has; 0 leaves the background out, as the thesis does.
        still_edges: Weight of edges where nothing has changed from the background.
        hidden_px: The background is not learned within this distance of the arm.
        min_background: z of G+ is at least this, which limits the gain on an even background.
    """

    likelihood: Likelihood = "matched"
    width_px: int = 320
    height_px: int = 240
    smoothing_px: float = 0.8
    normalised_pixels: int = 1000
    min_gradient: float = 2.0
    gamma: float = 0.2
    view_exponent: float = 0.1
    shift_unit: float = 0.25
    key_point_px: float = 7.0
    min_background: float = 0.03
    region_weight: float = 24.0
    still_edges: float = 0.1
    hidden_px: int = 9

    def __post_init__(self) -> None:
        if self.likelihood not in ("matched", "simple"):
            raise InputError(f"expected likelihood 'matched' or 'simple', found {self.likelihood!r}")
        if not (32 <= self.width_px <= 960 and 32 <= self.height_px <= 960):
            raise InputError(f"expected images of 32 to 960 px a side, found {self.width_px} x {self.height_px} px")
        for name in ("normalised_pixels", "min_gradient", "gamma", "shift_unit", "min_background"):
            if not getattr(self, name) > 0.0:
                raise InputError(f"expected {name} above 0, found {getattr(self, name)}")
        if not 3.0 <= self.key_point_px <= 7.0:
            raise InputError(f"expected key points every 3 to 7 px, found {self.key_point_px} px")
        if self.region_weight < 0.0 or not 0.0 <= self.still_edges <= 1.0 or not 0 <= self.hidden_px <= 60:
            raise InputError("expected region_weight of at least 0, still_edges of 0 to 1 and hidden_px of 0 to 60")
        if self.smoothing_px < 0.0 or not 0.0 <= self.view_exponent <= 1.0:
            raise InputError("expected smoothing_px of at least 0 and view_exponent of 0 to 1")

    def view_gamma(self, views: int) -> float:
        """Gamma for this many views."""
        return self.gamma * math.pow(max(views, 1), self.view_exponent)
