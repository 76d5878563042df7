"""Compilation of all numerical kernels with numba, which is imported when the first of them is called.

A process that has kernels but calls none, such as one that only synthesises, does without a second of imports.
"""

from collections.abc import Callable
from functools import cached_property, update_wrapper
from typing import Any, TypeVar, cast

Function = TypeVar("Function", bound=Callable[..., Any])


_WITHIN_CALLERS = True
"""What may be rounded in several ways becomes a part of each kernel that calls it.

Else the process that compiles calls its machine code of its own, and processes that load the caller's stored machine
code call the copy in there: the compiler may have chosen another rounding for either.
"""


def compiled(function: Function) -> Function:
    """Compile with numba in nopython mode, without the interpreter lock, stored on disk between runs.

    numba's own decorator is untyped; this one keeps the signature for the type checker.
    """
    return _compiled(function)


def compiled_sums(function: Function) -> Function:
    """The same for sums of products: terms may be added in another order and multiplied and added in one step.

    That lets the compiler use vector instructions. Infinities and NaN keep their meaning, unlike with full fastmath.
    """
    return _compiled(function, fastmath={"contract", "reassoc"}, forceinline=_WITHIN_CALLERS)


def compiled_arithmetic(function: Function) -> Function:
    """The same for arithmetic in a fixed order: division by zero gives infinity or NaN, as in numpy, and no error.

    A test for zero at each division would keep the compiler from using vector instructions.
    """
    return _compiled(function, error_model="numpy", fastmath={"contract"}, forceinline=_WITHIN_CALLERS)


class Kernel:
    """A compiled function; numba makes its `dispatcher` when it is first called, or a kernel that calls it."""

    def __init__(self, function: Callable[..., Any], options: dict[str, Any]) -> None:
        update_wrapper(self, function)
        self._function = function
        self._options = options

    def __call__(self, *arguments: Any) -> Any:
        return self.dispatcher(*arguments)

    @cached_property
    def dispatcher(self) -> Any:
        from paramove.hmm.machine_code import dispatcher

        return dispatcher(self._function, self._options)

    @property
    def _numba_type_(self) -> Any:  # numba asks for it where another kernel calls this one
        return self.dispatcher._numba_type_


def _compiled(function: Function, **options: Any) -> Function:
    return cast(Function, Kernel(function, options))
