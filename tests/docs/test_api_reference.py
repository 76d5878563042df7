"""Public names have docstrings and are on the page of the API; the pages can be built, and what is wrong is found."""

import dataclasses
import importlib
import importlib.util
import inspect
import re
import subprocess
import sys

import pytest

from paramove.phmm import MovementDescription
from tests.docs.markdown import ROOT, table


def program(name):
    """A program of docs/, which is no package."""
    spec = importlib.util.spec_from_file_location(f"docs_{name}", ROOT / "docs" / f"{name}.py")
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(ROOT / "docs")  # where a program finds its neighbours
        spec.loader.exec_module(module)
    return module


API, BUILD = program("api_page"), program("build")
PUBLIC = [(package, name) for package in API.PACKAGES for name in API.public_names(importlib.import_module(package))]


def has_docstring(thing, name):
    text = inspect.getdoc(thing) or ""
    return bool(text) and not text.startswith(f"{name}(")  # what a dataclass or named tuple makes up by itself


def without_docstring(package, name):
    """The public name, or its members, that say nothing of themselves."""
    thing = getattr(importlib.import_module(package), name)
    if not callable(thing):
        return  # a constant: its value is on the page
    if getattr(thing, "__module__", "").startswith("paramove") and not has_docstring(thing, name):
        yield f"{package}.{name}"
    if inspect.isclass(thing):
        for member, value in vars(thing).items():
            value = getattr(value, "__func__", value)
            public = not member.startswith("_") and (inspect.isfunction(value) or isinstance(value, property))
            if public and not has_docstring(getattr(thing, member), member):
                yield f"{package}.{name}.{member}"


def test_public_names_have_docstrings():
    assert [without for package, name in PUBLIC for without in without_docstring(package, name)] == []


def test_both_programs_speak_of_the_same_packages():
    assert set(API.PACKAGES) == set(BUILD.PACKAGES)


def test_page_is_that_of_the_code():
    """To renew it: `python docs/api_page.py`."""
    code = "import sys; sys.path.insert(0, 'docs'); import api_page; sys.stdout.write(api_page.api_page())"
    # In a process of its own: other tests put other things into the place of public names.
    page = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=True).stdout
    assert (ROOT / "docs" / "reference" / "api.md").read_text(encoding="utf-8") == page


@pytest.fixture(scope="module")
def html(tmp_path_factory):
    out = tmp_path_factory.mktemp("docs") / "html"
    subprocess.run([sys.executable, "docs/build.py", "--pages-only", "--out", str(out)], cwd=ROOT, check=True)
    return out


def test_pages_have_a_sidebar_a_search_and_links_to_the_api(html):
    index = (html / "docs" / "index.html").read_text()
    linked = set(re.findall(r'class="reference internal" href="([^"#]+)"', index))
    written = {page.relative_to(html / "docs").as_posix() for page in (html / "docs").rglob("*.html")}
    assert written - {"index.html"} <= linked
    assert (html / "searchindex.js").is_file()
    assert 'href="../../api/paramove/hmm.html#LeftRightHMM"' in (html / "docs" / "reference" / "api.html").read_text()


def test_formulas_are_drawn_without_a_network(html):
    page = (html / "docs" / "explanation" / "models.html").read_text()
    assert page.count("<math ") >= 5
    assert not re.search(r'(src|href)="https?://[^"]*(mathjax|katex|cdn)', page)


@pytest.mark.parametrize("link", ["models.md#no-such-heading", "no_such_page.md"])
def test_a_dead_link_is_found(tmp_path, link):
    for name in ("docs", "docs/explanation"):
        (tmp_path / name).mkdir()
    (tmp_path / "docs" / "index.md").write_text(
        f"# Index\n\n**A**\n\n- [a](explanation/models.md)\n\n[b](explanation/{link})\n"
    )
    (tmp_path / "docs" / "explanation" / "models.md").write_text("# Models\n")
    sphinx = ["-m", "sphinx", "-q", "-W", "-b", "html", "-c", str(ROOT / "docs"), str(tmp_path), str(tmp_path / "out")]
    answer = subprocess.run([sys.executable, *sphinx], capture_output=True, text=True, check=False)
    assert answer.returncode != 0
    assert link.partition("#")[2] in answer.stderr


def test_nobody_elses_folder_is_made_anew(tmp_path):
    (tmp_path / "mine.txt").touch()
    with pytest.raises(BUILD.BuildError, match="choose another --out"):
        BUILD.build(tmp_path, pages_only=True)
    assert (tmp_path / "mine.txt").exists()


def test_description_of_models_is_that_of_the_code():
    rows = table(ROOT / "docs" / "reference" / "model_files.md", "description")
    named = [name.strip("` ") for row in rows for name in row[0].split(",")]
    assert named == [field.name for field in dataclasses.fields(MovementDescription)]
