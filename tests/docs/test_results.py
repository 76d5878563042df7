"""The measured numbers of the pages are those of the files in docs/results/, which named commands make."""

import shlex
import sys

import pytest

from tests.docs.test_api_reference import program
from tests.docs.test_commands import CHECKS

RESULTS = program("results")
FILES = RESULTS.results()


def file_with(**numbers):
    return {"run": {"made": {"date": "2026-01-01"}, "numbers": numbers}}


def test_pages_say_what_the_files_say():
    stale = [str(page.relative_to(RESULTS.ROOT)) for page in RESULTS.stale_pages(FILES)]
    assert stale == [], "`python docs/results.py --write` brings them up to date"


def test_every_file_is_made_by_known_commands_and_shown_on_a_page():
    text = "".join(page.read_text(encoding="utf-8") for page in RESULTS.PAGES)
    assert set(FILES) <= set(RESULTS.MEASUREMENTS)
    assert [name for name in FILES if f"<!--={name}." not in text] == []


@pytest.mark.parametrize("name", FILES)
def test_a_file_tells_where_its_numbers_come_from(name):
    made = FILES[name]["made"]
    assert made["timing"] == RESULTS.MEASUREMENTS[name].timing
    assert all(made[key] for key in ("commands", "commit", "date", "machine"))


@pytest.mark.parametrize(
    "command", [one for measurement in RESULTS.MEASUREMENTS.values() for one in measurement.commands[:1]]
)
def test_commands_exist(command):
    words = shlex.split(command.format(out="OUT"))
    CHECKS[words[0]](words)


@pytest.mark.parametrize(
    ("shown", "fresh"),
    [
        ("5.1<!--=run.median-->", "4.9<!--=run.median-->"),
        ("| 5.13<!--=run.median--> |", "| 4.94<!--=run.median--> |"),
        ("−7.0<!--=run.offset-->", "−1.3<!--=run.offset-->"),
        ("(9<!--=run.good--> of", "(24<!--=run.good--> of"),
        ("no<!--=run.verdict-->", "yes<!--=run.verdict-->"),
        ("4.9<!--=run.median-->", "4.9<!--=run.median-->"),
    ],
)
def test_a_value_takes_the_form_that_stands_in_the_page(shown, fresh):
    files = file_with(median=4.94, offset=-1.26, good=24, verdict="yes")
    assert RESULTS.refreshed(f"It is {shown}.", files) == f"It is {fresh}."


def test_rows_of_a_table_are_made_anew():
    marker = "<!--=run.rows | {name} | {error[0]:.1f} | {share:.1%} |-->\n| a | b | c |\n|---|--:|--:|\n"
    rows = [{"name": "5 %", "error": [1.26], "share": 0.5}, {"name": "y", "error": [None], "share": 0.121}]
    fresh = RESULTS.refreshed(f"{marker}| old | 1 | 2 |\n\nAfter", file_with(rows=rows))
    assert fresh == f"{marker}| 5 % | 1.3 | 50.0 % |\n| y | – | 12.1 % |\n\nAfter"
    fresh = RESULTS.refreshed(marker.replace("{name}", "{key}"), file_with(rows={"5 %": rows[0]}))
    assert fresh.endswith("| 5 % | 1.3 | 50.0 % |\n")


def test_lines_of_a_block_are_made_anew():
    page = "<!--=run.lines-->\n```text\nold\n```\nAfter"
    assert RESULTS.refreshed(page, file_with(lines=["new", "lines"])) == page.replace("old", "new\nlines")


@pytest.mark.parametrize("path", ["run.middle", "walk.median", "run.median.0"])
def test_a_path_that_leads_nowhere_is_named(path):
    with pytest.raises(RESULTS.PathError, match=path):
        RESULTS.refreshed(f"1<!--={path}-->", file_with(median=1.0))


def test_a_result_is_made_by_its_commands(tmp_path, monkeypatch):
    """The numbers come from what the command wrote and printed; a command that misses goals is none that failed."""
    code = 'import pathlib; pathlib.Path("{out}/n").write_text("7"); print(8); raise SystemExit(3)'
    both = RESULTS.Measurement(
        (shlex.join([sys.executable, "-c", code]),),
        lambda out: {"sum": int((out / "n").read_text()) + int((out / "0.txt").read_text())},
        "no time",
    )
    monkeypatch.setattr(RESULTS, "MEASUREMENTS", {"sum": both})
    monkeypatch.setattr(RESULTS, "FOLDER", tmp_path)
    RESULTS.run("sum")
    assert RESULTS.results()["sum"]["numbers"] == {"sum": 15}


def test_a_command_that_fails_leaves_the_file_as_it_was(tmp_path, monkeypatch):
    failing = RESULTS.Measurement(
        (shlex.join([sys.executable, "-c", "raise SystemExit('no camera')"]),), dict, "no time"
    )
    monkeypatch.setattr(RESULTS, "MEASUREMENTS", {"sum": failing})
    monkeypatch.setattr(RESULTS, "FOLDER", tmp_path)
    with pytest.raises(SystemExit, match="no camera"):
        RESULTS.run("sum")
    assert list(tmp_path.iterdir()) == []
