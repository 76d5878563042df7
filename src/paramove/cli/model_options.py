"""Options, errors and files that the commands about movement models share."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from paramove.cli.demos_options import ended
from paramove.documents import InputError, exit_codes
from paramove.recording import RecordingExistsError

if TYPE_CHECKING:
    from paramove.phmm import MovementClassifier, ParametricHMM

INTERRUPTED = 130
ModelArgument = Annotated[Path, typer.Argument(metavar="MODEL", help="file of a movement model")]
ModelsOption = Annotated[
    list[Path],
    typer.Option("--model", metavar="FILE", help="model, or folder of a classifier; may be repeated: they compete"),
]
PlotOption = Annotated[Path | None, typer.Option("--plot", metavar="FILE", help="draw it: .png, .svg, .pdf or .html")]


@contextlib.contextmanager
def one_line() -> Iterator[None]:
    """Ends the command with what is wrong on standard error, and an exit code, instead of a traceback."""
    try:
        yield
    except InputError as error:
        raise ended(str(error), error.exit_code) from error
    except RecordingExistsError as error:
        raise ended(str(error), exit_codes.USAGE) from error
    except OSError as error:
        raise ended(f"{error.filename or ''}: {error.strerror or error}".lstrip(": "), exit_codes.PERMISSION) from error


def loaded(path: Path) -> ParametricHMM:
    """A model file; of a classifier's folder with one action, that one. Raises InputError as `ParametricHMM.load`."""
    from paramove.phmm import ParametricHMM

    if path.is_dir():
        files = model_files(path)
        if len(files) == 1:
            return ParametricHMM.load(files[0])
        names = ", ".join(str(file) for file in files) or "none"
        raise InputError(f"{path} is a folder: give one model file; there are: {names}", missing=not files)
    return ParametricHMM.load(path)


def model_files(folder: Path) -> list[Path]:
    """Files in a folder that may be models: every .npz but the index of a classifier."""
    from paramove.phmm import INDEX_FILE

    return sorted(file for file in folder.glob("*.npz") if file.name != INDEX_FILE)


def classifier_of(paths: Sequence[Path]) -> MovementClassifier:
    """All given models, which compete for a movement; a classifier's folder recognizes beginnings, too.

    Raises InputError if a file is missing or damaged, or two models are of the same action.
    """
    from paramove.phmm import INDEX_FILE, MovementClassifier, ParametricHMM

    if len(paths) == 1 and (paths[0] / INDEX_FILE).is_file():
        return MovementClassifier.load(paths[0])
    files = [file for path in paths for file in (model_files(path) if path.is_dir() else [path])]
    if not files:
        raise InputError(f"there is no model in {', '.join(map(str, paths))}; `paramove train` makes one", missing=True)
    models: dict[str, ParametricHMM] = {}
    sources: dict[str, Path] = {}
    for file in files:
        model = ParametricHMM.load(file)
        action = model.description.action if model.description else file.stem
        if action in models:
            raise InputError(f"{sources[action]} and {file} are both models of '{action}': give one of them")
        models[action], sources[action] = model, file
    return MovementClassifier.from_models(models)
