"""Builds the documentation as HTML: the pages with Sphinx, and the API from docstrings. Warnings and dead links end it.

Usage: python docs/build.py [--out build/docs] [--pages-only]

The pages lie in the output as in the repository. The API lies in api/. It needs the extra `docs`.
"""

from __future__ import annotations

import argparse
import importlib
import shutil
import sys
import typing
import warnings
from pathlib import Path

from api_page import PACKAGES

ROOT = Path(__file__).parent.parent
MARK = ".built-from-docs"
"""File in the output, which may be made anew only where it lies."""


class BuildError(RuntimeError):
    """A page links to nothing, or the API cannot be read."""


def build_pages(out: Path) -> None:
    """Write the pages. Raises BuildError for what Sphinx warns of, such as links that lead nowhere."""
    try:
        from sphinx.cmd.build import build_main
    except ModuleNotFoundError as error:
        raise BuildError("the pages need Sphinx: pip install 'paramove[docs]'") from error
    settings = ["-c", str(ROOT / "docs"), "-d", str(out / ".doctrees")]
    if build_main(["-q", "-W", "--keep-going", "-b", "html", *settings, str(ROOT), str(out)]):
        raise BuildError("Sphinx complains of the pages, see above")
    shutil.rmtree(out / ".doctrees")


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


def build(out: Path, pages_only: bool = False) -> None:
    """Write everything. Raises BuildError for warnings and dead links."""
    out = out.resolve()
    if out.exists() and not (out / MARK).is_file():
        raise BuildError(f"{out} exists and was not made by this program: choose another --out")
    shutil.rmtree(out, ignore_errors=True)
    out.mkdir(parents=True)
    (out / MARK).touch()
    build_pages(out)
    (out / "index.html").write_text("<!doctype html><meta http-equiv=refresh content='0;url=docs/index.html'>\n")
    if not pages_only:
        build_api(out)


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(description="Build the documentation as HTML.")
    parser.add_argument("--out", type=Path, default=ROOT / "build" / "docs", help="folder, which is made anew")
    parser.add_argument("--pages-only", action="store_true", help="without the API")
    options = parser.parse_args()
    try:
        build(options.out, options.pages_only)
    except BuildError as error:
        sys.exit(f"documentation: {error}")
    sys.stdout.write(f"{options.out / 'index.html'}\n")


if __name__ == "__main__":
    main()
