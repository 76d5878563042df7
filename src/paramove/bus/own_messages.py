"""Message types of a workspace: its `msgs/*.proto`, compiled when they are first needed.

They may import the library's messages (`paramove/msgs/arm_pose.proto`), Foxglove's (`foxglove/PoseInFrame.proto`),
Google's (`google/protobuf/timestamp.proto`) and each other (`msgs/lamp.proto`). protoc comes with the package
grpcio-tools; its result is kept in the cache.
"""

from __future__ import annotations

import contextlib
import functools
import hashlib
import importlib
import importlib.metadata
import pkgutil
import re
import subprocess
import sys
import tempfile
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from google.protobuf import descriptor_pb2, descriptor_pool, message_factory  # type: ignore[import-untyped]
from platformdirs import user_cache_path

from paramove.bus.fields import OWN_FOLDER
from paramove.documents import DocumentError, InputError, Position, raise_any, read_text, replacing
from paramove.workspace import Workspace

_LIBRARIES = {
    "foxglove/": "foxglove_schemas_protobuf",
    "paramove/msgs/": "paramove.msgs",
    "google/protobuf/": "google.protobuf",
}
"""Begin of the name of a `.proto` file -> the package with its code."""
_TIMEOUT_S = 60.0
_PROTOC_LINE = re.compile(r"(?P<file>[^:\n]+\.proto):(?:(?P<line>\d+):(?P<column>\d+):)? ?(?P<message>.+)")


def own_messages(root: Path) -> dict[str, type[Any]]:
    """Message types of a workspace by their full names, such as `my_robot.Lamp`.

    Args:
        root: Folder of the workspace.

    Raises DocumentError with file, line and column of what protoc rejects; InputError if it cannot run.
    """
    return _load(_compiled(root)) if _sources(root) else {}


def message_types() -> dict[str, type[Any]]:
    """All types by their full names: those of the workspace of the current folder, paramove's, Foxglove's, Google's.

    Raises as `own_messages` does.
    """
    found = dict(library_messages())
    for layer in Workspace.here().layers:
        found |= own_messages(layer)
    return found


def _sources(root: Path) -> list[Path]:
    """Its `.proto` files but those of the library, which lie in the same folder of a clone."""
    own = (path for path in (root / OWN_FOLDER).glob("*.proto") if _code_of(f"paramove/msgs/{path.name}") is None)
    return sorted(own)


def _code_of(file: str) -> Any:
    """Module of a library's `.proto` file; None if there is none."""
    for begin, package in _LIBRARIES.items():
        if file.startswith(begin):
            with contextlib.suppress(ModuleNotFoundError):
                return importlib.import_module(f"{package}.{file.removeprefix(begin).removesuffix('.proto')}_pb2")
    return None


def _compiled(root: Path) -> descriptor_pb2.FileDescriptorSet:
    texts = {f"{OWN_FOLDER}/{path.name}": read_text(path, "schema of messages") for path in _sources(root)}
    kept = user_cache_path("paramove") / "messages" / f"{_digest(texts)}.binpb"
    with contextlib.suppress(OSError):
        return descriptor_pb2.FileDescriptorSet.FromString(kept.read_bytes())
    content = _run_protoc(root, texts)
    with contextlib.suppress(OSError):  # no cache: it is compiled again
        kept.parent.mkdir(parents=True, exist_ok=True)
        with replacing(kept) as unfinished:
            unfinished.write_bytes(content)
    return descriptor_pb2.FileDescriptorSet.FromString(content)


def _digest(texts: Mapping[str, str]) -> str:
    digest = hashlib.sha256()
    for package in ("paramove", "foxglove-schemas-protobuf"):
        digest.update(f"{package} {importlib.metadata.version(package)}\0".encode())
    for name, text in texts.items():
        digest.update(f"{name}\0{text}\0".encode())
    return digest.hexdigest()


def _run_protoc(root: Path, files: Iterable[str]) -> bytes:
    """Descriptors of these files, which are relative to `root`."""
    with tempfile.TemporaryDirectory(prefix="paramove-msgs-") as folder:
        known, result = Path(folder, "known.binpb"), Path(folder, "result.binpb")
        known.write_bytes(_library_files().SerializeToString())
        command = [sys.executable, "-P", "-m", "grpc_tools.protoc", f"--proto_path={root}"]
        command += [f"--descriptor_set_in={known}", f"--descriptor_set_out={result}", *files]
        try:
            done = subprocess.run(command, capture_output=True, text=True, timeout=_TIMEOUT_S, check=False)
        except subprocess.TimeoutExpired as error:
            raise InputError(f"protoc needs more than {_TIMEOUT_S:g} s for {root / OWN_FOLDER}") from error
        if done.returncode == 0:
            return result.read_bytes()
    if "No module named" in done.stderr:
        raise InputError(
            f"messages of {root / OWN_FOLDER} are compiled by protoc: install it with `pip install grpcio-tools`"
        )
    raise_any([_finding(root, line) for line in done.stderr.splitlines() if line.strip()])
    raise InputError(f"protoc ended with exit code {done.returncode} for {root / OWN_FOLDER}")


def _finding(root: Path, line: str) -> DocumentError:
    """A line of protoc."""
    found = _PROTOC_LINE.fullmatch(line)
    if found is None:
        return DocumentError(Position(str(root / OWN_FOLDER)), line)
    position = Position(str(root / found["file"]), int(found["line"] or 0), int(found["column"] or 0))
    return DocumentError(position, found["message"])


def _load(files: descriptor_pb2.FileDescriptorSet) -> dict[str, type[Any]]:
    """Classes of all messages of the files, in protobuf's pool of this process."""
    pool = descriptor_pool.Default()
    own = {file.name: file for file in files.file}
    added = set[str]()

    def add(file: descriptor_pb2.FileDescriptorProto) -> None:
        if file.name in added:
            return
        added.add(file.name)
        for needed in file.dependency:
            if needed in own:
                add(own[needed])
            else:
                _code_of(needed)
        try:
            pool.AddSerializedFile(file.SerializeToString())
        except TypeError as error:
            raise InputError(f"{file.name}: {error}; give its `package` a name that no other has") from error

    for file in files.file:
        add(file)
    names = (f"{file.package}.{message.name}".lstrip(".") for file in files.file for message in file.message_type)
    return {name: message_factory.GetMessageClass(pool.FindMessageTypeByName(name)) for name in names}


@functools.cache
def _library_modules() -> tuple[Any, ...]:
    """Every generated module of the libraries."""
    modules = []
    for name in _LIBRARIES.values():
        package = importlib.import_module(name)
        for module in pkgutil.iter_modules(package.__path__):
            if module.name.endswith("_pb2"):
                modules.append(importlib.import_module(f"{name}.{module.name}"))
    return tuple(modules)


@functools.cache
def library_messages() -> dict[str, type[Any]]:
    """Types of messages of paramove, Foxglove and Google by their full names."""
    found = {}
    for module in _library_modules():
        for message in module.DESCRIPTOR.message_types_by_name.values():
            found[message.full_name] = message_factory.GetMessageClass(message)
    return found


def _library_files() -> descriptor_pb2.FileDescriptorSet:
    """Descriptors of all files of the libraries, each after those that it imports."""
    found = descriptor_pb2.FileDescriptorSet()
    added = set[str]()

    def add(file: Any) -> None:
        if file.name not in added:
            added.add(file.name)
            for needed in file.dependencies:
                add(needed)
            file.CopyToProto(found.file.add())

    for module in _library_modules():
        add(module.DESCRIPTOR)
    return found
