"""Reports as one self-contained HTML file: the page, its sections, tables, pictures and videos."""

from __future__ import annotations

import base64
from collections.abc import Iterable, Sequence
from html import escape
from pathlib import Path

_STYLE = """
:root{--ink:#1d2530;--soft:#5b6470;--line:#e3e7ec;--good:#1f7a45;--bad:#b3372b;--warn:#a86a00;--card:#fff}
*{box-sizing:border-box}
body{margin:0;background:#f4f6f8;color:var(--ink);font:15px/1.5 system-ui,-apple-system,"Segoe UI",Roboto,sans-serif}
main{max-width:1120px;margin:0 auto;padding:0 20px 60px}
header{color:#fff;background:var(--good);padding:28px 0 26px;margin-bottom:24px}
header.bad{background:var(--bad)}
header>div{max-width:1120px;margin:0 auto;padding:0 20px}
h1{margin:0;font-size:28px;letter-spacing:-.01em} header p{margin:6px 0 0;opacity:.92}
h2{font-size:18px;margin:0 0 4px} .why{color:var(--soft);margin:0 0 12px;font-size:14px}
section{background:var(--card);border:1px solid var(--line);border-radius:10px;padding:18px 20px;margin:0 0 18px}
.tiles{display:grid;grid-template-columns:repeat(auto-fit,minmax(190px,1fr));gap:12px;margin-bottom:18px}
.tile{background:var(--card);border:1px solid var(--line);border-left:4px solid var(--good);border-radius:8px;
padding:10px 14px}
.tile.off{border-left-color:var(--warn)} .tile b{display:block;font-size:18px;font-weight:650}
.tile span{color:var(--soft);font-size:12.5px;display:block;line-height:1.35}
table{border-collapse:collapse;width:100%;font-size:13.5px} th{text-align:left;color:var(--soft);font-weight:600}
th,td{padding:5px 10px 5px 0;border-bottom:1px solid var(--line);vertical-align:top}
td.n,th.n{text-align:right;font-variant-numeric:tabular-nums} td.n,td:has(.dot){white-space:nowrap}
tr:last-child td{border-bottom:0}
.two{display:grid;grid-template-columns:1fr 1fr;gap:18px} .two section{margin:0}
.yes{color:var(--good);font-weight:600}.no{color:var(--bad);font-weight:600}.soft{color:var(--soft)}
.dot{display:inline-block;width:10px;height:10px;border-radius:50%;margin-right:7px}
video{width:100%;border-radius:8px;background:#000;display:block} svg{width:100%;height:auto;display:block}
.scroll{overflow-x:auto} summary{cursor:pointer;font-weight:600} pre{font-size:12.5px;overflow-x:auto}
@media(max-width:860px){.two{grid-template-columns:1fr}}
"""


def report_page(
    title: str, headline: str, about: str, parts: Iterable[str], *, good: bool = True, style: str = ""
) -> str:
    """A whole page.

    Args:
        title: Title of the browser's window.
        headline: The first line, on green if `good`, else on red.
        about: A line below it.
        parts: HTML already; empty ones are left out.
        style: CSS rules of this page alone.
    """
    head = (
        f"<!doctype html><html lang=en><meta charset=utf-8><title>{escape(title)}</title>"
        f"<meta name=viewport content='width=device-width,initial-scale=1'><style>{_STYLE}{style}</style>"
        f"<header{'' if good else ' class=bad'}><div><h1>{escape(headline)}</h1><p>{escape(about)}</p></div></header>"
    )
    return "\n".join((head, "<main>", *(part for part in parts if part), "</main></html>"))


def section(title: str, why: str, content: str) -> str:
    """A section of a page; `content` is HTML already."""
    return f"<section><h2>{escape(title)}</h2><p class=why>{escape(why)}</p><div class=scroll>{content}</div></section>"


def folded(title: str, content: str) -> str:
    """A section that is folded until the reader opens it; `content` is HTML already."""
    return f"<section><details><summary>{escape(title)}</summary>{content}</details></section>"


def table(heads: Sequence[str], rows: Iterable[Sequence[str]], numbers: Sequence[int] = ()) -> str:
    """Cells are HTML already; columns of `numbers` are right-aligned."""

    def cells(tag: str, row: Sequence[str]) -> str:
        return "".join(f"<{tag}{' class=n' if i in numbers else ''}>{cell}</{tag}>" for i, cell in enumerate(row))

    body = "".join(f"<tr>{cells('td', row)}</tr>" for row in rows)
    return f"<table><tr>{cells('th', [escape(head) for head in heads])}</tr>{body}</table>"


def image(data: bytes, about: str, kind: str = "png") -> str:
    """A picture (a file's bytes), with a description as its alternative text."""
    return f"<img alt='{escape(about)}' src='data:image/{kind};base64,{base64.b64encode(data).decode()}'>"


def film(video: Path | None) -> str:
    """A section with the embedded video; empty without one."""
    if video is None:
        return ""
    data = base64.b64encode(video.read_bytes()).decode()
    return f"<section><video controls loop muted src='data:video/mp4;base64,{data}'></video></section>"
