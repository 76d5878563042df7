"""Alignment of movements in time: dynamic time warping (thesis appendix B)."""

from paramove.alignment.warping import Alignment, movement_distance, warp

__all__ = ["Alignment", "movement_distance", "warp"]
