"""Topics of a node, and whether it needs parameters, read from its source without running it."""

from __future__ import annotations

import ast
import contextlib
import functools
import importlib.util
import json
import subprocess
import warnings
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from paramove.bus import Topic, topics
from paramove.documents import nearest
from paramove.supervision.environment import run_python
from paramove.workspace import Workspace

OLD_NAMES = {"SUBSCRIBES": "HEARS", "PUBLISHES": "SAYS"}
"""Names in nodes written for the previous release."""


class InterfaceError(ValueError):
    """A node's module is missing or its SUBSCRIBES or PUBLISHES cannot be read."""


@dataclass(frozen=True)
class Interface:
    """Topics of a node, and what its source shows of its parameters.

    Attributes:
        path: Source file of the module.
        subscribes: Topics that it subscribes to.
        publishes: Topics that it publishes, without its status.
        has_config: Whether it has a `Config` that can check parameters.
        needs_parameters: Whether some parameter may have no default value.
        every_namespace: Whether its topics are, where it is in no namespace itself, those of all namespaces.
    """

    path: Path
    subscribes: tuple[Topic, ...]
    publishes: tuple[Topic, ...]
    has_config: bool
    needs_parameters: bool
    every_namespace: bool = False


def source_of(module: str, workspace: Workspace) -> Path:
    """Source file of a module of the workspace or of the installed library; raises InterfaceError."""
    relative = Path(*module.split("."))
    for file in (relative.with_suffix(".py"), relative / "__main__.py"):
        if (candidate := workspace.find(file)).is_file():
            return candidate
    with contextlib.suppress(ModuleNotFoundError):
        spec = importlib.util.find_spec(module) if module.startswith("paramove.") else None
        if spec is not None and spec.origin:
            return Path(spec.origin)
    known = [name for name in workspace.names(relative.parent, "*.py") if not name.startswith("_")]
    neighbours = f"; {relative.parent} has: {', '.join(known)}" if known else ""
    if "." not in module and module in workspace.names(Path("nodes"), "*.py"):
        neighbours = f"; did you mean nodes.{module}?"
    raise InterfaceError(
        f"there is no module '{module}' ({relative.with_suffix('.py')}) in {workspace.root}{neighbours}"
    )


def read_interface(module: str, workspace: Workspace, *, may_import: bool = True) -> Interface:
    """Interface of a node's module.

    SUBSCRIBES and PUBLISHES are read from the source as long as they are written as `topics.NAME`, tuples and sums of
    these; otherwise the module is imported once in a process of its own, because nodes import heavy libraries.

    Raises InterfaceError, also where only an import would show the topics and `may_import` is False.
    """
    path = source_of(module, workspace)
    try:
        tree = ast.parse(path.read_text(encoding="utf-8"), filename=str(path))
    except SyntaxError as error:
        raise InterfaceError(f"{path}:{error.lineno}: {error.msg}") from error
    config = next((line for line in tree.body if isinstance(line, ast.ClassDef) and line.name == "Config"), None)
    assigned = _assigned(tree)
    names = [_declared(name, assigned, path) for name in OLD_NAMES]
    try:
        subscribes, publishes = (_topics(assigned[name], assigned, path) for name in names)
    except _NotPlainError:
        if not may_import:
            message = (
                f"{path}: SUBSCRIBES or PUBLISHES has more than names such as topics.SPEECH, so that only the node's "
                "own code knows its topics, and that is not run to look at it; write the names, or look at it while it "
                "runs: paramove graph"
            )
            raise InterfaceError(message) from None
        subscribes, publishes = _imported(module, workspace, path.stat().st_mtime_ns, *names)
    return Interface(
        path,
        subscribes,
        publishes,
        has_config=config is not None,
        needs_parameters=config is not None and _needs_parameters(config),
        every_namespace=_is_for_every_namespace(tree),
    )


def _is_for_every_namespace(tree: ast.Module) -> bool:
    """Whether the module calls `main(..., every_namespace=True)`."""
    keywords = (one for call in ast.walk(tree) if isinstance(call, ast.Call) for one in call.keywords)
    return any(one.arg == "every_namespace" and ast.unparse(one.value) == "True" for one in keywords)


