"""Arguments and options that the commands about demonstrations and movement models share, and the models they name."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from paramove.documents import InputError

if TYPE_CHECKING:
    from paramove.phmm import MovementClassifier, ParametricHMM

SetArgument = Annotated[Path, typer.Argument(metavar="SET", help="folder of a demonstration set")]
ActionOption = Annotated[str | None, typer.Option(help="only this action")]
SubjectOption = Annotated[str | None, typer.Option(help="only this person")]
LabelActionOption = Annotated[str | None, typer.Option("--action", help="what is done, such as reaching")]
ThetaOption = Annotated[
    str, typer.Option("--theta", metavar="NUMBERS", help="the movement's parameters, such as 0.45,0.1,-0.2")
]
ParametersOption = Annotated[
    str | None,
    typer.Option("--parameters", metavar="NAMES", help="names of the parameters (default of three: target_x,…)"),
]
LabelSubjectOption = Annotated[str, typer.Option("--subject", help="who it is")]
PointOption = Annotated[str | None, typer.Option("--point", help="body point (default: index, else the last)")]
ModelArgument = Annotated[Path, typer.Argument(metavar="MODEL", help="file of a movement model")]
ModelsOption = Annotated[
    list[Path],
    typer.Option("--model", metavar="FILE", help="model, or folder of a classifier; may be repeated: they compete"),
]
PlotOption = Annotated[Path | None, typer.Option("--plot", metavar="FILE", help="draw it: .png, .svg, .pdf or .html")]

DEPTH = 3
"""How far below a folder `list` looks."""


def numbers(text: str, option: str) -> tuple[float, ...]:
    """Finite numbers separated by commas; other text is a wrong use of the command."""
    try:
        values = tuple(float(part) for part in text.split(",") if part.strip())
    except ValueError:
        values = (math.nan,)
    if not all(map(math.isfinite, values)):
        raise typer.BadParameter(f"expected numbers such as 0.45,0.1,-0.2, found {text!r}", param_hint=option)
    return values


def words(text: str | None) -> tuple[str, ...] | None:
    """Names separated by commas; None for none."""
    return None if text is None else tuple(part.strip() for part in text.split(",") if part.strip())


def files_below(folder: Path, pattern: str) -> list[Path]:
    """Files of a name in a folder and below it, `DEPTH` levels in all."""
    return sorted(file for depth in range(DEPTH) for file in folder.glob("*/" * depth + pattern))


def loaded(path: Path) -> ParametricHMM:
    """A model file; of a classifier's folder with one action, that one. Raises InputError as `ParametricHMM.load`."""
    from paramove.phmm import ParametricHMM

    files = model_files(path) if path.is_dir() else [path]
    if len(files) != 1:
        names = ", ".join(map(str, files)) or "none"
        raise InputError(f"{path} is a folder: give one model file; there are: {names}", missing=not files)
    return ParametricHMM.load(files[0])


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
