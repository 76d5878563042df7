"""What really happens in the simulated world is known to the simulator and the judge, and to nobody else."""

import stat
from pathlib import Path

import psutil
import pytest
from ruamel.yaml import YAML

from paramove.bus import topics
from paramove.bus.bus import Bus
from paramove.bus.settings import BusSettings
from paramove.devices import opened_files
from tests.supervision.conftest import until
from tests.system.conftest import WATCHING

ONLY = "only the simulator and evaluators are given"
KNOWING = {"simulator", "judge"}
RUN = ("rule_learning", "--with", "sim", "--with", WATCHING, "--headless", "--seed", "5")


def processes_of(folder):
    """Module -> process, of all nodes of the run in `folder`."""
    found = {}
    for process in psutil.process_iter(["cmdline"]):
        command = process.info["cmdline"] or []
        if "--config" in command and str(folder) in command[-1]:
            found[Path(command[-1]).stem] = process
    return found


def test_no_ordinary_node_can_learn_of_the_truth(launcher):
    """Neither configuration, command line, environment nor open files of a node lead to the truth's sockets."""
    process = launcher.start(*RUN, "--set", "simulator.max_duration_s=600")
    judge = launcher.latest / "logs" / "judge.log"
    until(lambda: judge.exists() and "ready" in judge.read_text(), "the judge is ready")
    runtime = Path(launcher.environment["XDG_RUNTIME_DIR"]) / "paramove"
    (hidden,) = runtime.glob("truth-*")
    assert stat.S_IMODE(hidden.stat().st_mode) == 0o300
    told = YAML(typ="safe").load((launcher.latest / "nodes" / "judge.yaml").read_text())
    truth_folder = Path(told["bus"]["truth_folder"])
    assert truth_folder.parent == hidden
    bus_folder = runtime / "test"
    sockets = {"truth.layout", "truth.state"}
    until(lambda: sockets <= {path.name for path in truth_folder.iterdir()}, "the simulator says the truth")

    assert stat.S_IMODE(truth_folder.stat().st_mode) == 0o700
    assert stat.S_IMODE(bus_folder.stat().st_mode) == 0o700
    assert [path.name for path in bus_folder.rglob("*") if "truth" in path.name] == []

    configs = {path.stem: path.read_text() for path in (launcher.latest / "nodes").glob("*.yaml")}
    assert {name for name, text in configs.items() if str(truth_folder) in text or "truth" in text} == KNOWING
    settings = {name: YAML(typ="safe").load(text) for name, text in configs.items()}
    assert {name for name, its in settings.items() if "seed" in its["parameters"]} == {"simulator"}
    assert {name for name, its in settings.items() if "truth_folder" in its["bus"]} == KNOWING

    nodes = processes_of(launcher.latest.resolve())
    assert set(nodes) > KNOWING
    assert {"camera", "colour_tracker", "arm_driver", "operator"} <= set(nodes)
    for name, node in nodes.items():
        if name in KNOWING:
            continue
        assert str(truth_folder) not in " ".join(node.cmdline()), name
        assert not any(truth_folder.name in value for value in node.environ().values()), name
        assert not any(
            truth_folder.name in (held.laddr or "") + (held.raddr or "") for held in node.net_connections("unix")
        ), name
        links = opened_files(node.pid).values()
        assert links, name
        assert not any(str(truth_folder) in link for link in links), name
    process.terminate()
    process.communicate(timeout=60)
    assert not hidden.exists()


def test_a_bus_without_the_folder_refuses_topics_of_truth(tmp_path):
    truth = [topic for topic in topics.TOPICS if topic.truth]
    assert truth
    settings = BusSettings(folder=tmp_path / "bus")
    for topic in truth:
        with pytest.raises(ValueError, match=ONLY):
            Bus("node", settings, subscribes=(topic,))
        with pytest.raises(ValueError, match=ONLY):
            Bus("node", settings, publishes=(topic,))


def test_a_remap_does_not_lead_to_the_truth(tmp_path):
    settings = BusSettings(folder=tmp_path / "bus", remaps={"gestures": "truth/state"})
    assert settings.name_of(topics.GESTURES) == "truth/state"
    assert settings.folder_of(topics.GESTURES) == tmp_path / "bus"


def test_no_node_names_a_topic_of_truth():
    root = Path(__file__).parents[2]
    for path in (root / "nodes").glob("*.py"):
        text = path.read_text(encoding="utf-8")
        assert "TRUTH" not in text, path.name
        assert "truth/" not in text, path.name
