"""The repository keeps its promises: layout, sizes, names, topics, and what must not be in any file."""

import ast
import re
import subprocess
from pathlib import Path

import pytest

from paramove.bus import topics
from paramove.supervision.interfaces import read_interface

ROOT = Path(__file__).parent.parent
LIBRARY = ROOT / "src" / "paramove"
GENERATED = LIBRARY / "msgs"


def tracked():
    """Files of the repository: those that git knows and those that it would take; all but build products elsewhere."""
    listing = subprocess.run(
        ["git", "ls-files", "--cached", "--others", "--exclude-standard"], cwd=ROOT, capture_output=True, text=True
    )
    if listing.returncode == 0:
        return [ROOT / line for line in listing.stdout.splitlines() if (ROOT / line).is_file()]
    unwanted = {".venv", ".git", "build", "runs", "__pycache__"}
    return [path for path in ROOT.rglob("*") if path.is_file() and not unwanted.intersection(path.parts)]


FILES = tracked()
LIBRARY_FILES = [path for path in FILES if path.suffix == ".py" and path.is_relative_to(LIBRARY)]
WRITTEN = [path for path in LIBRARY_FILES if not path.is_relative_to(GENERATED)]
NODES = [path for path in FILES if path.parent == ROOT / "nodes" and path.suffix == ".py" and path.stem != "__init__"]
PROCESSES = [
    *NODES,
    *(ROOT / "sim" / f"{name}.py" for name in ("simulator", "judge") if (ROOT / "sim" / f"{name}.py").exists()),
]
PYTHON = [path for path in FILES if path.suffix == ".py" and not path.is_relative_to(GENERATED)]


def name(path):
    return str(path.relative_to(ROOT))


def lines(path):
    return path.read_text(encoding="utf-8").splitlines()


LAYOUT = "README.md CHANGELOG.md CONTRIBUTING.md LICENSE Makefile pyproject.toml requirements.lock .ci/run"
LAYOUT += " src/paramove nodes msgs launch sim tests docker robot_description"


@pytest.mark.parametrize("path", LAYOUT.split())
def test_layout(path):
    assert (ROOT / path).exists()


@pytest.mark.parametrize("path", NODES, ids=name)
def test_node_is_plumbing(path):
    assert len(lines(path)) < 60


@pytest.mark.parametrize("path", PROCESSES, ids=name)
def test_node_says_what_it_hears_and_says(path):
    """Every topic of HEARS and SAYS is in the table, and the header tells of it."""
    module = f"{path.parent.name}.{path.stem}"
    interface = read_interface(module, ROOT)
    header = ast.get_docstring(ast.parse(path.read_text(encoding="utf-8"))) or ""
    known = {topic.name for topic in topics.TOPICS}
    for topic in (*interface.hears, *interface.says):
        assert topic.name in known
    if len(interface.hears) < 10:  # one that hears nearly everything says so in words
        missing = [topic.name for topic in (*interface.hears, *interface.says) if topic.name not in header]
        assert missing == [], f"{name(path)}: the header does not tell of {missing}"


@pytest.mark.parametrize("path", WRITTEN, ids=name)
def test_library_file_says_what_it_is(path):
    text = path.read_text(encoding="utf-8")
    assert not text.strip() or ast.get_docstring(ast.parse(text)), "a module begins with a docstring"


def test_files_are_named_by_what_they_compute():
    vague = re.compile(r"(utils?|common|helpers?|managers?|misc)$")
    assert [name(path) for path in PYTHON if vague.search(path.stem)] == []


BANNED_CALLS = {"time.time", "eval", "exec", "yaml.load", "pickle.load", "pickle.loads", "os.system", "os.popen"}


