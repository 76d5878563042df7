"""Builds the documentation as HTML: the pages of docs/, and the API from docstrings. Warnings and dead links end it.

Usage: python docs/build.py [--out build/docs] [--pages-only]

The pages lie in the output as in the repository, so that their links work; files of the repository that they link to
are copied or, where they are Markdown, made pages too. The API lies in api/. It needs pdoc, the extra `docs`.
"""

from __future__ import annotations

import argparse
import html
import importlib
import re
import shutil
import sys
import typing
import warnings
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote

from api_page import PACKAGES
from markdown_it import MarkdownIt

ROOT = Path(__file__).parent.parent
MARK = ".built-from-docs"
"""File in the output, which may be made anew only where it lies."""
STYLE = """
body{margin:0;color:#1d2530;font:16px/1.55 system-ui,-apple-system,"Segoe UI",Roboto,sans-serif;background:#fff}
nav{background:#f4f6f8;border-bottom:1px solid #e3e7ec;padding:10px 24px} nav a{margin-right:18px}
main{max-width:60em;margin:0 auto;padding:12px 24px 80px}
a{color:#1f5fbf;text-decoration:none} a:hover{text-decoration:underline}
h1,h2,h3{line-height:1.25} h2{margin-top:2em;border-bottom:1px solid #e3e7ec;padding-bottom:.2em}
pre{background:#f4f6f8;padding:12px 14px;border-radius:6px;overflow-x:auto;font-size:13.5px;line-height:1.45}
code{font-family:ui-monospace,"DejaVu Sans Mono",monospace;font-size:.9em} pre code{font-size:1em}
table{border-collapse:collapse;display:block;overflow-x:auto}
th,td{border:1px solid #e3e7ec;padding:5px 10px;text-align:left;vertical-align:top}
th{background:#f4f6f8} img{max-width:100%}
@media(prefers-color-scheme:dark){body{background:#14181d;color:#d7dde4} nav,pre,th{background:#1d232a} a{color:#7db0ff}
nav,h2,th,td{border-color:#2c343d}}
"""


class BuildError(RuntimeError):
    """A page links to nothing, or the API cannot be read."""


def anchor_of(title: str) -> str:
    """The anchor of a heading, as GitHub makes it."""
    return re.sub(r"[^\w\- ]", "", title.lower()).replace(" ", "-")


def linked_pages(first: Path) -> list[Path]:
    """Markdown files that can be reached from a page by links."""
    found, waiting = [first], [first]
    while waiting:
        page = waiting.pop()
        for target in targets(page.read_text(encoding="utf-8")):
            file = (page.parent / target).resolve()
            if file.suffix == ".md" and file.is_file() and file not in found:
                found.append(file)
                waiting.append(file)
    return found


def targets(text: str) -> list[str]:
    """Files that a page in Markdown links to, without anchors."""
    found = (target.partition("#")[0] for target in re.findall(r"\]\(([^)\s]+)\)", text))
    return [target for target in found if target and "://" not in target and not target.startswith("mailto:")]


def page_as_html(page: Path, out: Path) -> None:
    """Write a page; links to Markdown lead to HTML, and other files that it links to are copied."""
    markdown = MarkdownIt("commonmark", {"html": True}).enable(["table", "strikethrough"])
    tokens = markdown.parse(page.read_text(encoding="utf-8"))
    title = page.stem
    for number, token in enumerate(tokens):
        if token.type == "heading_open":
            words = "".join(child.content for child in tokens[number + 1].children or ())
            token.attrSet("id", anchor_of(words))
            title = words if token.tag == "h1" else title
        children = token.children or []
        for place, child in enumerate(children):
            if child.type in ("link_open", "image"):
                key = "href" if child.type == "link_open" else "src"
                target = str(child.attrGet(key))
                named = children[place + 1].content if child.type == "link_open" else ""
                child.attrSet(key, _in_api(target, named, page) or _carried(target, page, out))
    goal = out / page.relative_to(ROOT).with_suffix(".html")
    goal.parent.mkdir(parents=True, exist_ok=True)
    up = "../" * (len(goal.relative_to(out).parts) - 1)
    goal.write_text(
        f"<!doctype html><html lang=en><meta charset=utf-8><title>{html.escape(title)} - paramove</title>"
        f"<meta name=viewport content='width=device-width,initial-scale=1'><style>{STYLE}</style>"
        f"<nav><a href='{up}README.html'>paramove</a><a href='{up}docs/index.html'>All pages</a>"
        f"<a href='{up}api/index.html'>API</a></nav>"
        f"<main>{markdown.renderer.render(tokens, markdown.options, {})}</main></html>\n",
        encoding="utf-8",
    )


def _in_api(target: str, name: str, page: Path) -> str:
    """Link to a public name's place in the API, of a link to the file that defines it; else ""."""
    file = (page.parent / target).resolve()
    package = ".".join(file.parent.relative_to(ROOT / "src").parts) if file.is_relative_to(ROOT / "src") else ""
    if package not in PACKAGES or name not in importlib.import_module(package).__all__:
        return ""
    up = "../" * len(page.relative_to(ROOT).parent.parts)
    return f"{up}api/{package.replace('.', '/')}.html#{name}"


