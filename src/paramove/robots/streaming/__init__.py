"""Trajectories as a stream of joint angles, in batches that end in stop ramps of their own."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
