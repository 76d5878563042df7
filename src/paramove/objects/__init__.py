"""Coloured objects and a hand on a table: tracking, the plane's homography, and gesture recognition."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
