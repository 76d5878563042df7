"""CSV files with a header: `<point>_x`, `<point>_y`, `<point>_z` for each point, and `time` in seconds if known."""

from __future__ import annotations

import csv
import math
import re
import warnings
from array import array
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import NamedTuple

import numpy as np

from paramove.demonstrations import DemonstrationError
from paramove.demonstrations.importing.checking import TIME_UNITS, RawTake, check_length
from paramove.documents import Floats, size_of, unreadable

COLUMN = re.compile(r"(.+?)([ _.:/-]?)([xyz])", re.IGNORECASE)
TIME = re.compile(r"(?:times?|timestamps?|t)(?:[ _.\[(-]+([a-zµμ]+)[\])]?)?", re.IGNORECASE)
UNITS = {
    "s": "seconds", "sec": "seconds", "secs": "seconds", "seconds": "seconds",
    "ms": "milliseconds", "msec": "milliseconds", "milliseconds": "milliseconds",
    "us": "microseconds", "µs": "microseconds", "μs": "microseconds", "usec": "microseconds",
    "microseconds": "microseconds", "ns": "nanoseconds", "nsec": "nanoseconds", "nanoseconds": "nanoseconds",
}  # fmt: skip
FRAME_NUMBERS = re.compile(
    r"(?:frames?|fnum|samples?|field)[ _.-]*(?:#|no|nr|num|numbers?|idx|index|id)?[.]?", re.IGNORECASE
)
ROW_NUMBERS = {"", "index", "unnamed: 0", "row", "rows"}
"""Names of the column of row numbers that tables of pandas have; they count frames if they are whole and increase."""
LINE_LETTERS = 2**20
"""Maximum length of a line; a longer one is cut, and rejected for its number of cells."""
CHUNK_BYTES = 2**20
LOST = {"", "nan", "na", "n/a", "#n/a", "null", "none", "-"}


class _Columns(NamedTuple):
    """Meaning of the columns by their names.

    Attributes:
        time: Number of the column of times; None without.
        time_unit_s: By the name of the column; None if it does not say.
        frames: Number of the column of frame numbers; None without.
        points: Name of a point -> columns of its x, y and z.
        faults: Name of a point -> why its columns cannot be used.
        others: Names of the columns that are passed over.
    """

    time: int | None
    time_unit_s: float | None
    frames: int | None
    points: dict[str, list[int]]
    faults: dict[str, str]
    others: list[str]


@dataclass
class _Table:
    """The numbers of the rows, (T, columns), and for columns with other text where the first is."""

    values: Floats
    faults: dict[int, str] = field(default_factory=dict)


def read_csv(path: Path) -> list[RawTake]:
    """Points over time; an empty cell or NaN is a lost point. Separated by ',', ';' or tabs.

    Raises DemonstrationError with line and column of what is wrong.
    """
    size_of(path, "CSV file", DemonstrationError)
    n_lines, longest = _lines(path)
    check_length(n_lines - 1, path)
    rows = _rows(path)
    first_line, cells = next(rows, (0, []))
    header = [name.strip() for name in cells]
    columns = _columns(path, header)
    table = _fast_table(path, first_line, header) if longest < csv.field_size_limit() else None
    if table is None or (columns.time is not None and np.isnan(table.values[:, columns.time]).any()):
        table = _table(path, rows, header, columns)
    if not len(table.values):
        raise DemonstrationError(f"{path}: expected a header and a line for each frame, found {len(header)} columns")
    of_cells = {
        point: table.faults[number]
        for point, numbers in columns.points.items()
        for number in numbers
        if number in table.faults
    }
    names = tuple(columns.points)
    values = table.values
    remarks = []
    if columns.others:
        passed_over = ", ".join(f"'{name:.40}'" for name in columns.others[:6])
        more = f" and {len(columns.others) - 6} more" if len(columns.others) > 6 else ""
        remarks.append(f"{path}: columns passed over: {passed_over}{more}")
    return [
        RawTake(
            path.stem,
            None if columns.time is None else values[:, columns.time],
            np.stack([values[:, columns.points[name]] for name in names], axis=1),
            names,
            time_unit_s=columns.time_unit_s,
            frame_numbers=_frame_numbers(path, table, header, columns.frames),
            faults=of_cells | columns.faults,
            remarks=tuple(remarks),
        )
    ]


