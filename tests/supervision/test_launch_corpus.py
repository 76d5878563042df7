"""Every wrong launch file of `tests/data/launch` is refused with the lines of `expected.txt`, all of them at once."""

import contextlib
import re
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from ruamel.yaml import YAML

from paramove.documents.positions import MAX_CHARACTERS, DocumentError
from paramove.supervision import application, wiring
from paramove.supervision.launch_file import load
from paramove.workspace import Workspace

ROOT = Path(__file__).parents[2]
CORPUS = ROOT / "tests" / "data" / "launch"
LAUNCH = ROOT / "launch"


def expected():
    """Name of the file -> lines of its error; each block of `expected.txt` is a name and indented lines."""
    blocks = (CORPUS / "expected.txt").read_text(encoding="utf-8").strip().split("\n\n")
    return {name: [line.strip() for line in lines] for name, *lines in (block.splitlines() for block in blocks)}


EXPECTED = expected()


def rejection(folder, name):
    with pytest.raises(DocumentError) as caught:
        application.check(load(Workspace(folder.parent, (folder.parent,)), name), Workspace.at(ROOT))
    return str(caught.value).replace(f"{folder}/", "").replace(str(ROOT), "WORKSPACE").splitlines()


def test_every_wrong_file_has_its_lines():
    assert set(EXPECTED) == {path.stem for path in CORPUS.glob("*.yaml")}


@pytest.mark.parametrize("name", EXPECTED)
def test_wrong_file_is_refused_with_all_that_is_wrong(name):
    assert rejection(CORPUS, name) == EXPECTED[name]


def test_what_a_terminal_would_obey_is_never_printed():
    for name in EXPECTED:
        assert all(line.isprintable() for line in EXPECTED[name])


GOOD = "nodes:\n  operator:\n    module: nodes.operator\n    optional_topics: ['*']\n"


@pytest.mark.parametrize(
    "content",
    [
        GOOD.encode(),
        GOOD.replace("\n", "\r\n").encode(),
        b"\xef\xbb\xbf" + GOOD.encode(),
        GOOD.rstrip("\n").encode(),
        ("\n\n# first\n---\n" + GOOD + "...\n").encode(),
    ],
    ids=["plain", "line ends of Windows", "byte order mark", "no last line end", "document marks"],
)
def test_what_editors_make_of_a_file_does_not_matter(launches, content):
    (launches / "good.yaml").write_bytes(content)
    assert list(
        application.check(load(Workspace(launches.parent, (launches.parent,)), "good"), Workspace.at(ROOT))
    ) == ["operator"]


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"\xff\xfe\x00n", "cannot be read as UTF-8 text"),
        (b"nodes: \x00", "bad.yaml:1:8: control character '\\x00'"),
        (b"#" * (MAX_CHARACTERS + 1), f"{MAX_CHARACTERS + 1} characters; at most {MAX_CHARACTERS} are read"),
        (b"#" * 2**20, "expected a launch file of at most 0.381 MB, found 1.0 MB"),
    ],
    ids=["no UTF-8", "zero byte", "too long", "1 MB"],
)
def test_bytes_that_are_no_launch_file(launches, content, message):
    (launches / "bad.yaml").write_bytes(content)
    assert message in rejection(launches, "bad")[0]


def test_a_folder_is_no_launch_file(launches):
    (launches / "bad.yaml").mkdir()
    with pytest.raises(DocumentError, match="there is no such launch file"):
        load(Workspace(launches.parent, (launches.parent,)), "bad")


def test_no_value_reaches_a_shell(workspace):
    """Parameters with a shell's letters come to the node as they are, and nothing is run."""
    marker = workspace.root / "marker"
    words = f"$(touch {marker}); touch {marker} & `touch {marker}` | touch {marker} > {marker}"
    workspace.write(
        f"nodes: {{a: {{module: nodes.actor, ends_run: true, parameters: {{lasts_s: 0, say: '{words}'}}}}}}"
    )
    outcome, folder, _ = workspace.run()
    assert outcome.code == 0
    assert YAML(typ="safe").load(folder.config("a"))["parameters"]["say"] == words
    assert not marker.exists()


REAL = {path: path.read_text(encoding="utf-8") for path in [*LAUNCH.glob("*.yaml"), *LAUNCH.glob("overlays/*.yaml")]}
BITS = ["\n", "  ", ": ", "- ", "{", "}", "[", "]", "'", '"', "#", "&a ", "*a", "!x ", "|", ">", "?", "%", "\t", "null"]
BITS += [
    "true",
    "no",
    "3",
    "-1",
    ".nan",
    "1e999",
    "*",
    "\x00",
    "\x1b",
    "é",
    "\ud800",
    "nodes",
    "module",
    "after",
    "simulator",
]
MUTATIONS = st.lists(
    st.tuples(
        st.integers(0, 10**6),
        st.integers(0, 40),
        st.one_of(st.sampled_from(BITS), st.text(max_size=6), st.integers(0, 10**6)),
    ),
    min_size=1,
    max_size=5,
)


def mutated(text, mutations):
    """Replaces some letters by others, or by a line of the text."""
    lines = text.splitlines(keepends=True)
    for at, cut, new in mutations:
        at %= len(text) + 1
        text = text[:at] + (lines[new % len(lines)] if isinstance(new, int) else new) + text[at + cut :]
    return text


@pytest.mark.parametrize("path", REAL, ids=lambda path: path.stem)
@settings(max_examples=60, deadline=None, derandomize=True)
@given(mutations=MUTATIONS)
def test_damaged_launch_file_raises_nothing_but_its_error(path, mutations, tmp_path_factory):
    folder = tmp_path_factory.mktemp("damaged") / "launch"
    (folder / "overlays").mkdir(parents=True)
    for real, text in REAL.items():
        text = mutated(text, mutations) if real == path else text
        (folder / real.relative_to(LAUNCH)).write_text(text, encoding="utf-8", errors="surrogatepass")
    overlays = [path.stem] if path.parent.name == "overlays" else ["sim"]
    try:
        launch = load(
            Workspace(folder.parent, (folder.parent,)),
            "rule_learning",
            overlays,
            ["camera.width=640"],
            seed=1,
            headless=True,
        )
        interfaces = wiring.read_interfaces(launch, Workspace.at(ROOT))
        list(wiring.topic_findings(launch, interfaces))
    except DocumentError as error:
        lines = str(error).splitlines()
        assert all(re.match(r"(/|--set|--seed|and \d+ more)", line) and line.isprintable() for line in lines)


@settings(max_examples=30, deadline=None, derandomize=True)
@given(setting=st.text(max_size=30) | st.from_regex(r"\A[a-z]+\.[a-z]+=.{0,10}\Z"))
def test_any_setting_is_taken_or_refused(setting):
    with contextlib.suppress(DocumentError):  # any other exception fails the test
        load(Workspace.at(ROOT), "rule_learning", ["sim"], [setting])
