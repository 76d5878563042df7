"""Movement models trained from demonstration sets, cross-validated, drawn, compared and applied."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
