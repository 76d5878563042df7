"""Reads what is to be tested out of Markdown: blocks of commands with their markers, headings, links, tables."""

import re
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).parent.parent.parent
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))]
CONNECT_YOUR_ARM = ROOT / "docs" / "tutorials" / "connect_your_arm.md"
TEACH_RULES = ROOT / "docs" / "tutorials" / "teach_rules_to_your_arm.md"

MARKERS = ("check only", "needs a running demo", "in the example", "on an emulated arm")


@dataclass(frozen=True)
class Block:
    """A fenced block of commands. `marker` is what the comment before it begins with, "" without one."""

    path: Path
    line: int
    marker: str
    commands: tuple[str, ...]
    remark: str = ""

    def __str__(self):
        return f"{self.path.relative_to(ROOT)}:{self.line}"


def blocks(path):
    """Every ```bash and ```console block of a page."""
    lines = path.read_text(encoding="utf-8").splitlines()
    found, number = [], 0
    while number < len(lines):
        fence = re.fullmatch(r"\s*```(\w*)", lines[number])
        if fence is None:
            number += 1
            continue
        end = next(at for at in range(number + 1, len(lines)) if lines[at].strip() == "```")
        if fence[1] in ("bash", "console", "sh", "shell"):
            inside = [line.strip() for line in lines[number + 1 : end]]
            marker, remark = _marker(lines[number - 1])
            found.append(Block(path, number + 1, marker, _commands(inside, fence[1] == "console"), remark))
        number = end + 1
    return found


def _marker(line):
    """`<!-- check only: why -->` -> `check only`, `why`."""
    comment = re.fullmatch(r"\s*<!-- ([a-z ]+?)(?:: (.*))? -->\s*", line)
    return (comment[1], comment[2] or "") if comment else ("", "")


def files(path):
    """Files that a page shows in full, after a comment `<!-- file: PATH -->`: path in the workspace -> content."""
    shown = re.findall(r"^<!-- file: (\S+) -->\n```\w+\n(.*?)^```$", path.read_text(encoding="utf-8"), re.M | re.S)
    return dict(shown)


def _commands(lines, console):
    """Commands, with continued lines joined; of a console session only the lines after `$ `."""
    if console:
        lines = [line.removeprefix("$ ") for line in lines if line.startswith("$ ")]
    joined = "\n".join(lines).replace("\\\n", " ")
    without_remarks = (re.sub(r"(^|\s)#.*$", "", line).strip() for line in joined.splitlines())
    return tuple(line for line in without_remarks if line)


def anchors(path):
    """Anchors of a page's headings, as GitHub makes them."""
    text = re.sub(r"^```.*?^```", "", path.read_text(encoding="utf-8"), flags=re.M | re.S)
    titles = re.findall(r"^#+ (.*)$", text, re.M)
    return {re.sub(r"[^\w\- ]", "", title.lower()).replace(" ", "-") for title in titles}


def table(path, name):
    """Rows of the table after `<!-- table: name -->`, without head and rule, cells without backquotes."""
    after = path.read_text(encoding="utf-8").split(f"<!-- table: {name} -->\n", 1)[1].lstrip()
    rows = []
    for line in after.splitlines():
        if not line.startswith("|"):
            break
        rows.append([cell.strip().strip("`") for cell in line.strip("|").split("|")])
    return rows[2:]
