"""Emulated Dynamixel servos behind a serial port, with Protocol 2.0 byte by byte."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
