"""CSV files with a header: `<point>_x`, `<point>_y`, `<point>_z` for each point, and `time` in seconds if known."""

from __future__ import annotations

import csv
import math
import re
from array import array
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np

from paramove.demonstrations import DemonstrationError
from paramove.demonstrations.importing.conversion import RawTake
from paramove.documents import Floats, size_of, unreadable

COLUMN = re.compile(r"(.+?)[ _.:/-]?([xyz])", re.IGNORECASE)
TIMES = {"time": 1.0, "time_s": 1.0, "t": 1.0, "time_ms": 1e-3, "time_ns": 1e-9, "timestamp": 1.0}
"""Names of columns with times, and their unit in seconds."""
PASSED_OVER = {"frame", "frames", "index", "sample"}
LINE_LETTERS = 2**20
"""Maximum length of a line; a longer one is cut, and rejected for its number of cells."""
LOST = {"", "nan", "na", "null", "none", "-"}


def read_csv(path: Path) -> list[RawTake]:
    """Points over time; an empty cell or NaN is a lost point. Separated by ',', ';' or tabs.

    Raises DemonstrationError with line and column of what is wrong.
    """
    size_of(path, "CSV file", DemonstrationError)
    rows = _rows(path)
    header = [name.strip() for name in next(rows, (0, []))[1]]
    times, points = _columns(path, header) if header else (None, {})
    lines, numbers = array("q"), array("d")
    for line, row in rows:
        lines.append(line)
        numbers.extend(_numbers(path, line, header, row))
    if not lines:
        raise DemonstrationError(f"{path}: expected a header and a line for each frame, found {len(header)} columns")
    values = np.array(numbers).reshape(len(lines), -1)
    positions = np.stack([values[:, columns] for columns in points.values()], axis=1)
    time = None if times is None else _time(path, lines, values[:, times], header[times])
    return [RawTake(path.stem, time, positions, tuple(points))]


def _rows(path: Path) -> Iterator[tuple[int, list[str]]]:
    """The cells of each line that is not empty, with its number; raises DemonstrationError for what is no CSV."""
    number = 0
    try:
        with path.open(encoding="utf-8-sig", newline="") as file:
            head = file.readline(LINE_LETTERS)
            file.seek(0)
            lines = iter(lambda: file.readline(LINE_LETTERS), "")
            for row in (reader := csv.reader(lines, delimiter=max(",;\t", key=head.count), strict=True)):
                if any(row):
                    yield number + 1, row
                number = reader.line_num
    except UnicodeDecodeError as error:
        raise DemonstrationError(f"{path} is no UTF-8 text: {error}") from error
    except csv.Error as error:
        raise DemonstrationError(
            f"{path}:{number + 1}: {error}; expected cells of at most {csv.field_size_limit()} characters, with closed "
            "quotes or none"
        ) from error
    except OSError as error:
        raise DemonstrationError(unreadable(path, error)) from error


def _columns(path: Path, header: list[str]) -> tuple[int | None, dict[str, list[int]]]:
    """Column of the time, and the columns of x, y, z of each point."""
    time = next((number for number, name in enumerate(header) if name.lower() in TIMES), None)
    columns: dict[str, dict[str, int]] = {}
    for number, name in enumerate(header):
        if number == time or name.lower() in PASSED_OVER:
            continue
        parts = COLUMN.fullmatch(name)
        if parts is None or parts[2].lower() in columns.get(parts[1], {}):
            raise DemonstrationError(
                f"{path}:1: column {number + 1} is called '{name:.80}'; expected wrist_x, wrist_y, wrist_z, once for "
                f"each point, and {', '.join(TIMES)} for times"
            )
        columns.setdefault(parts[1], {})[parts[2].lower()] = number
    for point, axes in columns.items():
        if len(axes) < 3:
            missing = ", ".join(f"{point}_{axis}" for axis in "xyz" if axis not in axes)
            raise DemonstrationError(f"{path}:1: {missing} is missing; a point has three columns")
    if not columns:
        raise DemonstrationError(f"{path}:1: no column of a point; expected such as wrist_x, wrist_y, wrist_z")
    return time, {point: [axes[axis] for axis in "xyz"] for point, axes in columns.items()}


def _numbers(path: Path, line: int, header: list[str], row: list[str]) -> list[float]:
    if len(row) != len(header):
        raise DemonstrationError(f"{path}:{line}: {len(row)} cells; the header names {len(header)} columns")
    values = []
    for name, cell in zip(header, row, strict=True):
        word = cell.strip()
        try:
            value = math.nan if word.lower() in LOST else float(word)
        except ValueError as error:
            hint = "; write decimal points" if re.fullmatch(r"-?\d+,\d+", word) else ""
            raise DemonstrationError(f"{path}:{line}: {name}: '{word:.40}' is no number{hint}") from error
        values.append(value if math.isfinite(value) else math.nan)
    return values


def _time(path: Path, lines: Sequence[int], values: Floats, name: str) -> Floats:
    bad = np.flatnonzero(np.isnan(values))
    if bad.size:
        raise DemonstrationError(f"{path}:{lines[int(bad[0])]}: {name} is empty; every frame has a time")
    result: Floats = (values - values[0]) * TIMES[name.lower()]
    return result
