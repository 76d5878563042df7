"""Generates src/paramove/msgs/*_pb2.py and .pyi from msgs/*.proto.

    python msgs/generate.py            write the generated code
    python msgs/generate.py --check    exit with 1 if the committed code is not what the schemas say

Needs grpcio-tools 1.71.2 (protoc 29): code from a newer protoc does not import on protobuf 5.29.
"""

from __future__ import annotations

import argparse
import importlib.metadata
import importlib.resources
import sys
import tempfile
from pathlib import Path

SCHEMAS = Path(__file__).resolve().parent
SOURCES = SCHEMAS.parent / "src"
PACKAGE = Path("paramove") / "msgs"
GENERATOR_VERSION = "1.71.2"


def generate(destination: Path) -> None:
    """Writes the code of every schema under `destination`/paramove/msgs.

    Raises RuntimeError if the generator has another version than the pinned one or refuses a schema.
    """
    found = importlib.metadata.version("grpcio-tools")
    if found != GENERATOR_VERSION:
        raise RuntimeError(
            f"grpcio-tools is {found}, the committed code comes from {GENERATOR_VERSION}; "
            f"install grpcio-tools=={GENERATOR_VERSION}"
        )
    from grpc_tools import protoc

    well_known = importlib.resources.files("grpc_tools") / "_proto"
    # The virtual root gives the flat folder its full import path, so that the code says `paramove.msgs.x_pb2`.
    arguments = [
        "protoc",
        f"-I{PACKAGE.as_posix()}={SCHEMAS}",
        f"-I{well_known}",
        f"--python_out={destination}",
        f"--pyi_out={destination}",
        *(f"{PACKAGE.as_posix()}/{schema.name}" for schema in sorted(SCHEMAS.glob("*.proto"))),
    ]
    if protoc.main(arguments) != 0:
        raise RuntimeError("protoc refused a schema; its message stands above")


def generated_files(root: Path) -> dict[str, bytes]:
    """Name and content of the generated files under `root`/paramove/msgs."""
    return {path.name: path.read_bytes() for path in sorted((root / PACKAGE).glob("*_pb2.py*"))}


def differences() -> list[str]:
    """Names of generated files that are missing, superfluous or not what the schemas say."""
    with tempfile.TemporaryDirectory() as folder:
        generate(Path(folder))
        fresh = generated_files(Path(folder))
    committed = generated_files(SOURCES)
    return sorted(name for name in fresh.keys() | committed.keys() if fresh.get(name) != committed.get(name))


def main() -> int:
    parser = argparse.ArgumentParser(description="Generate the message code from msgs/*.proto.")
    parser.add_argument("--check", action="store_true", help="only compare; exit with 1 on a difference")
    if parser.parse_args().check:
        stale = differences()
        if stale:
            sys.stderr.write(f"not what msgs/*.proto say: {', '.join(stale)}; run `python msgs/generate.py`\n")
        return 1 if stale else 0
    for name in generated_files(SOURCES):
        (SOURCES / PACKAGE / name).unlink()
    generate(SOURCES)
    return 0


if __name__ == "__main__":
    sys.exit(main())
