"""The live page: camera image, estimates and actions of a running application in a browser, and a stop button."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
