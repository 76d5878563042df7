"""The observation model of thesis 6.6: how well images agree with a posture of the arm."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
