"""The one way in which numerical kernels are compiled.

numba looks only at the file of a kernel to see whether its compiled form on disk is stale, not at kernels of others
that it calls. Whoever changes one of these deletes the compiled forms: `find src -name "*.nb[ic]" -delete`.
"""

from collections.abc import Callable
from typing import Any, TypeVar, cast

import numba

Function = TypeVar("Function", bound=Callable[..., Any])


def compiled(function: Function) -> Function:
    """Compile with numba in nopython mode, without the interpreter lock, kept on disk between runs.

    numba's own decorator is untyped; this one keeps the signature for the type checker.
    """
    return cast(Function, numba.njit(cache=True, nogil=True)(function))


def compiled_sums(function: Function) -> Function:
    """The same for sums of products: terms may be added in another order and multiplied and added in one step.

    That lets the compiler use vector instructions. Infinities and NaN keep their meaning, unlike with full fastmath.
    """
    return cast(Function, numba.njit(cache=True, nogil=True, fastmath={"contract", "reassoc"})(function))


def compiled_arithmetic(function: Function) -> Function:
    """The same for arithmetic in a fixed order: division by zero gives infinity or NaN, as in numpy, and no error.

    A test for zero at each division would keep the compiler from using vector instructions.
    """
    flags = {"contract"}
    return cast(Function, numba.njit(cache=True, nogil=True, error_model="numpy", fastmath=flags)(function))
