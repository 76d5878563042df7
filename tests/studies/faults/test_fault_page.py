"""The page of faults: it can be read, its ids are unique, and every test that it names exists."""

import ast
from pathlib import Path

import pytest

from studies.faults.fault_page import PAGE, FaultPageError, read_page

ROOT = Path(__file__).parents[3]
HEAD = "## P. Processes\n\n| id | fault | what happens | test |\n|---|---|---|---|\n"


def functions_of(path: Path) -> set[str]:
    """Names of the test functions, also `Class::test`."""
    found = set()
    for node in ast.parse(path.read_text(encoding="utf-8")).body:
        if isinstance(node, ast.FunctionDef):
            found.add(node.name)
        elif isinstance(node, ast.ClassDef):
            found |= {f"{node.name}::{one.name}" for one in node.body if isinstance(one, ast.FunctionDef)}
            found.add(node.name)
    return found


def test_every_row_of_the_page_names_tests_that_exist() -> None:
    rows = read_page(ROOT / PAGE)  # raises where an id comes twice
    assert len(rows) >= 10
    absent = []
    for row in rows:
        for test in row.tests:
            path, _, name = test.partition("::")
            file = ROOT / path
            if not file.is_file() or name.partition("[")[0] not in functions_of(file):
                absent.append(f"{row.id}: {test}")
    assert absent == []


def test_rows_are_read_with_all_their_tests(tmp_path: Path) -> None:
    page = tmp_path / "faults.md"
    page.write_text(
        HEAD
        + "| P1 | killed | comes back \\| or not | `tests/a.py::test_a`, `tests/b.py::test_b[x]` |\n\n"
        + "## G. Goals, numbers\n\n| G2 | q = [] | refused | `tests/c.py::test_c` |\n"
    )
    first, second = read_page(page)
    assert (first.id, first.section, first.fault) == ("P1", "P. Processes", "killed")
    assert first.answer == "comes back | or not"
    assert first.tests == ("tests/a.py::test_a", "tests/b.py::test_b[x]")
    assert (second.id, second.section) == ("G2", "G. Goals, numbers")


@pytest.mark.parametrize(
    ("rows", "words"),
    [
        (
            "| P1 | a | b | `t.py::x` |\n| P1 | c | d | `t.py::y` |\n",
            "6: id P1 comes twice; give the row a free number",
        ),
        ("| P1 | a | b |\n", "5: 3 cells; a row has id, fault, what happens, test"),
        ("| P1 | a |  | `t.py::x` |\n", "a row has id, fault, what happens, test"),
        ("| P1 | a | b | by hand |\n", "P1 names no test"),
        ("| G1 | a | b | `t.py::x` |\n", "G1 stands in section 'P. Processes'"),
    ],
)
def test_a_row_that_is_wrong_is_refused_with_its_line(tmp_path: Path, rows: str, words: str) -> None:
    page = tmp_path / "faults.md"
    page.write_text(HEAD + rows)
    with pytest.raises(FaultPageError, match=r"faults\.md:\d+: ") as raised:
        read_page(page)
    assert words in str(raised.value)
