"""A new application: a folder with a message, topics, two nodes, a launch file and a test, which runs at once."""

from __future__ import annotations

from pathlib import Path

TEMPLATE = Path(__file__).parent / "new_application"
_ENDING = ".in"
_HIDDEN = {"gitignore": ".gitignore"}
"""Name in the template -> name in the folder."""


def start_application(folder: Path, name: str) -> list[Path]:
    """Write the files of a new application.

    Args:
        folder: Where; made if it is not there.
        name: Of its launch file, and the package of its messages.

    Returns:
        The files, relative to the folder.

    Raises:
        FileExistsError: The folder has something in it; nothing is written.
        OSError: It cannot be written.
    """
    if folder.exists() and (not folder.is_dir() or any(folder.iterdir())):
        raise FileExistsError(folder)
    written = []
    for source in sorted(TEMPLATE.rglob(f"*{_ENDING}")):
        relative = source.relative_to(TEMPLATE)
        file_name = relative.name.removesuffix(_ENDING).replace("NAME", name)
        path = relative.with_name(_HIDDEN.get(file_name, file_name))
        (folder / path).parent.mkdir(parents=True, exist_ok=True)
        (folder / path).write_text(source.read_text(encoding="utf-8").replace("NAME", name), encoding="utf-8")
        written.append(path)
    return written
