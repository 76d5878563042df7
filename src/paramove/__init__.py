"""paramove: parametric human movements, learned from few demonstrations."""

import importlib.metadata

__version__ = importlib.metadata.version("paramove")
