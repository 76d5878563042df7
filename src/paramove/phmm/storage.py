"""Model files: one .npz without pickles, checked when read."""

import json
import struct
import tokenize
import zipfile
import zlib
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from math import prod
from pathlib import Path
from typing import Any, NoReturn

import numpy as np
from numpy.lib import format as npy
from numpy.typing import NDArray

from paramove.documents.atomic_writing import replacing
from paramove.hmm import TrainingOptions, TrainingSummary
from paramove.input_error import InputError
from paramove.phmm.description import MovementDescription

Floats = NDArray[np.float64]
FORMAT_VERSION = 1
MOST_BYTES = 256 * 2**20
"""Of all arrays together; the reaching model of 8 local models has 8 MB."""
MOST_ARRAYS = 500
"""Every modelled beginning has seven; of movements of a minute there are 25."""
_DAMAGED = (
    ValueError, OSError, EOFError, LookupError, NotImplementedError, RuntimeError, OverflowError, SyntaxError,
    TypeError, struct.error, tokenize.TokenError, zipfile.BadZipFile, zlib.error,
)  # fmt: skip
"""What numpy and zipfile raise for damaged bytes, which depends on the byte."""


class ModelFileError(InputError):
    """A model file is missing, damaged, of another version or class, or holds values that do not fit together."""


@dataclass(frozen=True)
class ModelRecord:
    """The content of a model file: class name, constructor arguments, training summary, learned arrays."""

    class_name: str
    parameters: Mapping[str, Any]
    training: TrainingSummary | None
    arrays: Mapping[str, Floats]


def write_record(path: Path, record: ModelRecord) -> None:
    """Write a record. The header is text in an array; numbers are plain arrays, so no reader needs pickle.

    The file appears when it is complete, so a process that is killed meanwhile leaves no half of one.
    """
    header = {
        "class": record.class_name,
        "parameters": {name: _plain(value) for name, value in record.parameters.items()},
        "training": None if record.training is None else asdict(record.training),
    }
    arrays: dict[str, Any] = {f"learned_{name}": value for name, value in record.arrays.items()}
    with replacing(path) as unfinished, unfinished.open("wb") as file:
        np.savez_compressed(file, format_version=FORMAT_VERSION, header=json.dumps(header, sort_keys=True), **arrays)


def read_record(path: Path) -> ModelRecord:
    """Read a record. Raises ModelFileError with what was expected and found."""
    content = _arrays_of(path)
    missing = sorted({"format_version", "header"} - set(content))
    if missing:
        found = ", ".join(sorted(content)) or "nothing"
        raise ModelFileError(f"{path}: expected a model file, which has {' and '.join(missing)}; found {found:.200}")
    _check_version(path, content["format_version"])
    arrays = {name.removeprefix("learned_"): value for name, value in content.items() if name.startswith("learned_")}
    for name, value in arrays.items():
        if value.dtype != np.float64 or not np.isfinite(value).all():
            raise ModelFileError(f"{path}: expected finite numbers in {name!r}, found NaN, infinity or {value.dtype}")
    try:
        header = json.loads(str(content["header"]), parse_constant=_refuse_constant)
        parameters = {name: _rich(name, value) for name, value in header["parameters"].items()}
        training = _summary(header["training"])
        return ModelRecord(str(header["class"]), parameters, training, arrays)
    except (AttributeError, LookupError, RecursionError, TypeError, ValueError) as error:
        raise ModelFileError(f"{path}: the header cannot be read: {error}") from error


def _arrays_of(path: Path) -> dict[str, NDArray[Any]]:
    """Every array of the file. Sizes are checked before memory is taken: a few bytes may claim terabytes."""
    if not path.exists():
        raise ModelFileError(f"there is no model file {path}", missing=True)
    if not path.is_file():
        raise ModelFileError(f"{path}: expected a model file (.npz), found a folder or device")
    try:
        with zipfile.ZipFile(path) as archive:
            members = archive.infolist()
            size = sum(member.file_size for member in members)
            if size > MOST_BYTES or len(members) > MOST_ARRAYS:
                raise ModelFileError(
                    f"{path}: expected at most {MOST_ARRAYS} arrays of {MOST_BYTES >> 20} MB together, "
                    f"found {len(members)} of {size / 2**20:.0f} MB"
                )
            return {member.filename.removesuffix(".npy"): _array(path, archive, member) for member in members}
    except ModelFileError:
        raise
    except PermissionError as error:
        raise ModelFileError(f"{path}: no right to read it; run 'chmod u+r {path}'") from error
    except _DAMAGED as error:
        size = path.stat().st_size
        raise ModelFileError(
            f"{path}: expected a model file (.npz), found {size} bytes of something else, cut off or damaged ({error})"
        ) from error


def _array(path: Path, archive: zipfile.ZipFile, member: zipfile.ZipInfo) -> NDArray[Any]:
    with archive.open(member) as file:
        version = npy.read_magic(file)
        if version != (1, 0):
            raise ValueError(f"array format {version}, (1, 0) expected")
        shape, _, dtype = npy.read_array_header_1_0(file)
        if dtype.hasobject:
            raise ModelFileError(f"{path}: expected plain numbers in {member.filename!r}, found pickled objects")
        claimed = prod(shape) * dtype.itemsize
        if min(shape, default=0) < 0 or file.tell() + claimed != member.file_size:
            raise ValueError(f"{member.filename!r} claims {claimed} bytes of numbers in {member.file_size}")
    with archive.open(member) as file:
        array: NDArray[Any] = npy.read_array(file, allow_pickle=False)
        return array


def _check_version(path: Path, found: NDArray[Any]) -> None:
    if found.shape != () or found.dtype.kind not in "iu":
        raise ModelFileError(f"{path}: expected a whole number as format version, found {found!r:.80}")
    if int(found) != FORMAT_VERSION:
        raise ModelFileError(
            f"{path}: expected format version {FORMAT_VERSION}, found {int(found)}; train the model again"
        )


def _refuse_constant(name: str) -> NoReturn:
    raise ValueError(f"expected finite numbers, found {name}")


def _plain(value: Any) -> Any:
    if isinstance(value, MovementDescription):
        return value.as_record()
    if isinstance(value, TrainingOptions):
        return asdict(value)
    return value


def _rich(name: str, value: Any) -> Any:
    if value is not None and name == "description":
        return MovementDescription.from_record(value)
    if value is not None and name == "options":
        return TrainingOptions(**value)
    return _with_tuples(value)


def _with_tuples(value: Any) -> Any:
    return tuple(_with_tuples(one) for one in value) if isinstance(value, list) else value


def _summary(value: dict[str, Any] | None) -> TrainingSummary | None:
    if value is None:
        return None
    return TrainingSummary(**{name: _with_tuples(one) for name, one in value.items()})
