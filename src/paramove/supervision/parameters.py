"""Parameters of nodes, checked by the nodes' own Config before anything starts.

The modules are imported in one process of its own, because they import heavy libraries. Nodes are
checked only if they are given parameters or need some, because this check takes most of the time before a start. Its
success is cached, so that it is not repeated until code, a library or a parameter changes.
"""

from __future__ import annotations

import contextlib
import hashlib
import importlib
import inspect
import json
import re
import subprocess
import sys
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path
from typing import Any

from platformdirs import user_cache_path
from pydantic import BaseModel, ValidationError
from pydantic_core import ErrorDetails, to_jsonable_python

from paramove.documents import DocumentError, keys_at, nearest
from paramove.source_code import code_digest
from paramove.supervision.environment import run_python
from paramove.supervision.interfaces import Interface
from paramove.supervision.launch_file import Launch
from paramove.workspace import Workspace

TIMEOUT_S = 120.0
"""For importing the modules, on a busy machine with cold caches."""
DESCRIBE = "--describe"
_ToCheck = tuple[str, str, dict[str, Any]]
"""Node, module, parameters."""


def wrong_parameters(
    launch: Launch, interfaces: Mapping[str, Interface], workspace: Workspace
) -> Iterator[DocumentError]:
    """Parameters that the nodes' own Config rejects, and modules that cannot be imported."""
    to_check = [
        (name, launch.file.nodes[name].module, launch.file.nodes[name].parameters)
        for name, interface in interfaces.items()
        if interface.has_config and (launch.file.nodes[name].parameters or interface.needs_parameters)
    ]
    if not to_check:
        return
    passed = _passed_before(to_check, interfaces, workspace)
    if passed is not None and passed.is_file():
        return
    answers = _check_in_process(to_check, workspace)
    rejecting: dict[tuple[tuple[str, ...], str], list[str]] = {}
    for (name, module, _), answer in zip(to_check, answers, strict=False):
        if isinstance(answer, str):
            yield launch.error(("nodes", name, "module"), f"'{module}' cannot be imported: {answer}")
            continue
        for path, message in answer:
            rejecting.setdefault((tuple(path), message), []).append(name)
    for (path, message), names in rejecting.items():
        named = " and ".join(f"'{name}'" for name in names)
        yield launch.error(("nodes", names[0], "parameters", *path), f"{named}: {message}")
    if passed is not None and answers == [[]] * len(to_check):
        with contextlib.suppress(OSError):  # not writable: the next launch checks again
            passed.parent.mkdir(parents=True, exist_ok=True)
            passed.touch()


@dataclass(frozen=True)
class Argument:
    """A parameter of a node that `--set` can change.

    Attributes:
        name: node.parameter.
        value: As JSON: that of the launch file, else the node's default; "" for a parameter that needs one.
        kind: Its type, as Python writes it.
    """

    name: str
    value: str
    kind: str


def arguments(launch: Launch, interfaces: Mapping[str, Interface], workspace: Workspace) -> list[Argument]:
    """The parameters of all nodes, in their order; raises DocumentError for a module that cannot be imported."""
    nodes: list[_ToCheck] = [
        (name, launch.file.nodes[name].module, {}) for name, its in interfaces.items() if its.has_config
    ]
    found = []
    for (name, module, _), answer in zip(nodes, _check_in_process(nodes, workspace, DESCRIBE), strict=False):
        if isinstance(answer, str):
            raise launch.error(("nodes", name, "module"), f"'{module}' cannot be imported: {answer}")
        given = launch.file.nodes[name].parameters
        for parameter, default, kind in answer:
            value = json.dumps(given[parameter], ensure_ascii=False) if parameter in given else default
            found.append(Argument(f"{name}.{parameter}", value, kind))
    return found


