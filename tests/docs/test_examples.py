"""The files that pages show in full work: written into a workspace of their own, with the commands that follow them."""

import shutil
import subprocess

import pytest

from tests.docs.markdown import PAGES, ROOT, blocks, files
from tests.docs.test_commands import ENVIRONMENT

MARKER = "in the example"
EXAMPLES = [path for path in PAGES if files(path) or any(block.marker == MARKER for block in blocks(path))]
LONG = ("train_and_recognize", "from_motion_capture")
"""Pages whose commands train for minutes."""


@pytest.fixture(
    scope="module",
    params=[pytest.param(path, marks=pytest.mark.long if path.stem in LONG else (), id=path.stem) for path in EXAMPLES],
)
def example(request, tmp_path_factory):
    """A page, and a workspace with its files beside those of the project."""
    root = tmp_path_factory.mktemp("workspace")
    for name in ("launch", "nodes", "sim", "robot_description"):
        shutil.copytree(ROOT / name, root / name, ignore=shutil.ignore_patterns("__pycache__"))
    for name, content in files(request.param).items():
        assert not (ROOT / name).exists(), f"{name} is a file of the project already"
        (root / name).parent.mkdir(parents=True, exist_ok=True)
        (root / name).write_text(content, encoding="utf-8")
    for folder in (root / "tests", root / "tests" / "nodes"):
        if folder.is_dir():
            (folder / "__init__.py").touch()
    return request.param, root


@pytest.mark.slow
def test_commands_of_the_example_run(example):
    page, root = example
    marked = [block for block in blocks(page) if block.marker == MARKER]
    assert marked, f"{page} shows files, but no command that uses them"
    for block in marked:
        answer = subprocess.run(
            ["bash", "-uo", "pipefail", "-c", "set -e\n" + "\n".join(block.commands)],
            cwd=root,
            env=ENVIRONMENT,
            capture_output=True,
            text=True,
            timeout=600,
            check=False,
        )
        assert answer.returncode == int(block.remark or 0), f"{block}\n{answer.stdout}{answer.stderr}"
        if block.remark:
            page_text = page.read_text(encoding="utf-8")
            assert f"```text\n{answer.stderr}```" in page_text, f"{block} is answered by\n{answer.stderr}"


def test_python_of_the_example_is_formatted_and_sound(example):
    page, root = example
    python = [str(root / name) for name in files(page) if name.endswith(".py")]
    if python:
        ruff = [ENVIRONMENT["PATH"].partition(":")[0] + "/ruff"]
        for command in (["check", "--ignore", "T201"], ["format", "--check"]):  # users print
            answer = subprocess.run(
                [*ruff, *command, "--config", str(ROOT / "pyproject.toml"), *python],
                capture_output=True,
                text=True,
                check=False,
            )
            assert answer.returncode == 0, answer.stdout


def test_node_of_the_example_is_short(example):
    page, root = example
    for name in files(page):
        if name.startswith("nodes/"):
            assert len((root / name).read_text().splitlines()) < 60
