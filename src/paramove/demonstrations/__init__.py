"""Demonstrations of movements: the synthetic demonstrator and training sets made with it."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
