"""The one way in which numerical kernels are compiled."""

from collections.abc import Callable
from typing import Any, TypeVar, cast

import numba

Function = TypeVar("Function", bound=Callable[..., Any])


def compiled(function: Function) -> Function:
    """Compile with numba in nopython mode, without the interpreter lock, kept on disk between runs.

    numba's own decorator is untyped; this one keeps the signature for the type checker.
    """
    return cast(Function, numba.njit(cache=True, nogil=True)(function))
