"""Robots by their descriptions, and what drives them: HOAP-3's stream and arms of Dynamixel servos."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
