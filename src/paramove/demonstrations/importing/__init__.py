"""Files of motion capture read into takes: C3D, BVH, CSV and NPZ."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
