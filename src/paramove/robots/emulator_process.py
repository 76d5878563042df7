"""Whether a process is an emulator that a launcher started, and runs the installed code.

A node may serve a pseudo-terminal and pass on what it receives. Only three modules of the installed workspace emulate
robots, so a process counts if the launcher itself started one of them, by the Python of this process, and if no file on
PYTHONPATH replaces a module of it (by `-P` the working directory is not searched). This is read from the system
(/proc), and is no defence against a user who changes the installed files, or a running process.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator
from importlib.machinery import PathFinder, all_suffixes
from pathlib import Path

import psutil

from paramove.workspace import Workspace

MODULES = ("sim.dynamixel_emulator", "sim.shared_table", "sim.simulator")
"""That emulate a robot."""
LAYERED = "sim"
"""The package whose modules a folder of the workspace may add to, or replace."""
IMPORTED_AT_START = ("sitecustomize", "usercustomize")


def why_no_emulator(pid: int, launcher: int) -> str:
    """Why a process is not an emulator that this launcher started, a clause without the subject; "" if it is."""
    try:
        process = psutil.Process(pid)
        if process.ppid() != launcher:
            return "was not started by the launcher of this run"
        command, program = process.cmdline(), process.exe()
        folder, variables = Path(process.cwd()), process.environ()
    except (psutil.Error, OSError) as error:
        return f"cannot be inspected ({type(error).__name__})"
    module = command[3] if command[1:3] == ["-P", "-m"] and len(command) > 3 else ""
    if module not in MODULES:
        return f"runs {module or ' '.join(command[:2])}, none of the emulators {', '.join(MODULES)}"
    if not _same_file(Path(program), Path(sys.executable)):
        return f"is run by {program}, not by {sys.executable}"
    paths = [Path(entry) for entry in variables.get("PYTHONPATH", "").split(os.pathsep) if entry]
    replaced = next(_replaced_modules([folder / path for path in paths]), None)
    return f"runs {module}, but with {replaced} instead of the installed file" if replaced else ""


def _replaced_modules(folders: list[Path]) -> Iterator[Path]:
    """Files in these folders of a module search path that Python finds before a module of the installation."""
    installed = Workspace.here().layers[-1]
    others = [
        folder for folder in folders if not any(_same_file(folder, one) for one in (installed, installed / "src"))
    ]
    known = {*sys.stdlib_module_names, *IMPORTED_AT_START}
    own = [entry for entry in sys.path if entry and not any(_same_file(Path(entry), folder) for folder in others)]
    for folder in others:
        yield from _other_files(folder / LAYERED, installed / LAYERED)
        for file in _modules_in(folder):
            name = file.name.partition(".")[0]
            if name != LAYERED and (name in known or PathFinder.find_spec(name, own)):
                yield file


def _other_files(folder: Path, installed: Path) -> Iterator[Path]:
    """Modules of a package's folder that replace one of the installed package, and are not equal to it."""
    known = {file.name.partition(".")[0] for file in _modules_in(installed)} | {"__init__"}
    for file in _modules_in(folder):
        if file.name.partition(".")[0] in known:
            other = installed / file.name
            if file.is_dir() and other.is_dir():
                yield from _other_files(file, other)
            elif not (file.is_file() and other.is_file() and file.read_bytes() == other.read_bytes()):
                yield file


def _modules_in(folder: Path) -> list[Path]:
    """Modules and packages that Python finds in a folder."""
    try:
        files = sorted(folder.iterdir())
    except OSError:
        return []
    return [file for file in files if file.name.endswith(tuple(all_suffixes())) or (file / "__init__.py").is_file()]


def _same_file(one: Path, other: Path) -> bool:
    try:
        return one.samefile(other)
    except OSError:
        return False
