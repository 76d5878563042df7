"""Model files: one .npz without pickles, checked when read."""

import json
import zipfile
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from paramove.hmm import TrainingOptions, TrainingSummary
from paramove.phmm.description import MovementDescription

Floats = NDArray[np.float64]
FORMAT_VERSION = 1


class ModelFileError(ValueError):
    """A model file is of another version or class, or holds values that do not fit together."""


@dataclass(frozen=True)
class ModelRecord:
    """The content of a model file: class name, constructor arguments, training summary, learned arrays."""

    class_name: str
    parameters: Mapping[str, Any]
    training: TrainingSummary | None
    arrays: Mapping[str, Floats]


def write_record(path: Path, record: ModelRecord) -> None:
    """Write a record. The header is text in an array; numbers are plain arrays, so no reader needs pickle."""
    header = {
        "class": record.class_name,
        "parameters": {name: _plain(value) for name, value in record.parameters.items()},
        "training": None if record.training is None else asdict(record.training),
    }
    arrays: dict[str, Any] = {f"learned_{name}": value for name, value in record.arrays.items()}
    with path.open("wb") as file:
        np.savez_compressed(file, format_version=FORMAT_VERSION, header=json.dumps(header, sort_keys=True), **arrays)


def read_record(path: Path) -> ModelRecord:
    """Read a record. Raises ModelFileError with what was expected and found."""
    try:
        with np.load(path, allow_pickle=False) as stored:
            content = {name: stored[name] for name in stored.files}
    except (ValueError, zipfile.BadZipFile, EOFError) as error:
        raise ModelFileError(f"{path}: expected a model file (.npz), found something else: {error}") from error
    missing = sorted({"format_version", "header"} - set(content))
    if missing:
        raise ModelFileError(f"{path}: expected a model file with {missing}, found {sorted(content)}")
    version = int(content["format_version"])
    if version != FORMAT_VERSION:
        raise ModelFileError(
            f"{path}: expected format version {FORMAT_VERSION}, found {version}; train the model again"
        )
    arrays = {name.removeprefix("learned_"): value for name, value in content.items() if name.startswith("learned_")}
    for name, value in arrays.items():
        if value.dtype.kind != "f" or not np.isfinite(value).all():
            raise ModelFileError(f"{path}: expected finite numbers in {name!r}, found NaN, infinity or {value.dtype}")
    try:
        header = json.loads(str(content["header"]))
        parameters = {name: _rich(name, value) for name, value in header["parameters"].items()}
        training = _summary(header["training"])
        return ModelRecord(str(header["class"]), parameters, training, arrays)
    except (KeyError, TypeError, ValueError) as error:
        raise ModelFileError(f"{path}: the header cannot be read: {error}") from error


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
