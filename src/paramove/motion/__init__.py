"""A learned movement on a robot's body (thesis 5.2): conversion, inverse kinematics, goals, clearance, timing."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
