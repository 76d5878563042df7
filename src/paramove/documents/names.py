"""The check of every name that becomes a file: an action, a recording, a set, a host, a node, a robot.

A file with `../` in its name, or with an absolute path as its name, would lie outside the folder that it is meant for;
a name that is too long, or no text in UTF-8, fails when everything has been computed. So a name is checked where it
enters.
"""

from __future__ import annotations

import re
from typing import Annotated

from pydantic import AfterValidator, Field
from pydantic_core import PydanticCustomError

from paramove.documents.input_error import InputError
from paramove.documents.wording import printable

MAX_NAME_BYTES = 200
"""In UTF-8. Linux allows 255 for a file; endings such as `.training.json`, and those of unfinished files, take up to
55."""
IDENTIFIER = r"^[a-z][a-z0-9_]*$"


def name_fault(name: str) -> str:
    """Why `name` cannot be the name of a file, and what can; "" if it can."""
    try:
        size = len(name.encode())
    except UnicodeEncodeError:
        return "a name is text in UTF-8, these bytes are none"
    if not name.strip(" "):
        return "a name has at least one letter or digit"
    if "/" in name or "\\" in name:
        return "a name has no '/' and no '\\': it is a single name, no path"
    if name.startswith((".", "-")):
        return f"a name does not begin with '{name[0]}'"
    if not name.isprintable():
        return "a name has no line breaks, tabs or other characters that cannot be printed"
    if name != name.strip(" "):
        return "a name neither begins nor ends with a blank"
    if size > MAX_NAME_BYTES:
        return f"a name has at most {MAX_NAME_BYTES} bytes, this one {size}"
    return ""


def checked_name(name: str, what: str, raising: type[InputError] = InputError) -> str:
    """The name, if it can be the name of a file.

    Args:
        name: From a user, a file or another process.
        what: What has this name, for the error, such as "action".
        raising: Class of the error.

    Raises:
        InputError: Or `raising`: it is a path, is hidden, too long, cannot be printed, or is no text in UTF-8.
    """
    fault = name_fault(name)
    if fault:
        raise raising(f"{what} '{printable(name):.80}': {fault}")
    return name


def is_identifier(name: str) -> bool:
    """Whether a node, a host, an overlay or a launch file may be called so: see `Identifier`."""
    return len(name) <= 40 and re.fullmatch(IDENTIFIER.strip("^$"), name) is not None


def _validated(name: str) -> str:
    fault = name_fault(name)
    if fault:
        raise PydanticCustomError("file_name", "{fault}", {"fault": fault})
    return name


FileName = Annotated[str, AfterValidator(_validated)]
"""A field of a pydantic model with the name of a file: see `name_fault`."""
Identifier = Annotated[str, Field(pattern=IDENTIFIER, max_length=40)]
"""A field with a name that is also a key: lower-case letters, digits and `_`, which can be the name of a file, too."""
