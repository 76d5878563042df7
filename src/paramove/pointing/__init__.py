"""Pointing with the arm: targets of tracking in action space, and the paper's recent window of arm poses."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
