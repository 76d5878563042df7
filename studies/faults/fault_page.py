"""The page `docs/faults.md`: one table per section, each row with the tests that provoke its fault."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

PAGE = Path("docs/faults.md")
_SECTION = re.compile(r"^## ([A-Z])\. (.+)$")
_ROW = re.compile(r"^\|\s*([A-Z]\d+)\s*\|")
_CELLS = re.compile(r"(?<!\\)\|")


class FaultPageError(ValueError):
    """The page cannot be read as tables of faults; the message names the line."""


@dataclass(frozen=True)
class FaultRow:
    """One fault.

    Attributes:
        id: Letter of the section and number.
        section: Title of the section, with its letter.
        fault, answer: What goes wrong, and what happens then.
        tests: pytest node ids; without the values of parameters an id stands for all of them.
    """

    id: str
    section: str
    fault: str
    answer: str
    tests: tuple[str, ...]


def read_page(path: Path) -> list[FaultRow]:
    """All rows in order.

    Raises:
        FaultPageError: A row lacks a cell, its test or its section, or an id comes twice.
        FileNotFoundError: There is no such page.
    """
    rows: dict[str, FaultRow] = {}
    section = ""
    for number, line in enumerate(path.read_text(encoding="utf-8").splitlines(), start=1):
        heading = _SECTION.match(line)
        if heading:
            section = f"{heading[1]}. {heading[2]}"
        elif _ROW.match(line):
            row = _row(line, section, f"{path}:{number}")
            if row.id in rows:
                raise FaultPageError(f"{path}:{number}: id {row.id} comes twice; give the row a free number")
            rows[row.id] = row
    return list(rows.values())


def _row(line: str, section: str, where: str) -> FaultRow:
    cells = [cell.strip().replace("\\|", "|") for cell in _CELLS.split(line.strip())[1:-1]]
    if len(cells) != 4 or not all(cells):
        raise FaultPageError(f"{where}: {len(cells)} cells; a row has id, fault, what happens, test")
    tests = tuple(re.findall(r"`([^`]+)`", cells[3]))
    if not tests or any("::" not in test for test in tests):
        raise FaultPageError(f"{where}: {cells[0]} names no test; write `tests/….py::test_…` in backticks")
    if not section.startswith(cells[0][0]):
        raise FaultPageError(f"{where}: {cells[0]} stands in section {section or '(none)'!r}")
    return FaultRow(cells[0], section, cells[1], cells[2], tests)
