"""Launch files read, overlaid, changed by `--set` and checked; every error says where and what would have worked."""

from __future__ import annotations

import difflib
import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, get_args

from pydantic import BaseModel, ValidationError
from pydantic_core import ErrorDetails

from paramove.supervision.launch_schema import LaunchFile, NodeSettings
from paramove.supervision.positions import Document, KeyPath, LaunchFileError, Position, read_mapping, read_value

_QUOTED = re.compile(r"'([^']*)'")
_PLAIN_NAME = re.compile(r"[a-z][a-z0-9_]*")


class LaunchFileMissingError(LaunchFileError):
    """There is no launch file or overlay of that name."""


@dataclass(frozen=True)
class Launch:
    """A checked launch file: its name, its content, and where each value came from."""

    name: str
    overlays: tuple[str, ...]
    file: LaunchFile
    document: Document
    seed: int | None = None

    def error(self, path: KeyPath, message: str) -> LaunchFileError:
        """An error at the place where `path` was written."""
        return LaunchFileError(self.document.position(path), message)


def load(
    folder: Path,
    name: str,
    overlays: Sequence[str] | None = None,
    settings: Sequence[str] = (),
    seed: int | None = None,
    headless: bool = False,
) -> Launch:
    """Reads `<folder>/<name>.yaml` with its overlays and settings and checks the result.

    Args:
        folder: Holds the launch files; overlays lie in its sub-folder `overlays`.
        name: Of the launch file without `.yaml`, or a path that ends in `.yaml`.
        overlays: Names or paths likewise; None takes the file's `default_overlays`.
        settings: Each `node.parameter=value`; the value is YAML.
        seed: Written into each of the file's `seed_parameters`.
        headless: Sets the parameters that the file names under `headless`, before `settings`.

    Raises LaunchFileMissingError or LaunchFileError.
    """
    document = _read(_path_of(folder, name, "launch file"))
    chosen = document.data.get("default_overlays", []) if overlays is None else list(overlays)
    if not isinstance(chosen, list) or not all(isinstance(overlay, str) for overlay in chosen):
        raise LaunchFileError(document.position(("default_overlays",)), "expected a list of names of overlays")
    for overlay in chosen:
        document = document.overlaid(_read(_path_of(folder / "overlays", overlay, "overlay")))
    if headless:
        document = _made_headless(document)
    for setting in settings:
        document = _with_setting(document, setting)
    if seed is not None:
        document = _with_seed(document, seed)
    file = validated(document)
    _check_references(file, document)
    return Launch(Path(name).stem, tuple(chosen), file, document, seed)


def validated(document: Document) -> LaunchFile:
    """The document as a `LaunchFile`; raises LaunchFileError with every finding, one per line."""
    try:
        return LaunchFile.model_validate(document.data)
    except ValidationError as error:
        details = sorted(error.errors(), key=lambda found: found["type"] == "missing")  # often a mistyped key's echo
        findings = [_finding(document, found) for found in details]
        first, rest = findings[0], findings[1:]
        message = "\n".join([first.message, *(str(finding) for finding in rest)])
        raise LaunchFileError(first.position, message) from error


def nearest(word: str, known: Iterable[str]) -> str:
    """The words among `known` that are nearest to `word`, else all of them, as a phrase for an error."""
    choices = sorted(known)
    close = difflib.get_close_matches(word, choices, n=1, cutoff=0.6)
    if close:
        return f"did you mean '{close[0]}'?"
    return f"there are: {', '.join(choices)}" if choices else "there are none"


def _path_of(folder: Path, name: str, kind: str) -> Path:
    if name.endswith(".yaml"):
        path = Path(name)
    elif _PLAIN_NAME.fullmatch(name):
        path = folder / f"{name}.yaml"
    else:
        raise LaunchFileMissingError(Position(name), f"no name of a {kind}: expected letters, digits, '_', or a *.yaml")
    if not path.is_file():
        known = [file.stem for file in folder.glob("*.yaml")]
        raise LaunchFileMissingError(Position(str(path)), f"there is no such {kind}; {nearest(path.stem, known)}")
    return path


def _read(path: Path) -> Document:
    try:
        text = path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise LaunchFileError(Position(str(path)), f"cannot be read: {error}") from error
    return read_mapping(text, str(path))


def _with_setting(document: Document, setting: str) -> Document:
    """`node.parameter=value` laid over the document."""
    where = Position(f"--set {setting}")
    path, equals, text = setting.partition("=")
    node, *parameters = path.strip().split(".")
    if not equals or not parameters or not all([node, *parameters]):
        raise LaunchFileError(where, "expected node.parameter=value, such as simulator.seed=7")
    _known_node(document, node, where)
    return document.overlaid(_parameter(node, parameters, read_value(text, str(where)), where))


