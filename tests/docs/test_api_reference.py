"""Public names have docstrings and are on the page of the API; the pages can be built, and what is wrong is found."""

import dataclasses
import importlib
import importlib.util
import inspect
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


def test_pages_can_be_built(tmp_path):
    count = BUILD.build(tmp_path / "html", pages_only=True)
    assert count == len(list((tmp_path / "html").rglob("*.html"))) - 1 - len(folders(tmp_path / "html"))
    index = (tmp_path / "html" / "docs" / "index.html").read_text()
    assert 'href="reference/api.html"' in index
    api = (tmp_path / "html" / "docs" / "reference" / "api.html").read_text()
    assert 'href="../../api/paramove/hmm.html#LeftRightHMM"' in api
    assert "<table>" in api


def folders(out):
    """Pages that list a folder of the repository which is linked to."""
    return [page for page in out.rglob("index.html") if page.parent not in (out, out / "docs")]


def test_a_dead_link_is_found(tmp_path):
    (tmp_path / "a.html").write_text("<a href='b.html#there'>1</a><a href='b.html#not'>2</a><a href='c.html'>3</a>")
    (tmp_path / "b.html").write_text("<h1 id='there'>b</h1>")
    assert BUILD.dead_links(tmp_path) == ["a.html: b.html#not", "a.html: c.html"]


def test_nobody_elses_folder_is_made_anew(tmp_path):
    (tmp_path / "mine.txt").touch()
    with pytest.raises(BUILD.BuildError, match="choose another --out"):
        BUILD.build(tmp_path, pages_only=True)
    assert (tmp_path / "mine.txt").exists()


def test_description_of_models_is_that_of_the_code():
    rows = table(ROOT / "docs" / "reference" / "model_files.md", "description")
    named = [name.strip("` ") for row in rows for name in row[0].split(",")]
    assert named == [field.name for field in dataclasses.fields(MovementDescription)]