def _frame_numbers(path: Path, table: _Table, header: list[str], column: int | None) -> Floats | None:
    """The column of frame numbers; None if there is none, or if one of row numbers does not count frames."""
    if column is None:
        return None
    numbers = table.values[:, column]
    if header[column].casefold() in ROW_NUMBERS:
        counts = column not in table.faults and np.isfinite(numbers).all() and (np.diff(numbers) >= 1.0).all()
        return numbers if counts else None
    if column in table.faults:
        raise DemonstrationError(table.faults[column])
    if not np.isfinite(numbers).all():
        row = int(np.flatnonzero(~np.isfinite(numbers))[0]) + 1
        raise DemonstrationError(f"{path}: {header[column]} is empty in row {row} after the header; number every frame")
    return numbers


def _lines(path: Path) -> tuple[int, int]:
    """Number of lines and bytes of the longest."""
    count = longest = before = 0
    try:
        with path.open("rb") as file:
            while chunk := file.read(CHUNK_BYTES):
                ends = np.flatnonzero(np.frombuffer(chunk, dtype=np.uint8) == ord("\n"))
                count += len(ends)
                lengths = np.diff(ends, prepend=-1 - before, append=len(chunk))
                longest = max(longest, int(lengths.max()))
                before = int(lengths[-1]) - 1
    except OSError as error:
        raise DemonstrationError(unreadable(path, error)) from error
    return count, longest


def _rows(path: Path) -> Iterator[tuple[int, list[str]]]:
    """The cells of each line that is not empty, with its number; raises DemonstrationError for what is no CSV."""
    number = 0
    try:
        with path.open(encoding="utf-8-sig", newline="") as file:
            head = file.readline(LINE_LETTERS)
            file.seek(0)
            lines = iter(lambda: file.readline(LINE_LETTERS), "")
            for row in (reader := csv.reader(lines, delimiter=_separator(head), strict=True)):
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


def _separator(head: str) -> str:
    return max(",;\t", key=head.count)


def _columns(path: Path, header: list[str]) -> _Columns:
    """Meaning of the columns; raises DemonstrationError if there is no point at all."""
    times = [(number, match) for number, name in enumerate(header) if (match := _time_column(name))]
    time, unit = times[0] if times else (None, None)
    frames = next((number for number, name in enumerate(header) if FRAME_NUMBERS.fullmatch(name)), None)
    if frames is None:
        frames = next((number for number, name in enumerate(header) if name.casefold() in ROW_NUMBERS), None)
    known = {name.casefold() for name in header}
    found: dict[str, dict[str, list[int]]] = {}
    separated: set[str] = set()
    others = []
    for number, name in enumerate(header):
        if number in (time, frames):
            continue
        parts = COLUMN.fullmatch(name)
        if parts is None or _is_of_quaternion(parts[1], known):
            others.append(name)
            continue
        found.setdefault(parts[1], {}).setdefault(parts[3].lower(), []).append(number)
        if parts[2]:
            separated.add(parts[1])
    points: dict[str, list[int]] = {}
    faults: dict[str, str] = {}
    for point, axes in found.items():
        missing = [axis for axis in "xyz" if axis not in axes]
        if missing and point not in separated:  # a word that ends in x, y or z
            others += [header[number] for numbers in axes.values() for number in numbers]
            continue
        points[point] = [axes.get(axis, [0])[0] for axis in "xyz"]
        fault = _fault(path, header, point, axes, others)
        if fault:
            faults[point] = fault
    if not set(points) - set(faults):
        raise DemonstrationError(
            next(iter(faults.values()), f"{path}:1: no column of a point; expected such as wrist_x, wrist_y, wrist_z")
        )
    unit_s = TIME_UNITS[UNITS[unit]] if unit in UNITS else None
    return _Columns(time, unit_s, frames, points, faults, others)


