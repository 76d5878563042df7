"""Where images come from and how they are measured: sources, calibration boards, lenses, places, stereo."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
