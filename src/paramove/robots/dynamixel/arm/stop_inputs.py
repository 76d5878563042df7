"""Emergency stops that are files: one that a program creates, and the line of a button as the system presents it."""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

MAX_BYTES = 16


@dataclass(frozen=True)
class StopInputs:
    """What presses the emergency stop.

    Attributes:
        file: Pressed while there is a file of this name; None: there is no such stop.
        line: File in which the system presents a line, 0 or 1, such as /sys/class/gpio/gpio17/value; None: no line.
            Only the one value of "released" is not pressed: a line that cannot be read, or a missing file, is pressed.
        line_pressed: Its value while the button is pressed; with a button that opens its circuit, and a resistor that
            pulls the line up, 1: then a cut wire is pressed too.
    """

    file: Path | None = None
    line: Path | None = None
    line_pressed: Literal[0, 1] = 1

    @property
    def are_there(self) -> bool:
        """Whether the arm has such a stop."""
        return self.file is not None or self.line is not None

    def pressed(self) -> str:
        """Why the emergency stop is pressed, for people; "" if it is not."""
        by_file = "" if self.file is None else _pressed_by_file(self.file)
        return by_file or ("" if self.line is None else self._pressed_by_line(self.line))

    def _pressed_by_line(self, line: Path) -> str:
        released = str(1 - self.line_pressed)
        try:
            value = _first_bytes(line)
        except OSError as error:
            return f"the emergency stop counts as pressed: {line} cannot be read ({error.strerror})"
        if value == released:
            return ""
        return f"the emergency stop is pressed: {line} reads {value!r}, released is {released!r}"


def _pressed_by_file(file: Path) -> str:
    try:
        file.lstat()
    except FileNotFoundError:
        return ""
    except OSError as error:
        return f"the emergency stop counts as pressed: {file} cannot be looked for ({error.strerror})"
    return f"the emergency stop is pressed: there is a file {file}"


def _first_bytes(path: Path) -> str:
    """Does not block, whatever kind of file it is. Raises OSError."""
    descriptor = os.open(path, os.O_RDONLY | os.O_NONBLOCK | os.O_CLOEXEC)
    try:
        return os.read(descriptor, MAX_BYTES).decode("ascii", "backslashreplace").strip()
    finally:
        os.close(descriptor)
