"""Models that are trained from demonstrations at their first use and then cached in a file."""

from __future__ import annotations

import logging
import os
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TypeVar
from zlib import crc32

from platformdirs import user_cache_path

from paramove.phmm.parametric import ParametricHMM
from paramove.phmm.storage import ModelFileError
from paramove.source_code import code_digest

Model = TypeVar("Model", bound=ParametricHMM)
logger = logging.getLogger(__name__)


def stored_model(kind: type[Model], path: Path | None) -> Model | None:
    """The model of a file, if it exists and can be read; logs why it cannot."""
    if path is None or not os.path.exists(path):
        return None
    try:
        return kind.load(path)
    except ModelFileError as error:
        logger.warning("training again, the cached model does not fit: %s", error)
        return None


def cached_model(
    kind: type[Model], name: str, source: str, train: Callable[[], Model], folder: Path | None = None,
    modules: Sequence[str] = (),
) -> Model:  # fmt: skip
    """The model of that source and of the present code in a folder, by default the user's cache; else trained anew.

    Args:
        kind: of the model. name: of its file.
        source: what it is trained from and how, which its description then names; each source has its own file.
        train: gives one with a description; called only if it is needed.
        modules: whose code, with all that they import, determines the model, in addition to the module of `train`.
    """
    cache_folder = folder if folder is not None else user_cache_path("paramove") / "actions"
    path = cache_folder / f"{name}_{crc32(source.encode()):08x}.npz"
    source = f"{source}, code {code_digest(train.__module__, *modules)}"
    stored = stored_model(kind, path)
    if stored is not None and stored.description is not None and stored.description.source == source:
        return stored
    model = train()
    assert model.description is not None
    model.description = replace(model.description, source=source)
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        model.save(path)
    except OSError as error:
        logger.warning("the trained model is not cached: %s", error)
    return model