def _with_seed(document: Document, seed: int) -> Document:
    where = Position(f"--seed {seed}")
    targets = document.data.get("seed_parameters", [])
    if not targets:
        raise LaunchFileError(where, "this launch file has no 'seed_parameters', so nothing in it takes a seed")
    for target in targets:
        node, *parameters = str(target).split(".")
        if not parameters:
            raise LaunchFileError(document.position(("seed_parameters",)), f"'{target}': expected node.parameter")
        _known_node(document, node, document.position(("seed_parameters",)))
        document = document.overlaid(_parameter(node, parameters, seed, where))
    return document


def _made_headless(document: Document) -> Document:
    values = document.data.get("headless", {})
    for target, value in values.items() if isinstance(values, dict) else ():
        where = document.position(("headless", target))
        node, *parameters = target.split(".")
        if not parameters:
            raise LaunchFileError(where, f"'{target}': expected node.parameter")
        _known_node(document, node, where)
        document = document.overlaid(_parameter(node, parameters, value, where))
    return document


def _known_node(document: Document, node: str, where: Position) -> None:
    nodes = document.data.get("nodes")
    known = list(nodes) if isinstance(nodes, dict) else []
    if node not in known:
        raise LaunchFileError(where, f"there is no node '{node}'; {nearest(node, known)}")


def _parameter(node: str, parameters: Sequence[str], value: Any, where: Position) -> Document:
    path = ("nodes", node, "parameters", *parameters)
    data: Any = value
    for key in reversed(path):
        data = {key: data}
    return Document(data, {path: where})


def _finding(document: Document, details: ErrorDetails) -> LaunchFileError:
    """One finding of pydantic with the position in the file and the nearest valid key."""
    path = tuple(str(part) for part in details["loc"] if part != "[key]")
    where = document.position(path)
    name = ".".join(path) or "the launch file"
    if details["type"] == "extra_forbidden":
        return LaunchFileError(where, f"unknown key '{path[-1]}'; {nearest(path[-1], _keys_at(path[:-1]))}")
    if details["type"] == "missing":
        return LaunchFileError(where, f"{name} is missing")
    message = details["msg"][0].lower() + details["msg"][1:]
    if details["type"] == "literal_error":
        message += f"; {nearest(str(details['input']), _QUOTED.findall(details['msg']))}"
    found = details["input"]
    return LaunchFileError(where, f"{name}: {message}, found {found!r}"[:500])


def _keys_at(path: KeyPath) -> list[str]:
    """Valid keys of the mapping at `path` of a launch file."""
    model: type[BaseModel] = NodeSettings if path[:1] == ("nodes",) else LaunchFile
    for key in path[2:] if model is NodeSettings else path:
        field = model.model_fields.get(key)
        inner = [kind for kind in (field.annotation, *get_args(field.annotation)) if field] if field else []
        models = [kind for kind in inner if isinstance(kind, type) and issubclass(kind, BaseModel)]
        if not models:
            return []
        model = models[0]
    return list(model.model_fields)


def _check_references(file: LaunchFile, document: Document) -> None:
    """Names of nodes inside the file exist, and `after` has no circle."""
    for name, node in file.nodes.items():
        for index, other in enumerate(node.after):
            if other not in file.nodes:
                where = document.position(("nodes", name, "after", str(index)))
                raise LaunchFileError(where, f"'{name}' comes after '{other}', no node; {nearest(other, file.nodes)}")
    start_waves(file, document)
    for index, target in enumerate(file.seed_parameters):
        if target.partition(".")[0] not in file.nodes or "." not in target:
            where = document.position(("seed_parameters", str(index)))
            raise LaunchFileError(where, f"'{target}' is no node.parameter; {nearest(target, file.nodes)}")


def start_waves(file: LaunchFile, document: Document | None = None) -> list[list[str]]:
    """Nodes in the order of their start: each wave needs only nodes of earlier waves.

    Raises LaunchFileError if nodes wait for each other in a circle.
    """
    waves: list[list[str]] = []
    placed: set[str] = set()
    while len(placed) < len(file.nodes):
        wave = [name for name, node in file.nodes.items() if name not in placed and placed.issuperset(node.after)]
        if not wave:
            circle = [name for name in file.nodes if name not in placed]
            where = document.position(("nodes", circle[0], "after")) if document else Position("launch file")
            raise LaunchFileError(where, f"these nodes wait for each other ('after'): {', '.join(circle)}")
        waves.append(wave)
        placed.update(wave)
    return waves
