"""Dynamixel servos on a serial bus: packets of Protocol 2.0, control tables, and servos emulated at the wire."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
