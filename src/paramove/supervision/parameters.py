"""Parameters of nodes, checked by the nodes' own Config before anything starts.

The modules are imported in one process of its own, because they import heavy libraries. Nodes are
checked only if they are given parameters or need some, because this check takes most of the time before a start. Its
success is cached, so that it is not repeated until code, a library or a parameter changes.
"""

from __future__ import annotations

import contextlib
import hashlib
import importlib
import json
import subprocess
import sys
from collections.abc import Iterator, Mapping, Sequence
from importlib.metadata import version
from pathlib import Path
from typing import Any

from platformdirs import user_cache_path
from pydantic import BaseModel, ValidationError
from pydantic_core import ErrorDetails

from paramove.documents import DocumentError, nearest
from paramove.source_code import code_digest
from paramove.supervision.environment import run_python
from paramove.supervision.interfaces import Interface
from paramove.supervision.launch_file import Launch, keys_at
from paramove.workspace import Workspace

TIMEOUT_S = 120.0
"""For importing the modules, on a busy machine with cold caches."""


def wrong_parameters(
    launch: Launch, interfaces: Mapping[str, Interface], workspace: Workspace
) -> Iterator[DocumentError]:
    """Parameters that the nodes' own Config rejects, and modules that cannot be imported."""
    to_check = {
        name: (launch.file.nodes[name].module, launch.file.nodes[name].parameters)
        for name, interface in interfaces.items()
        if interface.has_config and (launch.file.nodes[name].parameters or interface.needs_parameters)
    }
    if not to_check:
        return
    passed = _passed_before(to_check, interfaces, workspace)
    if passed is not None and passed.is_file():
        return
    answers, ending = _check_in_process(list(to_check.values()), workspace)
    for (name, (module, _)), answer in zip(to_check.items(), answers, strict=False):
        if isinstance(answer, str):
            yield launch.error(("nodes", name, "module"), f"'{module}' cannot be imported: {answer}")
            continue
        for finding in answer:
            path = ("nodes", name, "parameters", *finding["path"])
            yield launch.error(path, _message_of(name, ".".join(finding["path"]), finding))
    if len(answers) < len(to_check):
        name, (module, _) = list(to_check.items())[len(answers)]
        yield launch.error(("nodes", name, "module"), f"'{module}' cannot be imported: {ending}")
    if passed is not None and answers == [[]] * len(to_check):
        with contextlib.suppress(OSError):  # not writable: the next launch checks again
            passed.parent.mkdir(parents=True, exist_ok=True)
            passed.touch()


def _passed_before(
    to_check: Mapping[str, tuple[str, dict[str, Any]]], interfaces: Mapping[str, Interface], workspace: Workspace
) -> Path | None:
    """A file that exists once these parameters were right for this code; None if the code of a node may be anywhere."""
    if not all(interfaces[name].path.is_relative_to(workspace.folders[-1]) for name in to_check):
        return None
    code = code_digest(*(module for module, _ in to_check.values()))
    key = json.dumps([to_check, code, workspace.digest, sys.version, version("pydantic")])
    return user_cache_path("paramove") / "checked" / hashlib.sha256(key.encode()).hexdigest()


def _message_of(node: str, parameter: str, finding: dict[str, Any]) -> str:
    if finding["type"] in ("extra_forbidden", "unexpected_keyword_argument"):  # the second of dataclasses
        return f"'{node}' has no parameter '{parameter}'; {nearest(finding['path'][-1], finding['known'])}"
    if finding["type"] == "missing":
        return f"'{node}' needs the parameter '{parameter}'"
    return f"'{node}' rejects {parameter or 'its parameters'}: {finding['message']}, found {finding['found']}"


def _check_in_process(to_check: Sequence[tuple[str, dict[str, Any]]], workspace: Workspace) -> tuple[list[Any], str]:
    """Answers of a process that imports the modules in turn, and how it ended if an answer is missing."""
    try:
        answer = run_python("-m", __name__, workspace=workspace, timeout_s=TIMEOUT_S, stdin=json.dumps(to_check))
    except subprocess.TimeoutExpired as error:
        output = error.stdout.decode() if error.stdout else ""
        return [json.loads(line) for line in output.splitlines()], f"it took more than {TIMEOUT_S:g} s"
    last = answer.stderr.strip().splitlines()[-1:] or [f"the process ended with exit code {answer.returncode}"]
    return [json.loads(line) for line in answer.stdout.splitlines()], last[0]


def _answer(module: str, parameters: dict[str, Any]) -> str | list[dict[str, Any]]:
    """Findings about the parameters, or why the module cannot be imported."""
    try:
        config = getattr(importlib.import_module(module), "Config", None)
    except (Exception, SystemExit) as error:  # an import may do anything; its error is reported
        return f"{type(error).__name__}: {error}"
    if not isinstance(config, type) or not issubclass(config, BaseModel):
        return []
    try:
        config.model_validate(parameters)
    except ValidationError as error:
        return [_finding(config, details) for details in error.errors()]
    return []


def _finding(config: type[BaseModel], details: ErrorDetails) -> dict[str, Any]:
    path = [str(part) for part in details["loc"]]
    return {
        "path": path,
        "type": details["type"],
        "message": _message(details),
        "found": f"{details['input']!r:.200}",
        "known": keys_at(config, path[:-1]),
    }


def _message(details: ErrorDetails) -> str:
    message = details["msg"].removeprefix("Value error, ")
    return message[:1].lower() + message[1:]


def main() -> None:
    """Reads modules and parameters from standard input; writes an answer per line as JSON."""
    answers, sys.stdout = sys.stdout, sys.stderr  # so that output of a module does not mix with the answers
    for module, parameters in json.load(sys.stdin):
        answers.write(json.dumps(_answer(module, parameters)) + "\n")
        answers.flush()


if __name__ == "__main__":
    main()
