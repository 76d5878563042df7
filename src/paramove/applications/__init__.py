"""Applications: the logic of rule learning, relocation by pointing and reaching, over messages, for any robot."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
