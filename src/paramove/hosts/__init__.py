"""Topics of a run on several hosts: their keys, and the relays that forward what crosses."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