@pytest.mark.parametrize("path", PYTHON, ids=name)
def test_nothing_banned(path):
    """No wall clock, no code from data, no shell, no silent except, no pickle; tests do not sleep."""
    banned = BANNED_CALLS | ({"time.sleep"} if path.is_relative_to(ROOT / "tests") else set())
    if path.is_relative_to(LIBRARY) or path in NODES:
        banned.add("print")
    found = []
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Call):
            called = ast.unparse(node.func)
            found += [f"{node.lineno}: {called}"] if called in banned else []
            found += [f"{node.lineno}: shell=True" for word in node.keywords if ast.unparse(word) == "shell=True"]
        elif isinstance(node, ast.ExceptHandler) and node.type is None:
            found.append(f"{node.lineno}: bare except")
        elif isinstance(node, ast.Import) and any(alias.name == "pickle" for alias in node.names):
            found.append(f"{node.lineno}: import pickle")
    assert found == []


def test_only_sim_knows_of_the_simulation():
    """The library and the nodes import nothing of the workspace; the library imports no node."""
    found = []
    for path in [*LIBRARY_FILES, *NODES]:
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            modules = [alias.name for alias in node.names] if isinstance(node, ast.Import) else []
            modules += [node.module or ""] if isinstance(node, ast.ImportFrom) else []
            found += [
                f"{name(path)}: {module}" for module in modules if module.split(".")[0] in ("sim", "nodes", "tests")
            ]
    assert found == []


def text_files():
    for path in FILES:
        try:
            yield path, path.read_text(encoding="utf-8")
        except UnicodeDecodeError:
            continue


def test_no_file_names_a_package_registry():
    host = re.compile(
        r"pypi\.|pythonhosted|index[-_]url\s*[=:]|artifactory|registry\.npmjs|(?:deb|security)\.debian\.org", re.I
    )
    found = {
        name(path): match.group()
        for path, text in text_files()
        if path != Path(__file__) and (match := host.search(text)) is not None
    }
    assert found == {}


def test_no_secrets():
    secret = re.compile(r"-----BEGIN [A-Z ]*PRIVATE KEY|AKIA[0-9A-Z]{16}|gh[pousr]_[A-Za-z0-9]{36}")
    assert [name(path) for path, text in text_files() if secret.search(text)] == []


def test_files_are_small():
    assert {name(path): path.stat().st_size for path in FILES if path.stat().st_size > 2_000_000} == {}


def test_lock_pins_every_dependency_with_hashes():
    lock = "".join((ROOT / name).read_text() for name in ("requirements.lock", "requirements-peers.lock"))
    pinned = {match.lower() for match in re.findall(r"^([A-Za-z0-9_.-]+)==\S+", lock, re.M)}
    project = (ROOT / "pyproject.toml").read_text()
    wanted = set(re.findall(r'^    "([A-Za-z0-9_.-]+)[><=]', project, re.M)) | {"hatchling"}
    assert {package.lower().replace(".", "-") for package in wanted} - pinned == set()
    blocks = re.split(r"^(?=[A-Za-z0-9_.-]+==)", lock, flags=re.M)[1:]
    assert [block.split()[0] for block in blocks if "--hash=sha256:" not in block] == []


def links(path):
    for target in re.findall(r"\]\(([^)\s]+)\)", path.read_text(encoding="utf-8")):
        if "://" not in target and not target.startswith(("#", "mailto:")):
            yield target.partition("#")[0]


@pytest.mark.parametrize("path", [path for path in FILES if path.suffix == ".md"], ids=name)
def test_links_inside_the_repository_lead_somewhere(path):
    assert [target for target in links(path) if not (path.parent / target).exists()] == []


def test_tests_mirror_the_library():
    parts = {path.name for path in LIBRARY.iterdir() if (path / "__init__.py").exists() and path.name != "msgs"}
    with_code = {part for part in parts if len(list((LIBRARY / part).glob("*.py"))) > 1}
    without = {part for part in with_code if not list((ROOT / "tests" / part).glob("test_*.py"))}
    assert without <= {"cli"}, "every part of the library has tests of its own"
