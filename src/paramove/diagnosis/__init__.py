"""What is wrong with a machine, its installation and what is plugged in, with the command that fixes it."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
