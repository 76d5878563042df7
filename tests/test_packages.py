"""Which package may import which, and only by what it offers; docs/explanation/architecture.md has the table."""

import ast
import importlib
from functools import cache
from pathlib import Path

from tests.docs.markdown import table

ROOT = Path(__file__).parent.parent
PAGE = ROOT / "docs" / "explanation" / "architecture.md"
LIBRARY, EMULATOR = ROOT / "src" / "paramove", ROOT / "src" / "dynamixel_emulator"
PACKAGES = (LIBRARY, EMULATOR)
WORKSPACE = ("nodes", "sim", "studies", "benchmarks")
ALONE = ROOT / "benchmarks" / "foreign_clients"  # programs of others, each with a Python environment of its own


def part(module):
    """The row of the table to which a module belongs."""
    words = module.split(".")
    return words[1] if words[0] == "paramove" else words[0]


@cache
def imports(path):
    """Modules, each with the names that are taken from it."""
    return list(_imports(path))


def _imports(path):
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            yield from ((alias.name, []) for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and node.module:
            yield node.module, [alias.name for alias in node.names]


def sources():
    """Every file of library and workspace with the module that it is."""
    for folder, base in (*((one, one.parent) for one in PACKAGES), *((ROOT / name, ROOT) for name in WORKSPACE)):
        for path in sorted(folder.rglob("*.py")):
            if not path.is_relative_to(ALONE) and path.parent != LIBRARY / "msgs":
                words = path.relative_to(base).with_suffix("").parts
                yield path, ".".join(words[:-1] if words[-1] == "__init__" else words)


def test_packages_import_as_the_table_says():
    found = {row[0]: set() for row in table(PAGE, "packages")}
    for path, module in sources():
        for source, names in imports(path):
            assert source.split(".")[0] != "tests", path
            if source.split(".")[0] in ("paramove", EMULATOR.name, *WORKSPACE) and module != "paramove":
                for name in [name for name in names if name != "__version__"] if source == "paramove" else [""]:
                    found[part(module)] |= {name or part(source)} - {part(module)}
    assert found == {row[0]: {word for word in row[2].split(", ") if word != "–"} for row in table(PAGE, "packages")}


def test_each_row_imports_rows_above_it():
    above = set()
    for package, _, imported in table(PAGE, "packages"):
        assert {word for word in imported.split(", ") if word != "–"} <= above, package
        above.add(package)


@cache
def offering(module):
    """The package with an interface that a module of the library lies in: the innermost one."""
    words = module.split(".")
    for length in range(len(words), 0, -1):
        if (LIBRARY.parent.joinpath(*words[:length]) / "__init__.pyi").is_file():
            return ".".join(words[:length])
    return None


def test_nobody_imports_past_an_interface():
    past = []
    for path, module in sources():
        for source, _ in imports(path):
            package = offering(source) if source.split(".")[0] in (LIBRARY.name, EMULATOR.name) else None
            if package not in (None, source) and not f"{module}.".startswith(f"{package}."):
                past.append(f"{path.relative_to(ROOT)}: {source}, which {package} does not offer")
    assert past == []


def test_what_is_offered_exists():
    for stub in LIBRARY.parent.rglob("__init__.pyi"):
        package = importlib.import_module(".".join(stub.parent.relative_to(LIBRARY.parent).parts))
        assert [name for name in package.__all__ if not hasattr(package, name)] == []
