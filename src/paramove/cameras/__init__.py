"""Cameras: image sources, calibration boards, calibration of lens and pose, stereo."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
