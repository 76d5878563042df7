"""Settings of Sphinx for `make docs`: pages in Markdown, with sidebar, search and formulas that need no network."""

from __future__ import annotations

import re
from typing import Any

from docutils import nodes
from docutils.utils.math.latex2mathml import tex2mathml

project = "paramove"
author = "the paramove authors"
extensions = ["myst_parser"]
root_doc = "docs/index"
MORE = ["README", "CHANGELOG", "CONTRIBUTING", "msgs/README", "src/*/README", "robot_description/*/README"]
"""Pages outside of docs/."""
include_patterns = ["docs/**.md", *(f"{page}.md" for page in MORE)]
myst_enable_extensions = ["dollarmath"]
myst_heading_anchors = 4
html_theme = "furo"
html_title = "paramove"
html_math_renderer = "mathml"
html_show_sourcelink = False
html_copy_source = False
suppress_warnings = ["misc.highlighting_failure"]  # output of programs in code blocks


def _sidebar(text: str) -> str:
    """The index with a hidden table of contents for each of its lists, which makes the sidebar."""
    for caption, entries in re.findall(r"^\*\*(.+?)\*\*\n\n((?:- .*\n|  .*\n)+)", text, re.MULTILINE):
        pages = re.findall(r"^- \[[^\]]*\]\(([^)#]+)\.md\)", entries, re.MULTILINE)
        text += _contents(caption, pages)
    return text + _contents("Project", [f"../{page}" for page in MORE])


def _contents(caption: str, pages: list[str]) -> str:
    glob = ":glob:\n" if any("*" in page for page in pages) else ""
    return f"\n```{{toctree}}\n:hidden:\n:caption: {caption}\n{glob}\n" + "\n".join(pages) + "\n```\n"


def _with_api_links(text: str) -> str:
    """The page of public names with links to the pages of their docstrings instead of to their source."""
    package = ""
    lines = text.splitlines(keepends=True)
    for number, line in enumerate(lines):
        package = line.split()[1] if line.startswith("## paramove") else package
        goal = f"../../api/{package.replace('.', '/')}.html"
        lines[number] = re.sub(r"^\| \[`(\w+)`\]\([^)]*\)", rf'| <a href="{goal}#\1"><code>\1</code></a>', line)
    return "".join(lines)


def _read(_app: Any, page: str, source: list[str]) -> None:
    if page == root_doc:
        source[0] = _sidebar(source[0])
    elif page == "docs/reference/api":
        source[0] = _with_api_links(source[0])


def _formula(block: bool) -> Any:
    def visit(writer: Any, node: Any) -> None:
        writer.body.append(tex2mathml(node.astext(), as_block=block))
        raise nodes.SkipNode

    return visit


def setup(app: Any) -> None:
    """Sphinx calls this."""
    app.connect("source-read", _read)
    app.add_html_math_renderer("mathml", (_formula(False), None), (_formula(True), None))