def _carried(target: str, page: Path, out: Path) -> str:
    """The same link for HTML; what it leads to is brought along."""
    name, hash_mark, anchor = target.partition("#")
    if not name or "://" in target or target.startswith("mailto:"):
        return target
    file = (page.parent / unquote(name)).resolve()
    if file.suffix == ".md":
        return str(Path(name).with_suffix(".html")) + hash_mark + anchor
    if file.is_file() and file.is_relative_to(ROOT):
        goal = out / file.relative_to(ROOT)
        goal.parent.mkdir(parents=True, exist_ok=True)
        shutil.copyfile(file, goal)
    elif file.is_dir() and file.is_relative_to(ROOT):
        goal = out / file.relative_to(ROOT) / "index.html"
        goal.parent.mkdir(parents=True, exist_ok=True)
        names = "".join(f"<li>{html.escape(one.name)}</li>" for one in sorted(file.iterdir()) if one.name[0] != "_")
        goal.write_text(f"<!doctype html><meta charset=utf-8><title>{file.name}</title><ul>{names}</ul>\n")
    return target


def build_api(out: Path) -> None:
    """Write the API of PACKAGES into api/. Raises BuildError for what pdoc warns of."""
    try:
        import pdoc
        import pdoc.render
    except ModuleNotFoundError as error:
        raise BuildError("the API needs pdoc: pip install 'paramove[docs]'") from error
    for package in PACKAGES:
        _resolve_named_tuples(importlib.import_module(package))
    pdoc.render.configure(docformat="google", show_source=False, search=True)
    with warnings.catch_warnings():
        warnings.simplefilter("error", UserWarning)
        try:
            pdoc.pdoc(*PACKAGES, output_directory=out / "api")
        except UserWarning as warning:
            raise BuildError(str(warning)) from warning


def _resolve_named_tuples(package: typing.Any) -> None:
    """Named tuples keep annotations as text without their module, where pdoc cannot look the names up."""
    for name in package.__all__:
        kind = getattr(package, name)
        if isinstance(kind, type) and issubclass(kind, tuple) and hasattr(kind, "_fields"):
            kind.__new__.__annotations__ = typing.get_type_hints(kind)


class _Links(HTMLParser):
    """Collects what a page links to and where it can be linked to."""

    def __init__(self) -> None:
        super().__init__()
        self.targets: list[str] = []
        self.anchors: set[str] = set()

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        for key, value in attrs:
            if value and key in ("href", "src"):
                self.targets.append(value)
            elif value and key in ("id", "name"):
                self.anchors.add(value)


def dead_links(out: Path) -> list[str]:
    """Links of the output that lead to no file or no anchor, each with its page."""
    pages: dict[Path, _Links] = {}
    for file in sorted(out.rglob("*.html")):
        pages[file] = _Links()
        pages[file].feed(file.read_text(encoding="utf-8"))
    dead = []
    for file, links in pages.items():
        for target in links.targets:
            if re.match(r"[a-z]+:", target) or target.startswith("//"):
                continue
            name, _, anchor = target.partition("#")
            goal = (file.parent / unquote(name)).resolve() if name else file
            goal = goal / "index.html" if goal.is_dir() else goal
            known = pages.get(goal)
            if not goal.is_file() or (anchor and known is not None and unquote(anchor) not in known.anchors):
                dead.append(f"{file.relative_to(out)}: {target}")
    return dead


def build(out: Path, pages_only: bool = False) -> int:
    """Write everything. Returns the number of pages. Raises BuildError for warnings and dead links."""
    out = out.resolve()
    if out.exists() and not (out / MARK).is_file():
        raise BuildError(f"{out} exists and was not made by this program: choose another --out")
    shutil.rmtree(out, ignore_errors=True)
    out.mkdir(parents=True)
    (out / MARK).touch()
    pages = linked_pages(ROOT / "README.md")
    for page in pages:
        page_as_html(page, out)
    (out / "index.html").write_text("<!doctype html><meta http-equiv=refresh content='0;url=docs/index.html'>\n")
    if not pages_only:
        build_api(out)
    dead = [link for link in dead_links(out) if not (pages_only and "api/" in link)]
    if dead:
        raise BuildError("links that lead nowhere:\n" + "\n".join(dead))
    return len(pages)


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(description="Build the documentation as HTML.")
    parser.add_argument("--out", type=Path, default=ROOT / "build" / "docs", help="folder, which is made anew")
    parser.add_argument("--pages-only", action="store_true", help="without the API")
    options = parser.parse_args()
    try:
        count = build(options.out, options.pages_only)
    except BuildError as error:
        sys.exit(f"documentation: {error}")
    api = "" if options.pages_only else f" and the API of {len(PACKAGES)} packages"
    sys.stdout.write(f"{count} pages{api}: {options.out / 'index.html'}\n")


if __name__ == "__main__":
    main()
