"""Movement models trained from demonstration sets, checked by leaving out, drawn, compared and asked."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
