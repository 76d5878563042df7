"""Size of the terminal by environment variables, which shells, containers and build servers often set oddly."""

import os
from collections.abc import MutableMapping

SIZES = {"COLUMNS": range(20, 10_000), "TERMINAL_WIDTH": range(20, 10_000), "LINES": range(5, 10_000)}
"""Usable values, characters: libraries print nothing with 0 columns, and fill the memory or fail with other ones."""


def drop_unusable_sizes(variables: MutableMapping[str, str] = os.environ) -> None:
    """Removes variables that are no usable size, so that the terminal's own size counts; before anything is printed."""
    for name, usable in SIZES.items():
        if name in variables and not _is_in(variables[name], usable):
            del variables[name]


def _is_in(value: str, usable: range) -> bool:
    is_number = value.isascii() and value.isdigit() and len(value) < 10  # Python limits how many digits it converts
    return is_number and int(value) in usable
