"""Writes docs/reference/api.md: every public name of the library's parts with the first sentence of its docstring.

Usage: python docs/api_page.py
"""

from __future__ import annotations

import importlib
import inspect
import re
from pathlib import Path
from types import ModuleType
from typing import Any

ROOT = Path(__file__).parent.parent
PAGE = ROOT / "docs" / "reference" / "api.md"
PACKAGES = sorted(
    ".".join(stub.parent.relative_to(ROOT / "src").parts)
    for stub in (ROOT / "src").rglob("__init__.pyi")
    if stub.parent.name != "cli"  # commands have their own help
)
HEAD = """\
# API

The public names of the library, with the first sentence of their docstrings. `make docs` builds pages with all methods,
arguments, shapes and units, and a search, into `build/docs/api`. In Python, `help(name)` shows the same. By example:
[Use the library from Python](../how-to/use_from_python.md).

Shapes: T frames, D components of a frame, P components of theta, N states, K movements. Lengths are in the unit of what
the model was trained with; sets of demonstrations are in metres, seconds and radians. This page is written by
`python docs/api_page.py`.
"""


def first_sentence(thing: Any) -> str:
    """The first sentence of a docstring, on one line."""
    text = " ".join((inspect.getdoc(thing) or "").split("\n\n")[0].split())
    return re.split(r"(?<=[.!?])\s+(?=[A-Z(])", text)[0]


def public_names(package: ModuleType) -> list[str]:
    """What the package offers."""
    return sorted(package.__all__, key=str.lower)


def api_page() -> str:
    """The page."""
    parts = [HEAD]
    for name in PACKAGES:
        package = importlib.import_module(name)
        parts.append(f"\n## {name}\n\n{first_sentence(package)}\n\n| name | what it is |\n|---|---|\n")
        for public in public_names(package):
            thing = getattr(package, public)
            link = f"`{public}`"
            ours = getattr(thing, "__module__", "").split(".")[0] in ("dynamixel_emulator", "paramove")
            if ours:
                file = Path(inspect.getfile(importlib.import_module(thing.__module__))).relative_to(ROOT)
                link = f"[{link}](../../{file})"
            described = ours or inspect.ismodule(thing)
            value = re.sub(r" at 0x[0-9a-f]+", "", inspect.formatannotation(thing))  # another one in each process
            detail = first_sentence(thing) if described else f"`{value:.120}`"
            parts.append(f"| {link} | {detail.replace('|', '&#124;')} |\n")
    return "".join(parts)


if __name__ == "__main__":
    PAGE.write_text(api_page(), encoding="utf-8")
