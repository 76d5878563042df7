"""MCAP recordings: writing them as they happen, in parts; reading them; rebuilding damaged ones."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
