"""The error for input that a program cannot use: files, devices, parameters."""

from __future__ import annotations

from paramove.documents import exit_codes


class InputError(ValueError):
    """An input that is missing or wrong; a restart with the same input would end the same way.

    The message is one line for people: what was expected, what was found and what helps.

    Attributes:
        missing: The input does not exist.
    """

    def __init__(self, message: str, missing: bool = False) -> None:
        super().__init__(" ".join(message.split()))
        self.missing = missing

    @property
    def exit_code(self) -> int:
        """Of a process that ends because of it: 66 for a missing input, 78 for a wrong one."""
        return exit_codes.INPUT_MISSING if self.missing else exit_codes.CONFIGURATION
