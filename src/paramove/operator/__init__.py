"""What asks a person before an arm moves, and what stops it: arming, stopping, jogging from a terminal."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
