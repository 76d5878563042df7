"""Names of launch files and their keys: which were probably meant, and where the files lie."""

from __future__ import annotations

import difflib
from collections.abc import Iterable
from pathlib import Path


def closest(word: str, known: Iterable[str]) -> list[str]:
    """The word among `known` that is nearest to `word`; none if none is near."""
    return difflib.get_close_matches(word, sorted(known), n=1, cutoff=0.6)


def nearest(word: str, known: Iterable[str]) -> str:
    """The word among `known` that is nearest to `word`, else all of them, as a phrase for an error."""
    choices = sorted(known)
    close = closest(word, choices)
    if close:
        return f"did you mean '{close[0]}'?"
    return f"there are: {', '.join(choices)}" if choices else "there are none"


def overlay_folder(folder: Path, launch: str, overlay: str) -> Path:
    """Where an overlay lies: made for this launch file alone in `overlays/<launch file>`, else in `overlays`."""
    own = folder / "overlays" / launch
    return own if (own / f"{overlay}.yaml").is_file() else folder / "overlays"
