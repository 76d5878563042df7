"""The source code that a result comes from. Every cache key holds its digest, so that nothing cached is stale."""

from __future__ import annotations

import hashlib
import os
import re
import sys
import time
from functools import cache
from pathlib import Path

_FOLDER = Path(__file__).resolve().parents[1]
_WITH_WORKSPACE = (_FOLDER.parent, _FOLDER / "paramove" / "workspace")  # of a clone, of a wheel
_IMPORTED_NS = time.clock_gettime_ns(time.CLOCK_REALTIME)
_IMPORT = re.compile(
    rb"^[ \t]*(?:from[ \t]+((?:paramove|sim|studies)\b[\w.]*)[ \t]+import[ \t]+(\([^)]*\)|.*)|"
    rb"import[ \t]+((?:paramove|sim|studies)\.[\w.]+))",
    re.MULTILINE,
)
_IN_STUB = re.compile(r"^from \.([\w.]+) import (\w+) as", re.MULTILINE)


@cache
def code_digest(*modules: str) -> str:
    """Sixteen hexadecimal digits, from the source of modules and of all modules of this project that these lead to."""
    digest = hashlib.sha256()
    for module in modules_behind(*modules):
        digest.update(b"%s\0%d\0%s" % (module.encode(), len(_source(module)), _source(module)))
    return digest.hexdigest()[:16]


def modules_behind(*modules: str) -> tuple[str, ...]:
    """These modules and all of the project that they import, directly or through others, wherever an import stands.

    A name that is imported from a package leads to the module from which the package's `__init__` has it.
    """
    found, open_ends = set[str](), list(modules)
    while open_ends:
        module = open_ends.pop()
        if module not in found:
            found.add(module)
            open_ends += [_origin(source, name) for source, names in _imports(module) for name in names or ("",)]
    return tuple(sorted(found))


def _origin(module: str, name: str) -> str:
    """The module where a name lies that is imported from another one."""
    if name and _file(f"{module}.{name}"):
        return f"{module}.{name}"
    if getattr(_file(module), "name", "") == "__init__.py":
        for source, names in _imports(module):
            if name in names:
                return _origin(source, name)
    return module


@cache
def _imports(module: str) -> list[tuple[str, list[str]]]:
    """The modules of the project that the source of a module imports, with the names that it takes from each.

    A package that imports only what is asked for has its names in a stub beside it.
    """
    found = [
        ((source or whole).decode(), [name.decode() for name in re.findall(rb"\w+", names)])
        for source, names, whole in _IMPORT.findall(_source(module))
    ]
    file = _file(module)
    stub = file.with_suffix(".pyi") if file is not None and file.name == "__init__.py" else None
    if stub is not None and stub.is_file():
        found += [(f"{module}.{source}", [name]) for source, name in _IN_STUB.findall(stub.read_text(encoding="utf-8"))]
    return found


@cache
def _source(module: str) -> bytes:
    """The source, made unique where it is unknown which one this process runs: without a file, or with a later one."""
    file = _file(module)
    if file is None:
        return os.urandom(16)
    source = file.read_bytes()
    return source + os.urandom(16) if file.stat().st_ctime_ns > _IMPORTED_NS else source


@cache
def _file(module: str) -> Path | None:
    if loaded := getattr(sys.modules.get(module), "__file__", None):
        return Path(loaded)
    package, *_ = parts = module.split(".")
    for folder in [_FOLDER] if package == "paramove" else [*map(Path, sys.path), *_WITH_WORKSPACE]:
        path = folder.joinpath(*parts)
        for file in (path / "__init__.py", path.with_suffix(".py")):
            if file.is_file():
                return file
    return None
