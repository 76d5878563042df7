"""The repository keeps its promises: layout, sizes, names, topics, and what must not be in any file."""

import ast
import re
import subprocess
from functools import cache
from pathlib import Path

from paramove.bus import topics
from paramove.supervision.interfaces import read_interface
from paramove.workspace import Workspace

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


@cache
def parsed(path):
    return ast.parse(path.read_text(encoding="utf-8"))


LAYOUT = "README.md CHANGELOG.md CONTRIBUTING.md LICENSE Makefile pyproject.toml requirements.lock .ci/run"
LAYOUT += " src/paramove nodes msgs launch sim tests docker robot_description"


def test_layout():
    assert [path for path in LAYOUT.split() if not (ROOT / path).exists()] == []


def test_nodes_are_plumbing():
    assert {name(path): len(lines(path)) for path in NODES if len(lines(path)) >= 60} == {}


def test_headers_of_nodes_name_their_topics():
    """Every topic of SUBSCRIBES and PUBLISHES is in the table, and the header tells of it."""
    known, missing = {topic.name for topic in topics.TOPICS}, []
    for path in PROCESSES:
        interface = read_interface(f"{path.parent.name}.{path.stem}", Workspace.at(ROOT))
        header = ast.get_docstring(parsed(path)) or ""
        named = [topic.name for topic in (*interface.subscribes, *interface.publishes)]
        assert set(named) <= known
        if len(interface.subscribes) < 10:  # one that hears nearly everything says so in words
            missing += [f"{name(path)}: {topic}" for topic in named if topic not in header]
    assert missing == []


def test_modules_of_the_library_begin_with_a_docstring():
    assert [name(path) for path in WRITTEN if path.stat().st_size and not ast.get_docstring(parsed(path))] == []


def test_no_source_is_ignored():
    """What git ignores is missing in clones, and in the wheel."""
    sources = {path for suffix in ("*.py", "*.pyi") for path in (ROOT / "src").rglob(suffix)}
    assert sorted(map(name, sources - set(FILES))) == []


def test_files_are_named_by_what_they_compute():
    vague = re.compile(r"(utils?|common|helpers?|managers?|misc)$")
    assert [name(path) for path in PYTHON if vague.search(path.stem)] == []


BANNED_CALLS = {"time.time", "eval", "exec", "yaml.load", "pickle.load", "pickle.loads", "os.system", "os.popen"}


def test_nothing_banned():
    """No wall clock, no code from data, no shell, no silent except, no pickle; tests do not sleep."""
    found = []
    for path in PYTHON:
        banned = BANNED_CALLS | ({"time.sleep"} if path.is_relative_to(ROOT / "tests") else set())
        if path.is_relative_to(LIBRARY) or path in NODES:
            banned.add("print")
        found += [f"{name(path)}:{line}: {what}" for line, what in banned_in(parsed(path), banned)]
    assert found == []


def banned_in(tree, banned):
    """Lines with what must not be there."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Call):
            called = ast.unparse(node.func) if isinstance(node.func, ast.Name | ast.Attribute) else ""
            if called in banned:
                yield node.lineno, called
            yield from ((node.lineno, "shell=True") for word in node.keywords if ast.unparse(word) == "shell=True")
        elif isinstance(node, ast.ExceptHandler) and node.type is None:
            yield node.lineno, "bare except"
        elif isinstance(node, ast.Import) and any(alias.name == "pickle" for alias in node.names):
            yield node.lineno, "import pickle"


def test_what_is_banned_is_found():
    text = "import pickle\nos.system('x')\nrun(['x'], shell=True)\ntry:\n    x\nexcept:\n    y\n"
    assert [line for line, _ in banned_in(ast.parse(text), BANNED_CALLS)] == [1, 2, 3, 6]


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
    names = ("requirements.lock", "requirements-peers.lock", "requirements-ros2.lock")
    lock = "".join((ROOT / name).read_text() for name in names)
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


def test_findings_have_their_form():
    """Each script states what was expected and seen, pins its packages, and runs in its own folder without paramove."""
    findings = [path for path in FILES if path.parent == ROOT / "findings"]
    assert findings
    for path in findings:
        text = path.read_text(encoding="utf-8")
        code = "\n".join(line for line in text.splitlines() if not line.startswith("#"))
        assert path.suffix == ".sh", name(path)
        assert re.search(r"^# Expected: ", text, re.MULTILINE), name(path)
        assert re.search(r"^# Seen: ", text, re.MULTILINE), name(path)
        assert "set -euo pipefail" in code, name(path)
        assert "mktemp -d" in code, name(path)
        assert re.search(r"(pip|npm|cargo|go)\S* .*(==|@)\S*\d", code), f"{name(path)} pins no version"
        assert "paramove" not in code, name(path)


def test_links_inside_the_repository_lead_somewhere():
    pages = [path for path in FILES if path.suffix == ".md"]
    dead = [f"{name(path)}: {to}" for path in pages for to in links(path) if not (path.parent / to).exists()]
    assert dead == []


def test_tests_mirror_the_library():
    parts = {path.name for path in LIBRARY.iterdir() if (path / "__init__.py").exists() and path.name != "msgs"}
    with_code = {part for part in parts if len(list((LIBRARY / part).glob("*.py"))) > 1}
    without = {part for part in with_code if not list((ROOT / "tests" / part).glob("test_*.py"))}
    assert without <= {"cli"}, "every part of the library has tests of its own"