def _is_of_quaternion(point: str, header: set[str]) -> bool:
    """Whether the columns x, y and z of a name are those of a quaternion, which has a w, too."""
    return any(f"{point}{separator}w".casefold() in header for separator in ("", "_", ".", " ", "-"))


def _time_column(name: str) -> str | None:
    """Unit in the name of a column of times, "-" if it has none; None for a column of something else."""
    match = TIME.fullmatch(name)
    if match is None:
        return None
    unit = (match[1] or "").casefold()
    return "-" if not unit else unit if unit in UNITS else None


def _fault(path: Path, header: list[str], point: str, axes: dict[str, list[int]], others: list[str]) -> str:
    """Why the columns of a point cannot be used; "" if they can."""
    missing = ", ".join(f"{point}_{axis}" for axis in "xyz" if axis not in axes)
    if missing:
        nearby = f"; column {header.index(point) + 1} is called '{point:.80}'" if point in others else ""
        return f"{path}:1: {missing} is missing{nearby}; a point has three columns, or is not asked for (--point)"
    twice = next((numbers for numbers in axes.values() if len(numbers) > 1), None)
    if twice is not None:
        where = ", ".join(f"'{header[number]}' (column {number + 1})" for number in twice)
        return f"{path}:1: {point} is ambiguous: {where}; give the points different names"
    return ""


def _fast_table(path: Path, first_line: int, header: list[str]) -> _Table | None:
    """The numbers of a file that holds nothing but numbers; None if it has empty cells or text."""
    try:
        with path.open(encoding="utf-8-sig", newline=None) as file, warnings.catch_warnings():
            warnings.simplefilter("ignore", UserWarning)  # "input contained no data"
            separator = _separator(file.readline(LINE_LETTERS))
            for _ in range(first_line - 1):
                file.readline(LINE_LETTERS)
            values = np.loadtxt(file, delimiter=separator, ndmin=2, comments=None, quotechar='"')
    except (ValueError, UnicodeDecodeError):
        return None
    if values.shape[1:] != (len(header),):
        return None
    values[~np.isfinite(values)] = np.nan
    return _Table(values)


def _table(path: Path, rows: Iterator[tuple[int, list[str]]], header: list[str], columns: _Columns) -> _Table:
    """The numbers of all columns with a meaning; NaN where one is lost."""
    used = {number for numbers in columns.points.values() for number in numbers}
    used |= {number for number in (columns.time, columns.frames) if number is not None}
    numbers = array("d")
    faults: dict[int, str] = {}
    for line, row in rows:
        if len(row) != len(header):
            raise DemonstrationError(f"{path}:{line}: {len(row)} cells; the header names {len(header)} columns")
        for number, cell in enumerate(row):
            value = _number(cell) if number in used else math.nan
            if value is None:
                hint = "; write decimal points" if re.fullmatch(r"-?\d+,\d+", cell.strip()) else ""
                faults.setdefault(number, f"{path}:{line}: {header[number]}: '{cell.strip():.40}' is no number{hint}")
            numbers.append(math.nan if value is None else value)
        if columns.time is not None and math.isnan(numbers[columns.time - len(header)]):
            raise DemonstrationError(
                faults.get(columns.time, f"{path}:{line}: {header[columns.time]} is empty; every frame has a time")
            )
    return _Table(np.array(numbers).reshape(-1, len(header)), faults)


def _number(cell: str) -> float | None:
    """The number in a cell, NaN for a lost one; None for other text."""
    word = cell.strip()
    try:
        value = math.nan if word.lower() in LOST else float(word)
    except ValueError:
        return None
    return value if math.isfinite(value) else math.nan