class _NotPlainError(Exception):
    """The expression has more than names of topics."""


def _assigned(tree: ast.Module) -> dict[str, ast.expr]:
    assigned = {}
    for statement in tree.body:
        if isinstance(statement, ast.Assign) and isinstance(statement.targets[0], ast.Name):
            assigned[statement.targets[0].id] = statement.value
        elif isinstance(statement, ast.AnnAssign) and isinstance(statement.target, ast.Name) and statement.value:
            assigned[statement.target.id] = statement.value
    return assigned


def _declared(name: str, assigned: Mapping[str, ast.expr], path: Path) -> str:
    """The name in the module: `name`, or that of the previous release, with a warning."""
    if name in assigned:
        return name
    old = OLD_NAMES[name]
    if old not in assigned:
        raise InterfaceError(f"{path}: {name} is missing; a node needs SUBSCRIBES and PUBLISHES")
    warnings.warn(f"{path}: {old} is called {name} now; the next release reads that only", stacklevel=2)
    return old


def _topics(expression: ast.expr, assigned: dict[str, ast.expr], path: Path) -> tuple[Topic, ...]:
    match expression:
        case ast.Tuple(elts=elements) | ast.List(elts=elements):
            return tuple(topic for element in elements for topic in _topics(element, assigned, path))
        case ast.Starred(value=value):
            return _topics(value, assigned, path)
        case ast.BinOp(left=left, op=ast.Add(), right=right):
            return _topics(left, assigned, path) + _topics(right, assigned, path)
        case ast.Name(id=name) if name in assigned:
            return _topics(assigned[name], assigned, path)
        case ast.Attribute(value=ast.Name(id="topics"), attr=name):
            named = getattr(topics, name, None)
            if isinstance(named, Topic):
                return (named,)
            if isinstance(named, tuple) and all(isinstance(topic, Topic) for topic in named):
                return named
            known = (topics.constant_of(topic.name) for topic in topics.TOPICS)
            message = f"{path}:{expression.lineno}: there is no topic topics.{name}; {nearest(name, known)}"
            raise InterfaceError(f"{message}, or add it to {topics.OWN_TABLE}")
    raise _NotPlainError


def _needs_parameters(config: ast.ClassDef) -> bool:
    """Whether a field may lack a default: it has no value, or a `Field(...)` without one."""
    if [ast.unparse(base) for base in config.bases] != ["NodeConfig"]:
        return True
    for value in (line.value for line in config.body if isinstance(line, ast.AnnAssign)):
        if value is None:
            return True
        if isinstance(value, ast.Call) and ast.unparse(value.func).rpartition(".")[2] == "Field":
            named = {keyword.arg for keyword in value.keywords}
            if not value.args and not named & {"default", "default_factory"}:
                return True
            if value.args and ast.unparse(value.args[0]) == "...":
                return True
    return False


_IMPORT_CODE = (
    "import importlib, json, sys; node = importlib.import_module(sys.argv[1]);"
    "sys.stdout.write('\\n' + json.dumps([[t.name for t in getattr(node, name)] for name in sys.argv[2:]]))"
)


@functools.cache
def _imported(
    module: str, workspace: Workspace, changed_ns: int, *names: str
) -> tuple[tuple[Topic, ...], tuple[Topic, ...]]:
    """SUBSCRIBES and PUBLISHES of a module, imported in another process; again only when its file has changed."""
    try:
        answer = run_python("-c", _IMPORT_CODE, module, *names, workspace=workspace, timeout_s=60.0)
    except subprocess.TimeoutExpired as error:
        raise InterfaceError(f"importing '{module}' took more than 60 s") from error
    if answer.returncode != 0:
        last = answer.stderr.strip().splitlines()[-1:] or ["no message"]
        raise InterfaceError(f"'{module}' cannot be imported: {last[0]}")
    subscribes, publishes = json.loads(answer.stdout.splitlines()[-1])
    try:
        return tuple(map(topics.by_name, subscribes)), tuple(map(topics.by_name, publishes))
    except KeyError as error:
        raise InterfaceError(f"'{module}': {error.args[0]}, or add it to {topics.OWN_TABLE}") from error
