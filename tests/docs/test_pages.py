"""What the pages say of the code is true: links, tables, names of files and modules."""

import re

import pytest

from paramove.bus import topics
from paramove.supervision.interfaces import read_interface
from paramove.workspace import Workspace
from paramove.workspace.starting import TEMPLATE
from tests.docs.markdown import PAGES, ROOT, anchors, table

ARCHITECTURE = ROOT / "docs" / "explanation" / "architecture.md"
MODULES = [
    *(f"nodes.{path.stem}" for path in sorted((ROOT / "nodes").glob("*.py")) if path.stem != "__init__"),
    "sim.simulator",
    "sim.judge",
    "sim.dynamixel_emulator",
    "sim.shared_table",
]
INTERFACES = {module.partition(".")[2]: read_interface(module, Workspace.at(ROOT)) for module in MODULES}

STARTED = {
    path.relative_to(TEMPLATE).as_posix().removesuffix(".in").replace("NAME", "my_robot")
    for path in TEMPLATE.rglob("*.in")
}
"""Files that `paramove new my_robot` writes."""

pages = pytest.mark.parametrize("path", PAGES, ids=lambda path: str(path.relative_to(ROOT)))


@pages
def test_links_lead_to_files_and_headings(path):
    wrong = []
    for target in re.findall(r"\]\(([^)\s]+)\)", path.read_text(encoding="utf-8")):
        if "://" in target:
            continue
        name, _, anchor = target.partition("#")
        page = (path.parent / name).resolve() if name else path
        if not page.exists() or (anchor and anchor not in anchors(page)):
            wrong.append(target)
    assert wrong == []


def test_every_page_is_linked_from_the_index():
    index = (ROOT / "docs" / "index.md").read_text(encoding="utf-8")
    found = {str(path.relative_to(ROOT / "docs")) for path in PAGES[1:]} - {"index.md"}
    assert {name for name in found if f"({name})" not in index} == set()


@pages
def test_named_files_exist(path):
    """`folder/file.py` in backquotes lies in the workspace, or in the library with its `src/paramove/` left out; what
    lies in `runs/` is made by a run, and what `paramove new my_robot` writes by that."""
    names = set(re.findall(r"`((?:[\w.-]+/)+[\w.-]+\.(?:py|md|yaml|sh|proto))`", path.read_text(encoding="utf-8")))
    places = (ROOT, ROOT / "src" / "paramove")
    named = {name for name in names if not name.startswith("runs/")}
    missing = {name for name in named - STARTED if not any((root / name).exists() for root in places)}
    assert missing == set()


@pages
def test_named_modules_exist(path):
    names = set(re.findall(r"`(paramove(?:\.[a-z_0-9]+)+)`", path.read_text(encoding="utf-8")))
    wrong = set()
    for name in names - {"paramove.msgs"}:
        place = ROOT / "src" / name.replace(".", "/")
        if not place.is_dir() and not place.with_suffix(".py").is_file():
            wrong.add(name)
    assert wrong == set()


def who(topic, what):
    """Processes that say or hear a topic; the recorder, which hears nearly all, is left out."""
    names = [name for name, interface in INTERFACES.items() if name != "recorder"]
    return ", ".join(name for name in names if topic in getattr(INTERFACES[name], what)) or "–"


def test_topic_table_is_that_of_the_code():
    rows = [
        [
            topic.name,
            topic.type_name,
            f"{topic.rate_hz:g}" if topic.rate_hz else "event",
            topic.profile.value,
            topic.frame or "–",
            "yes" if topic.recorded else "–",
            who(topic, "publishes"),
            who(topic, "subscribes"),
        ]
        for topic in topics.TOPICS
    ]
    assert table(ARCHITECTURE, "topics") == rows


def test_process_table_names_every_process():
    text = ARCHITECTURE.read_text(encoding="utf-8")
    rows = re.findall(r"^\| (\w+) \| `((?:nodes|sim)/\w+\.py)` \|", text, re.M)
    assert {path.removesuffix(".py").replace("/", ".") for _, path in rows} == set(MODULES)


def test_safety_states_are_those_of_the_code():
    from paramove.safety.gate_io import State

    assert [row[0] for row in table(ARCHITECTURE, "safety states")] == [state.value for state in State]


def test_stages_have_the_states_that_are_told():
    """Each state of the table occurs in the stage's file, and the file goes to no other."""
    for _, path, states, _ in table(ARCHITECTURE, "stages"):
        source = (ROOT / "src" / "paramove" / path).read_text(encoding="utf-8")
        assert set(re.findall(r'self\.app\.go\("(\w+)"\)', source)) == set(states.split(", "))


def test_every_key_of_a_servo_arm_is_in_the_page_that_adds_one():
    from paramove.robots import description_file as file

    words = " ".join(row[0] for row in table(ROOT / "docs" / "how-to" / "add_an_arm.md", "robot keys"))
    parts = (file.RobotFile, file.JointPart, file.MotorPart, file.StreamParameters, file.BusParameters, file.ChainPart)
    keys = {key for part in parts for key in part.model_fields} - {"firmware", "arms"}
    text = (ROOT / "docs" / "how-to" / "add_an_arm.md").read_text(encoding="utf-8")
    assert {key for key in keys if key not in words} == set()
    gripper = {*file.GripperPart.model_fields, *file.ChainLinks.model_fields, *file.ChainSites.model_fields}
    assert {key for key in gripper if f"`{key}`" not in text and key != "base"} == set()