def _passed_before(
    to_check: Sequence[_ToCheck], interfaces: Mapping[str, Interface], workspace: Workspace
) -> Path | None:
    """A file that exists once these parameters were right for this code; None if the code of a node may be anywhere."""
    if not all(interfaces[name].path.is_relative_to(workspace.layers[-1]) for name, _, _ in to_check):
        return None
    code = code_digest(*(module for _, module, _ in to_check))
    key = json.dumps([to_check, code, workspace.digest, sys.version, version("pydantic")])
    return user_cache_path("paramove") / "checked" / hashlib.sha256(key.encode()).hexdigest()


def _check_in_process(to_check: Sequence[_ToCheck], workspace: Workspace, *options: str) -> list[Any]:
    """Answers of a process that imports the modules in turn; the last one is how it ended if one is missing."""
    try:
        process = run_python(
            "-m", __name__, *options, workspace=workspace, timeout_s=TIMEOUT_S, stdin=json.dumps(to_check)
        )
        output, errors = process.stdout, process.stderr.strip().splitlines()
        ending = errors[-1] if errors else f"the process ended with exit code {process.returncode}"
    except subprocess.TimeoutExpired as error:
        output = error.stdout.decode() if error.stdout else ""
        ending = f"it took more than {TIMEOUT_S:g} s"
    answers = [json.loads(line) for line in output.splitlines()]
    return answers if len(answers) == len(to_check) else [*answers, ending]


def _answer(module: str, parameters: dict[str, Any]) -> str | list[tuple[list[str], str]]:
    """Position and message of each error in the parameters, or why the module cannot be imported."""
    config = _config_of(module)
    if config is None or isinstance(config, str):
        return config or []
    try:
        config.model_validate(parameters)
    except ValidationError as error:
        return [_finding(config, details) for details in error.errors()]
    return []


def _config_of(module: str) -> type[BaseModel] | str | None:
    """The Config of a node, None without one; why the module cannot be imported."""
    try:
        config = getattr(importlib.import_module(module), "Config", None)
    except (Exception, SystemExit) as error:  # an import may do anything; its error is reported
        return f"{type(error).__name__}: {error}"
    return config if isinstance(config, type) and issubclass(config, BaseModel) else None


def _description(module: str) -> str | list[tuple[str, str, str]]:
    """Name, default as JSON and type of each parameter, or why the module cannot be imported."""
    config = _config_of(module)
    if config is None or isinstance(config, str):
        return config or []
    described = []
    for name, field in config.model_fields.items():
        default = ""
        if not field.is_required():
            value = field.get_default(call_default_factory=True, validated_data={})
            default = json.dumps(to_jsonable_python(value, fallback=str), ensure_ascii=False)
        described.append((name, default, re.sub(r"\b(?:\w+\.)+", "", inspect.formatannotation(field.annotation))))
    return described


def _finding(config: type[BaseModel], details: ErrorDetails) -> tuple[list[str], str]:
    path = [str(part) for part in details["loc"]]
    parameter = ".".join(path)
    if details["type"] in ("extra_forbidden", "unexpected_keyword_argument"):  # the second of dataclasses
        return path, f"there is no parameter '{parameter}'; {nearest(path[-1], keys_at(config, path[:-1]))}"
    if details["type"] == "missing":
        return path, f"the parameter '{parameter}' is missing"
    reason = details["msg"].removeprefix("Value error, ")
    reason = f"{reason[:1].lower()}{reason[1:]}, found {details['input']!r:.200}"
    return path, f"{parameter or 'the parameters'}: {reason}"


def main() -> None:
    """Reads nodes, modules and parameters from standard input; writes an answer per line as JSON.

    With `--describe` the answers are what there is, not what is wrong.
    """
    describes = DESCRIBE in sys.argv[1:]
    answers, sys.stdout = sys.stdout, sys.stderr  # so that output of a module does not mix with the answers
    for _, module, parameters in json.load(sys.stdin):
        answer = _description(module) if describes else _answer(module, parameters)
        answers.write(json.dumps(answer) + "\n")
        answers.flush()


if __name__ == "__main__":
    main()
