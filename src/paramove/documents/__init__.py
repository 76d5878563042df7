"""Reads files within limits: YAML with positions, arrays, images; each fault raises one error with one message."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
