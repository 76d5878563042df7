"""Imports of libraries that only the comparison needs."""

from __future__ import annotations

import importlib
from types import ModuleType


class PeerMissingError(ImportError):
    """A library of the extra `peers` is not installed."""


def library(module: str, package: str) -> ModuleType:
    """A module of a peer. Raises PeerMissingError with the command that installs it."""
    try:
        return importlib.import_module(module)
    except ImportError as error:
        raise PeerMissingError(
            f"{package} is not installed: pip install 'paramove[peers]' brings it ({error})"
        ) from error
