"""Machine code of the kernels on disk.

Machine code is stored next to the source, or in the user's cache folder where that cannot be written. numba looks only
at the file of a kernel to see whether its machine code is stale, not at kernels of others that were compiled into it,
and its index loses entries when several processes write it. So a digest of all inputs is in the name
of each file here. Where neither folder can be written, each process compiles the kernels that it needs.
"""

import hashlib
import logging
from collections.abc import Callable
from functools import cache
from multiprocessing import parent_process
from pathlib import Path
from typing import Any

import llvmlite
import numba
import numpy as np
from numba.core.caching import FunctionCache, IndexDataCacheFile

from paramove.source_code import code_digest

LIBRARIES = f"numba {numba.__version__}, llvmlite {llvmlite.__version__}, numpy {np.__version__}"
logger = logging.getLogger(__name__)


def dispatcher(function: Callable[..., Any], options: dict[str, Any]) -> Any:
    """What numba makes of a function: it chooses among its machine code by the types of arguments."""
    compiled = numba.njit(nogil=True, **options)(function)
    try:
        stored = FunctionCache(function)
    except RuntimeError:  # there is no folder that can be written
        _announce_unstored()
        return compiled
    stored._cache_file = KernelFiles(stored.cache_path, stored._impl.filename_base, code_digest(function.__module__))
    compiled._cache = stored
    return compiled


class KernelFiles(IndexDataCacheFile):
    """One file of machine code per signature and processor; its name has the digest of the code, which is the stamp."""

    def load(self, key: object) -> Any:
        """The machine code for a key of signature, processor and bytecode; None if there is none."""
        try:
            return self._load_data(self._file_for(key))
        except Exception:  # missing or damaged: damaged bytes can raise anything
            _announce()
            return None

    def save(self, key: object, data: Any) -> None:
        """Writes machine code; removes files of the same module that are stale."""
        module = self._data_name_pattern.partition(".")[0]
        try:
            self._save_data(self._file_for(key), data)
            for file in Path(self._cache_path).glob(f"{module}.*.nb[ci]*"):
                if f".{self._source_stamp}." not in file.name:
                    file.unlink(missing_ok=True)
        except OSError as error:
            logger.warning("the compiled kernel is not stored: %s", error)

    def _file_for(self, key: object) -> str:
        digest = hashlib.sha256(f"{key}, {LIBRARIES}".encode()).hexdigest()[:16]
        return str(self._data_name_pattern.format(number=0)).replace(".0.nbc", f".{self._source_stamp}.{digest}.nbc")


@cache
def _announce_unstored() -> None:
    """Logs once, and not in every process of a pool."""
    if parent_process() is None:
        logger.warning(
            "numerical kernels are compiled again in every process, seconds to two minutes: their machine code cannot "
            "be stored; set NUMBA_CACHE_DIR to a folder that can be written"
        )


@cache
def _announce() -> None:
    """Logs once, and not in every process of a pool; with the default settings of logging, to the terminal."""
    if parent_process() is None:
        logger.warning("compiling numerical kernels: seconds to two minutes, once ('paramove warm' does it ahead)")
