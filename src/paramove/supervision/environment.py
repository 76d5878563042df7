"""Environment variables of a run: those that have an effect, are ignored or cause trouble."""

from __future__ import annotations

import os
import re
import resource
import subprocess
import sys
import tempfile
import zoneinfo
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

from platformdirs import user_cache_path

from paramove.bus import default_folder
from paramove.linear_algebra_threads import ONE_THREAD
from paramove.supervision.domain import check_name
from paramove.workspace import Workspace

OPEN_FILES = 256
"""A node has two or three for each topic; the recorder, which subscribes to nearly all, about a hundred."""
DEFAULT_DOMAIN = "default"
NEEDED = "paramove av cv2 dynamixel_sdk google matplotlib mcap mujoco numba numpy PIL platformdirs psutil pydantic rich"
NEEDED += " ruamel scipy serial typer zmq zstandard"
"""Modules that a run imports from its installation."""


@dataclass(frozen=True)
class Environment:
    """The environment of a run.

    Attributes:
        domain: Name of the bus domain.
        sockets: Folder in which the sockets of the bus are made.
        notes: Variables that are ignored or cause trouble: name, value and remedy, a line each.
    """

    domain: str
    sockets: Path
    notes: tuple[str, ...]


def examined(variables: Mapping[str, str], workspace: Workspace) -> Environment:
    """Checks the variables that have an effect; raises DomainError for an invalid name of a domain."""
    domain = variables.get("PARAMOVE_DOMAIN") or DEFAULT_DOMAIN
    check_name(domain)
    sockets = default_folder(domain)
    notes = [
        *workspace.left_out,
        *_ignored_folder(variables, "XDG_RUNTIME_DIR", f"sockets lie in {sockets}"),
        *_ignored_folder(variables, "TMPDIR", f"temporary files lie in {tempfile.gettempdir()}"),
        *_cache_folder(variables),
        *_time_zone(variables),
        *_hidden_modules(variables, workspace),
        *_owner(workspace.root),
    ]
    return Environment(domain, sockets, tuple(notes))


def node_environment(own: Mapping[str, str], workspace: Workspace) -> dict[str, str]:
    """Environment of the nodes: the launcher's own, with one thread for each linear-algebra library unless set.

    Python finds modules in the workspace's layers and then in what PYTHONPATH names: an empty entry, which means the
    working directory, is left out, as this is searched only if it is a layer. Nodes are started with `-P` therefore.
    """
    path = [*map(str, workspace.layers), *filter(None, own.get("PYTHONPATH", "").split(os.pathsep))]
    return {
        **ONE_THREAD,
        **own,
        "PYTHONUNBUFFERED": "1",
        "PYTHONFAULTHANDLER": "1",
        "PYTHONPATH": os.pathsep.join(path),
    }


def run_python(
    *arguments: str, workspace: Workspace, timeout_s: float, stdin: str = ""
) -> subprocess.CompletedProcess[str]:
    """Runs Python as it runs the nodes of a workspace. Raises subprocess.TimeoutExpired."""
    return subprocess.run(
        [sys.executable, "-P", *arguments],
        input=stdin,
        cwd=workspace.root,
        env=node_environment(os.environ, workspace),
        capture_output=True,
        text=True,
        timeout=timeout_s,
        check=False,
    )


def _unusable(folder: str) -> str:
    """Why nothing can be written into a folder; "" if it can."""
    if not os.path.isabs(folder):
        return "it is not an absolute path"
    if not os.path.isdir(folder):
        return "there is no such folder"
    if not os.access(folder, os.W_OK | os.X_OK):
        return "it cannot be written"
    return ""


def _ignored_folder(variables: Mapping[str, str], name: str, instead: str) -> Iterator[str]:
    value = variables.get(name, "")
    if value and (reason := _unusable(value)):
        yield f"{name}={value!r} is ignored: {reason}; {instead}. Unset it or correct it"


def _cache_folder(variables: Mapping[str, str]) -> Iterator[str]:
    cache = user_cache_path("paramove")
    there = next((folder for folder in (cache, *cache.parents) if os.path.exists(folder)), Path("/"))
    home = variables.get("HOME", "")
    if home and not os.path.isabs(home):
        yield f"HOME={home!r} is ignored: it is not an absolute path; the cache is {cache}. Correct it"
    reason = _unusable(str(there))
    if reason:
        name = "XDG_CACHE_HOME" if variables.get("XDG_CACHE_HOME") else "HOME"
        yield (
            f"{name}={variables.get(name, '')!r}: the cache {cache} is not writable ({reason}), so each run trains its "
            "movement again; set XDG_CACHE_HOME to a folder of yours"
        )


def _time_zone(variables: Mapping[str, str]) -> Iterator[str]:
    value = variables.get("TZ", "").removeprefix(":")
    if not value or re.fullmatch(r"[A-Za-z<][^/]*\d.*", value) or os.path.isabs(value):
        return
    try:
        zoneinfo.ZoneInfo(value)
    except (zoneinfo.ZoneInfoNotFoundError, ValueError, OSError):
        yield f"TZ={value!r} is not a known time zone; runs are named by UTC. Unset it or correct it"


def _hidden_modules(variables: Mapping[str, str], workspace: Workspace) -> Iterator[str]:
    """Files that Python finds before the required modules: in the workspace's first layer, or on PYTHONPATH."""
    names = {*NEEDED.split(), *sys.stdlib_module_names}
    first = workspace.layers[0]
    folders = [(first, "the workspace's root", "rename it")]
    for entry in variables.get("PYTHONPATH", "").split(os.pathsep):
        if entry and Path(entry).resolve() not in (first, first / "src"):
            folders.append((Path(entry), "PYTHONPATH", "unset PYTHONPATH"))
    for folder, where, remedy in folders:
        try:
            hiding = sorted(path for path in folder.iterdir() if path.suffix in (".py", "") and path.stem in names)
        except OSError:
            continue
        for path in hiding:
            if path.suffix == ".py" or (path / "__init__.py").is_file():
                yield f"{path} ({where}) hides the required module {path.stem}; {remedy}"


def _owner(workspace: Path) -> Iterator[str]:
    owner = workspace.stat().st_uid
    if os.geteuid() == 0 and owner != 0:
        yield f"run as root in a clone of user {owner}: the folder of this run will belong to root"


class LimitError(RuntimeError):
    """The operating system allows less than a run needs; the text has the command that raises the limit."""


def allow_open_files() -> None:
    """Raises this process's limit of open files if it is too low; nodes inherit it.

    Raises LimitError if the hard limit, which only a privileged user raises, is too low.
    """
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    if soft == resource.RLIM_INFINITY or soft >= OPEN_FILES:
        return
    if hard != resource.RLIM_INFINITY and hard < OPEN_FILES:
        raise LimitError(
            f"a process may have {soft} files open here (hard limit {hard}), a run needs {OPEN_FILES}; raise the "
            f"limit: `ulimit -Hn {OPEN_FILES}` as root, `nofile` in /etc/security/limits.conf, or LimitNOFILE= of "
            "the service"
        )
    resource.setrlimit(resource.RLIMIT_NOFILE, (OPEN_FILES, hard))
