"""The one gate between a commanded motion and a motor: a pure function of time and inputs."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
