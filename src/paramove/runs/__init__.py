"""What a run was worth: numbers, report and video of a run, and the same over many runs. May read the ground truth."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
