"""The graph of a launch file: who is in it, and that text, Mermaid and SVG show all of it."""

import functools
import os
import re
import threading
from pathlib import Path
from xml.etree import ElementTree

import pytest
from typer.testing import CliRunner

from paramove.bus import topics
from paramove.bus.bus import Bus
from paramove.bus.settings import BusSettings
from paramove.cli.main import build
from paramove.supervision import application
from paramove.supervision.graph import as_mermaid, as_text, graph_of, running_graph
from paramove.supervision.graph_svg import BOX_PX, LETTER_PX, as_svg
from paramove.supervision.launch_file import load
from paramove.workspace import Workspace

ROOT = Path(__file__).parents[2]


@functools.cache
def graph(overlay):
    launch = load(Workspace.at(ROOT), "rule_learning", [overlay])
    return graph_of(launch, application.check(launch, Workspace.at(ROOT)))


@pytest.fixture(scope="module")
def sim():
    return graph("sim")


def edge(found, topic):
    (one,) = [edge for edge in found.edges if edge.topic == topic]
    return one


def test_edges_are_those_of_the_nodes(sim):
    assert edge(sim, "camera/image").publishers == ("camera",)
    assert set(edge(sim, "camera/image").subscribers) == {"colour_tracker", "recorder"}
    assert edge(sim, "camera/image").label == "camera/image 15 Hz"
    assert edge(sim, "gestures").label == "gestures"
    assert sim.collectors == {"recorder"}
    assert sim.to_all == {"clock"}


def test_data_flows_onwards(sim):
    order = list(sim.nodes)
    assert order[0] == "simulator"
    assert order[-1] == "recorder"
    for chain in (["camera", "colour_tracker", "recognizer"], ["arm_driver", "operator"]):
        assert sorted(chain, key=order.index) == chain


def test_a_topic_without_publisher_is_marked(sim):
    assert {found.topic for found in sim.unpublished} == {"action/estimate", "human/arm_pose"}
    assert "human/arm_pose            <- no publisher (!)" in as_text(sim)
    assert "Subscribed, no publisher:" in as_text(sim)
    assert "human/arm_pose: no publisher" in as_mermaid(sim)
    assert "no publisher</text>" in as_svg(sim)


def test_a_topic_of_persons_comes_from_outside(sim):
    assert {found.topic for found in sim.from_outside} == {"operator/arm", "operator/stop", "operator/estop"}
    assert "operator/stop             <- from outside" in as_text(sim)
    assert "operator/stop: from outside" in as_mermaid(sim)
    assert "from outside</text>" in as_svg(sim)


def test_text_fits_a_terminal_and_tells_every_topic(sim):
    text = as_text(sim)
    assert max(map(len, text.splitlines())) <= 100
    for found in sim.edges:
        assert found.topic in text
    assert "recorder  (nodes.recorder)\n  subscribes  22 of 32 topics" in text


MERMAID = re.compile(
    r'n_\w+(?:\["[^"\[\]]+"\]|\(\["[^"]+"\]\)(?::::unpublished)?| (?:-->|-\.->)(?:\|"[^"|]+"\|)? n_\w+|:::\w+)'
    r"|classDef \w+ [\w:,# -]+"
)


@pytest.mark.parametrize("overlay", ["sim", "real"])
def test_mermaid_has_the_grammar_of_a_flowchart(overlay):
    first, *rest = as_mermaid(graph(overlay)).splitlines()
    assert first == "flowchart LR"
    for line in rest:
        assert MERMAID.fullmatch(line.strip()), line
    named = {line.split("[")[0].strip() for line in rest if '["' in line}
    used = set(re.findall(r"\bn_\w+", "\n".join(line for line in rest if "--" in line or "-." in line)))
    assert used <= {name.rstrip("(") for name in named}


@pytest.mark.parametrize("overlay", ["sim", "real"])
def test_svg_shows_every_topic_and_no_text_covers_another(overlay):
    found = graph(overlay)
    root = ElementTree.fromstring(as_svg(found))
    space = "{http://www.w3.org/2000/svg}"
    texts = [text for text in root.iter(f"{space}text") if text.get("class") == "topic"]
    written = ["".join(text.itertext()) for text in texts]
    drawn = [edge for edge in found.edges if edge.topic not in found.to_all and edge.subscribers]
    assert {edge.label for edge in drawn} <= set(written)
    boxes = [
        (float(text.get("x")), float(text.get("y")), LETTER_PX * len(label))
        for text, label in zip(texts, written, strict=True)
    ]
    for one, (x, y, wide) in enumerate(boxes):
        for other_x, other_y, other_wide in boxes[one + 1 :]:
            assert abs(x - other_x) >= (wide + other_wide) / 2 or abs(y - other_y) >= 11
    frame = [float(value) for value in root.get("viewBox").split()]
    assert all(wide / 2 <= x <= frame[2] - wide / 2 and BOX_PX <= y <= frame[3] for x, y, wide in boxes)


def invoke(*arguments):
    return CliRunner().invoke(build("graph"), ["graph", *arguments])


def test_command_writes_each_format(tmp_path, monkeypatch):
    monkeypatch.chdir(ROOT)
    assert "rule_learning with sim: 10 nodes" in invoke("rule_learning").stdout
    assert invoke("rule_learning", "--with", "real", "--format", "mermaid").stdout.startswith("flowchart LR")
    picture = tmp_path / "graph.svg"
    assert invoke("rule_learning", "--format", "svg", "--output", str(picture)).exit_code == 0
    assert picture.read_text().startswith("<svg ")
    answer = invoke("rule_learning", "--output", str(tmp_path / "no" / "graph.txt"))
    assert answer.exit_code == 77
    assert "name another file with --output" in answer.stderr


@pytest.mark.parametrize(
    ("arguments", "code", "message"),
    [
        (["rule_lerning"], 66, "did you mean 'rule_learning'?"),
        (["rule_learning", "--with", "real_time"], 78, "nodes.simulator.module is missing"),
        (["--live"], 1, "nothing is running in this domain"),
    ],
)
def test_command_tells_what_is_wrong(arguments, code, message, monkeypatch, tmp_path):
    monkeypatch.chdir(ROOT)
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    answer = invoke(*arguments)
    assert answer.exit_code == code
    assert message in answer.stderr


@pytest.mark.usefixtures("workspace")
def test_running_nodes_are_drawn_with_measured_rates():
    folder = Path(os.environ["XDG_RUNTIME_DIR"]) / "paramove" / "default"
    made, ready = [], threading.Event()

    def speak():
        with Bus("recognizer", BusSettings(folder=folder), (topics.OBJECTS_TRACKED,), (topics.GESTURES,)) as bus:
            made.append(bus)
            bus.ready("recognising")
            ready.set()
            for _ in bus.events(tick=True):
                continue

    thread = threading.Thread(target=speak)
    thread.start()
    try:
        assert ready.wait(60)
        found = running_graph(folder, "default", 0.2)
        text = invoke("--live").stdout
    finally:
        made[0].stop()
        thread.join(60)
    assert found.nodes == {"recognizer": "ready"}
    assert [edge.topic for edge in found.unpublished] == ["objects/tracked"]
    assert "domain default: 1 nodes, 2 topics" in text
