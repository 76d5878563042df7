"""Completions after <Tab>: names of launch files, overlays, parameters, topics, nodes and runs.

Called at every <Tab>, so it imports nothing heavy, and where nothing can be offered it offers nothing: an error here
would appear in the middle of a line that is being typed. Typer leaves out what
does not begin as the word that is typed.
"""

from __future__ import annotations

import ast
import contextlib
import os
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Annotated

import typer

from paramove.workspace import Workspace

_WITH_VALUE = ("--set", "--remap", "--seed", "--runs", "--robot")


def launch_files() -> list[str]:
    """Launch files of the workspace."""
    return Workspace.here().names("launch")


def overlays() -> list[str]:
    """Overlays of the workspace: those for every launch file, and those for the one that was typed."""
    from paramove.supervision import overlay_folders

    workspace = Workspace.here()
    return sorted({name for folder in overlay_folders(_typed_launch()[0]) for name in workspace.names(folder)})


def robots() -> list[str]:
    """Names of the robots that are described."""
    return Workspace.here().robots()


RobotOption = Annotated[
    str | None,
    typer.Option(
        metavar="ROBOT",
        help="folder of the robot, or its name in robot_description/, for every node that names one",
        autocompletion=robots,
    ),
]


def modules() -> list[str]:
    """Modules of the workspace's nodes."""
    return [f"nodes.{name}" for name in Workspace.here().names("nodes", "*.py") if not name.startswith("_")]


def schemas() -> list[str]:
    """Kinds of files that have a schema."""
    return ["launch", "overlay"]


def parameters() -> list[str]:
    """`node.parameter=` of the launch file that was typed, with its overlays."""
    return sorted(_parameters(Workspace.here(), *_typed_launch()))


def _typed_launch() -> tuple[str, list[str]]:
    """The launch file that was typed, "" if none was, and its overlays."""
    name, chosen, before = "", list[str](), ""
    for word in typed_words(os.environ)[2:]:
        if before == "--with":
            chosen.append(word)
        elif not name and before not in _WITH_VALUE and not word.startswith("-"):
            name = word
        before = word
    return name, chosen


def typed_words(environment: Mapping[str, str]) -> list[str]:
    """The words of the line to complete: bash has them in one variable, other shells in another."""
    return (environment.get("COMP_WORDS") or environment.get("_TYPER_COMPLETE_ARGS", "")).split()


def nodes() -> list[str]:
    """Nodes that are, or were, on the bus."""
    from paramove.bus import default_folder, nodes_in

    with contextlib.suppress(OSError):
        return nodes_in(default_folder())
    return []


def namespaces() -> list[str]:
    """Namespaces of the arms that run."""
    from paramove.bus import default_folder, inspection

    with contextlib.suppress(OSError):
        return [name for name in inspection.gates(default_folder()) if name]
    return []


def topics() -> list[str]:
    """Topics of the table, and the status topics of the nodes on the bus."""
    from paramove.bus import TOPICS

    return [*(topic.name for topic in TOPICS if not topic.truth), *(f"status/{node}" for node in nodes())]


def domains() -> list[str]:
    """Domains that are, or were, in use."""
    from paramove.bus import default_folder
    from paramove.supervision import HIDDEN

    with contextlib.suppress(OSError):
        found = [path.name for path in default_folder().parent.iterdir() if path.is_dir()]
        return [name for name in found if not name.startswith(HIDDEN)]
    return []


def run_folders() -> list[str]:
    """Folders of runs, the latest first."""
    with contextlib.suppress(OSError):
        return sorted((str(path) for path in Path("runs").iterdir() if path.is_dir()), reverse=True)
    return []


def _parameters(workspace: Workspace, name: str, chosen: Sequence[str]) -> Iterator[str]:
    for node, module in _modules(workspace, name, chosen).items():
        with contextlib.suppress(OSError, SyntaxError, ValueError):
            path = workspace.find(Path(*module.split(".")).with_suffix(".py"))
            tree = ast.parse(path.read_text(encoding="utf-8"))
            configs = [line for line in tree.body if isinstance(line, ast.ClassDef) and line.name == "Config"]
            for line in (line for config in configs for line in config.body):
                if isinstance(line, ast.AnnAssign) and isinstance(line.target, ast.Name):
                    yield f"{node}.{line.target.id}="


def _modules(workspace: Workspace, name: str, chosen: Sequence[str]) -> dict[str, str]:
    """Node -> module, of a launch file that may be half written."""
    from paramove.documents import DocumentError, read_mapping
    from paramove.supervision import overlay_folders

    modules: dict[str, str] = {}
    with contextlib.suppress(OSError, DocumentError, UnicodeDecodeError):
        document = read_mapping(workspace.find(f"launch/{name}.yaml").read_text(encoding="utf-8-sig"), name)
        names = chosen or document.data.get("default_overlays", [])
        for overlay in names if isinstance(names, list | tuple) else []:
            paths = [workspace.find(folder / f"{overlay}.yaml") for folder in overlay_folders(name)]
            path = next((path for path in paths if path.is_file()), paths[-1])
            document = document.overlaid(read_mapping(path.read_text(encoding="utf-8-sig"), str(path)))
        found = document.data.get("nodes")
        for node, settings in found.items() if isinstance(found, dict) else ():
            if isinstance(settings, dict) and isinstance(settings.get("module"), str):
                modules[node] = settings["module"]
    return modules
