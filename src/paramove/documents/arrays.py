"""NPZ files: arrays without pickles, whose sizes are checked before memory is allocated."""

from __future__ import annotations

import io
import struct
import tokenize
import zipfile
import zlib
from collections.abc import Collection
from math import prod
from pathlib import Path
from typing import Any

import numpy as np
from numpy.lib import format as npy
from numpy.typing import NDArray

from paramove.documents.files import MEBIBYTE, size_of, unreadable
from paramove.documents.input_error import InputError

ARRAY_BYTES = 512 * MEBIBYTE
"""Limit for all arrays that are read: an hour of 40 points at 100 Hz has 350 MB."""
ALWAYS_BYTES = 64 * MEBIBYTE
MAX_RATIO = 30
"""Arrays above `ALWAYS_BYTES` may be so many times as large as their file; recorded movements are at most 5."""
MAX_ARRAYS = 5000
MAX_EMPTY = 1_000_000
DIRECTORY_BYTES = 2 * MEBIBYTE
_COMPRESSIONS = (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED)
_ENCRYPTED = 1
_HEADERS = {(1, 0): npy.read_array_header_1_0, (2, 0): npy.read_array_header_2_0}
_DAMAGED = (
    ValueError, OSError, EOFError, LookupError, NotImplementedError, RuntimeError, OverflowError, SyntaxError,
    TypeError, MemoryError, struct.error, tokenize.TokenError, zipfile.BadZipFile, zlib.error,
)  # fmt: skip
"""What numpy and zipfile raise for damaged bytes."""


class _Reader(io.BufferedReader):
    """Limits the size of the archive's directory, which zipfile reads at once."""

    def read(self, size: int | None = -1, /) -> bytes:
        if size is not None and size > DIRECTORY_BYTES:
            raise ValueError(f"its directory claims {size} bytes")
        return super().read(size)


def read_arrays(
    path: Path,
    kind: str = "file of arrays (.npz)",
    raising: type[InputError] = InputError,
    only: Collection[str] = (),
    max_bytes: int = ARRAY_BYTES,
    max_arrays: int = MAX_ARRAYS,
) -> dict[str, NDArray[Any]]:
    """The arrays of a file by their names; of compressed files those that numpy writes.

    Args:
        path: Of the file.
        kind: What the file should be, for people.
        raising: Class of what is raised.
        only: Names of the arrays to read, if they exist; empty for all.
        max_bytes: Maximum of all arrays that are read, decompressed.
        max_arrays: Maximum number in the file.

    Raises `raising` if there is no such file, if it is damaged, larger than allowed, or holds objects.
    """
    size = size_of(path, kind, raising, 4 * ARRAY_BYTES)
    try:
        with _Reader(io.FileIO(path)) as file, zipfile.ZipFile(file) as archive:
            members = {member.filename.removesuffix(".npy"): member for member in archive.infolist()}
            requested = {name: member for name, member in members.items() if not only or name in only}
            claimed = sum(member.file_size for member in requested.values())
            allowed = min(max_bytes, max(ALWAYS_BYTES, MAX_RATIO * size))
            if claimed > allowed or len(members) > max_arrays:
                raise raising(
                    f"{path}: expected at most {max_arrays} arrays of {allowed >> 20} MB together, "
                    f"found {len(members)} of {claimed / MEBIBYTE:.0f} MB in a file of {size / MEBIBYTE:.1f} MB"
                )
            return {name: _array(path, archive, member, raising) for name, member in requested.items()}
    except raising:
        raise
    except PermissionError as error:
        raise raising(unreadable(path, error)) from error
    except _DAMAGED as error:
        raise raising(
            f"{path}: expected a {kind}, found {size} bytes of something else, cut off or damaged ({error!s:.200})"
        ) from error


def _array(path: Path, archive: zipfile.ZipFile, member: zipfile.ZipInfo, raising: type[InputError]) -> NDArray[Any]:
    if member.compress_type not in _COMPRESSIONS or member.flag_bits & _ENCRYPTED:
        raise raising(
            f"{path}: {member.filename!r:.80} is encrypted or compressed in an unusual way; expected an archive as "
            "numpy.savez and numpy.savez_compressed write it"
        )
    with archive.open(member) as file:
        version = npy.read_magic(file)
        if version not in _HEADERS:
            raise ValueError(f"array format {version}, (1, 0) expected")
        shape, _, dtype = _HEADERS[version](file)
        if dtype.hasobject:
            raise raising(f"{path}: expected plain numbers in {member.filename!r:.80}, found pickled objects")
        claimed = prod(shape) * dtype.itemsize
        if min(shape, default=0) < 0 or file.tell() + claimed != member.file_size:
            raise ValueError(f"{member.filename!r:.80} claims {claimed} bytes of numbers in {member.file_size}")
        if not dtype.itemsize and prod(shape) > MAX_EMPTY:
            raise ValueError(f"{member.filename!r:.80} claims {prod(shape)} values of no length")
    with archive.open(member) as file:
        array: NDArray[Any] = npy.read_array(file, allow_pickle=False)
    if array.dtype.kind == "U" and array.size and array.dtype.itemsize:
        codes = np.ascontiguousarray(array, dtype=array.dtype.newbyteorder("=")).view(np.uint32)
        if np.any((codes - 0xD800 < 0x800) | (codes > 0x10FFFF)):  # unsigned: only 0xD800 to 0xDFFF are below 0x800
            raise ValueError(f"{member.filename!r:.80} holds halves of characters, which no text has")
    return array
