"""Tracking in action space: the arm followed as action, parameters and progress (thesis chapter 6)."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
