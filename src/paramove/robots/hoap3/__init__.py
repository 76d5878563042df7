"""Fujitsu's HOAP-3: its firmware's position loop, emulated."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
