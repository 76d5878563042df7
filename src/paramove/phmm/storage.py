"""Model files: one .npz without pickles, checked when read, and checks of what models read from it."""

import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, NoReturn

import numpy as np
from numpy.typing import NDArray

from paramove.documents import Floats, InputError, read_arrays, replacing
from paramove.hmm import TrainingOptions, TrainingSummary
from paramove.phmm.description import MovementDescription

FORMAT_VERSION = 3
MAX_BYTES = 256 * 2**20
"""Of all arrays together; the reaching model of 8 local models has 8 MB."""
MAX_ARRAYS = 500
"""Each of the twenty fractions of unfinished movements has eight."""
MAX_LETTERS = 100_000
"""Maximum of the header; that of a model with a description has 1 000."""
ROUNDING = 1e-6


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

    The file appears when it is complete, so a process that is killed leaves no partial file.
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
    content = read_arrays(path, "model file (.npz)", ModelFileError, max_bytes=MAX_BYTES, max_arrays=MAX_ARRAYS)
    missing = sorted({"format_version", "header"} - set(content))
    if missing:
        names = ", ".join(sorted(content)) or "nothing"
        raise ModelFileError(f"{path}: expected a model file, which has {' and '.join(missing)}; found {names:.200}")
    _check_version(path, content["format_version"])
    arrays = {name.removeprefix("learned_"): value for name, value in content.items() if name.startswith("learned_")}
    for name, value in arrays.items():
        if value.dtype != np.float64 or not np.isfinite(value).all():
            raise ModelFileError(f"{path}: expected finite numbers in {name!r}, found NaN, infinity or {value.dtype}")
    try:
        if content["header"].dtype.itemsize > 4 * MAX_LETTERS:
            raise ValueError(f"it has more than {MAX_LETTERS} characters")
        header = json.loads(str(content["header"]), parse_constant=_reject_constant)
        parameters = {name: _rich(name, value) for name, value in header["parameters"].items()}
        training = _summary(header["training"])
        return ModelRecord(str(header["class"]), parameters, training, arrays)
    except (AttributeError, LookupError, RecursionError, TypeError, ValueError) as error:
        raise ModelFileError(f"{path}: the header cannot be read: {error}") from error


def check_shapes(arrays: Mapping[str, Floats], expected: Mapping[str, tuple[int, ...]], prefix: str = "") -> None:
    """Check arrays whose names have this prefix. Raises ValueError with the first that has another shape."""
    for name, shape in expected.items():
        found = arrays[f"{prefix}{name}"].shape
        if found != shape:
            raise ValueError(f"expected {prefix}{name} of shape {shape}, found {found}")


def read_numbers(arrays: Mapping[str, Floats], name: str, count: int) -> list[float] | None:
    """The numbers of an array, None if it is missing. Raises ValueError for other than `count`, and negative ones."""
    if name not in arrays:
        return None
    array = arrays[name]
    if array.shape != (count,) or (array < 0.0).any():
        raise ValueError(f"expected {count} numbers from 0 on in {name}, found shape {array.shape}: {array}")
    return list(map(float, array))


def check_states(arrays: Mapping[str, Floats], means: Floats, d_min: int, d_max: int) -> None:
    """Check "covariances" (..., N, D, D) and "durations" (..., N, d_max) of HMMs with means (..., N, D).

    Args:
        arrays: of a file. p_i(d) is in column d - 1 of the durations.
        means: of one HMM, or of several local ones.
        d_min, d_max: minimum and maximum number of frames of a state.

    Raises:
        ValueError: for other shapes, covariances that are not symmetric and positive definite, and rows of durations
            that are no distribution over d_min .. d_max; with the local model and the state.
    """
    if not means.size:
        raise ValueError(f"expected means of some local models, found shape {means.shape}")
    check_shapes(arrays, {"covariances": (*means.shape, means.shape[-1]), "durations": (*means.shape[:-1], d_max)})
    covariances, durations = arrays["covariances"], arrays["durations"]
    bad = np.argwhere((durations < 0).any(axis=-1) | (np.abs(durations.sum(axis=-1) - 1.0) > ROUNDING))
    if len(bad):
        row = durations[tuple(bad[0])]
        raise ValueError(f"expected durations that sum to 1 with none below 0, found {row.tolist()} {_where(bad[0])}")
    bad = np.argwhere(durations[..., : d_min - 1].any(axis=-1))
    if len(bad):
        raise ValueError(f"expected no duration below {d_min} frames, found one {_where(bad[0])}")
    size = np.abs(covariances).max(axis=(-2, -1))
    bad = np.argwhere(np.abs(covariances - np.swapaxes(covariances, -1, -2)).max(axis=(-2, -1)) > ROUNDING * size)
    if len(bad):
        raise ValueError(f"expected symmetric covariances, found one that is not {_where(bad[0])}")
    minimum = np.linalg.eigvalsh(covariances)[..., 0]
    bad = np.argwhere(minimum <= 0)
    if len(bad):
        eigenvalue = f"{minimum[tuple(bad[0])]:.3g} {_where(bad[0])}"
        raise ValueError(f"expected covariances that are positive definite, found the eigenvalue {eigenvalue}")


def _where(index: NDArray[np.intp]) -> str:
    *local, state = index.tolist()
    return f"in state {state}" + "".join(f" of local model {number}" for number in local)


def _check_version(path: Path, found: NDArray[Any]) -> None:
    if found.shape != () or found.dtype.kind not in "iu":
        raise ModelFileError(f"{path}: expected a whole number as format version, found {found!r:.80}")
    if int(found) != FORMAT_VERSION:
        raise ModelFileError(
            f"{path}: expected format version {FORMAT_VERSION}, found {int(found)}; train the model again"
        )


def _reject_constant(name: str) -> NoReturn:
    raise ValueError(f"expected finite numbers, found {name}")


def _plain(value: Any) -> Any:
    if isinstance(value, MovementDescription | TrainingOptions):
        return asdict(value)
    return value.item() if isinstance(value, np.generic) else value


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
