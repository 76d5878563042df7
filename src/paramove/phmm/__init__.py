"""Parametric hidden Markov models: one model of a movement for all its parameters (thesis chapter 3)."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
