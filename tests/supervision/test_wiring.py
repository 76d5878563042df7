"""Nodes of a launch file fit together, or the error says where they do not."""

from pathlib import Path

import pytest

from paramove.bus import topics
from paramove.documents.positions import DocumentError
from paramove.supervision import application, launch_file, parameters
from paramove.supervision.interfaces import InterfaceError, read_interface
from paramove.supervision.wiring import clock_publisher
from paramove.workspace import Workspace

ROOT = Path(__file__).parents[2]
NODES = [
    f"{folder}.{path.stem}"
    for folder in ("nodes", "sim")
    for path in sorted((ROOT / folder).glob("*.py"))
    if "\nSUBSCRIBES = " in path.read_text()
]


def checked(workspace, text):
    workspace.write(text)
    launch = workspace.load()
    return application.check(launch, workspace.folders)


def test_topics_with_a_speaker_pass(workspace):
    interfaces = checked(workspace, "nodes: {robot: {module: nodes.actor}, ear: {module: nodes.listener}}")
    assert interfaces["ear"].subscribes == (topics.SPEECH,)
    assert clock_publisher(interfaces) is None


def test_one_cause_in_the_parameters_of_several_nodes_is_one_finding(workspace):
    ear = "{module: nodes.listener, parameters: {loudness: x}}"
    with pytest.raises(DocumentError) as error:
        checked(workspace, f"nodes:\n  robot: {{module: nodes.actor}}\n  left: {ear}\n  right: {ear}")
    assert len(list(error.value)) == 1
    assert "'left' and 'right': loudness: " in str(error.value)


@pytest.mark.parametrize(
    ("text", "place", "message"),
    [
        (
            "nodes:\n  ear: {module: nodes.listener}",
            "2:3",
            "'ear' subscribes to speech, which no node of this launch file publishes",
        ),
        ("nodes:\n  a: {module: nodes.actor}\n  b: {module: nodes.actor}", "3:3", "'b' and 'a' both publish speech"),
        ("nodes:\n  a: {module: nodes.acter}", "2:7", "there is no module 'nodes.acter'"),
        ("after_run: nodes.jugde\nnodes:\n  a: {module: nodes.actor}", "1:1", "there is no module 'nodes.jugde'"),
        ("nodes:\n  w: {module: nodes.world}", "2:3", "uses truth/state but has no 'truth: true'"),
        ("bus: {clock: simulated}\nnodes:\n  a: {module: nodes.actor}", "1:7", "the clock is simulated, but no node"),
        (
            "bus: {lockstep: true}\nnodes:\n  w: {module: nodes.world, truth: true}",
            "1:7",
            "lockstep needs 'clock: simulated'",
        ),
        (
            "nodes:\n  a: {module: nodes.actor}\n  ear: {module: nodes.listener, parameters: {loudnes: 2}}",
            "3:46",
            "'ear': there is no parameter 'loudnes'; did you mean 'loudness'?",
        ),
        (
            "nodes:\n  a: {module: nodes.actor}\n  ear: {module: nodes.listener, remaps: {speach: x}}",
            "3:42",
            "'ear' does not use 'speach'; did you mean 'speech'?",
        ),
    ],
)
def test_misfit_is_told_with_its_place(workspace, text, place, message):
    with pytest.raises(DocumentError) as caught:
        checked(workspace, text)
    assert f"test.yaml:{place}: " in str(caught.value)
    assert message in str(caught.value)


def test_missing_module_names_what_there_is(workspace):
    with pytest.raises(InterfaceError, match=r"nodes has: actor, listener, silent_actor, world"):
        read_interface("nodes.nothing", workspace.folders)


def test_remap_makes_two_speakers_two_topics(workspace):
    checked(workspace, "nodes:\n  a: {module: nodes.actor}\n  b: {module: nodes.actor, remaps: {speech: speech/b}}")


@pytest.mark.parametrize("topic", ["speech", "'sp*'", "'*'"])
def test_optional_topic_needs_no_speaker(workspace, topic):
    checked(workspace, f"nodes:\n  ear: {{module: nodes.listener, optional_topics: [{topic}]}}")


def test_a_pattern_of_optional_topics_that_fits_none_is_an_error(workspace):
    with pytest.raises(DocumentError, match=r"'\*/nothing'"):
        checked(workspace, "nodes:\n  ear: {module: nodes.listener, optional_topics: [speech, '*/nothing']}")


@pytest.mark.parametrize(
    ("source", "subscribes"),
    [
        ("_TWO = (topics.SPEECH, topics.CLOCK)\nSUBSCRIBES = _TWO + (topics.RULES,)", ["speech", "clock", "rules"]),
        ("SUBSCRIBES = (*topics.TOPICS[:2], topics.RULES)", ["clock", "camera/image_raw", "rules"]),
        ("SUBSCRIBES = tuple(t for t in topics.TOPICS if t.name == 'rules')", ["rules"]),
        ("SUBSCRIBES = topics.TOPICS", [topic.name for topic in topics.TOPICS]),
    ],
)
def test_interface_is_read_from_the_source_or_by_import(workspace, source, subscribes):
    (workspace.root / "nodes" / "odd.py").write_text(f"from paramove.bus import topics\n{source}\nPUBLISHES = ()\n")
    assert [topic.name for topic in read_interface("nodes.odd", workspace.folders).subscribes] == subscribes


@pytest.mark.parametrize(
    ("source", "message"),
    [
        ("SUBSCRIBES = ()", "PUBLISHES is missing"),
        ("SUBSCRIBES = (topics.CLOK,)\nPUBLISHES = ()", r"odd\.py:1: there is no topic topics.CLOK"),
        ("SUBSCRIBES = (\nPUBLISHES = ()", r"odd\.py:1: "),
        ("SUBSCRIBES = f()\nPUBLISHES = ()", "cannot be imported: NameError"),
    ],
)
def test_unreadable_interface_is_told(workspace, source, message):
    (workspace.root / "nodes" / "odd.py").write_text(source)
    with pytest.raises(InterfaceError, match=message):
        read_interface("nodes.odd", workspace.folders)


def test_names_of_the_release_before_are_read_with_a_warning(workspace):
    (workspace.root / "nodes" / "odd.py").write_text(
        "from paramove.bus import topics\nHEARS = (topics.SPEECH,)\nPUBLISHES = ()"
    )
    with pytest.warns(UserWarning, match="HEARS is called SUBSCRIBES"):
        assert read_interface("nodes.odd", workspace.folders).subscribes == (topics.SPEECH,)


def test_old_names_are_read_where_the_module_has_to_be_imported(workspace):
    source = "from paramove.bus import topics\nHEARS = tuple([topics.SPEECH])\nPUBLISHES = ()"
    (workspace.root / "nodes" / "computed.py").write_text(source)
    with pytest.warns(UserWarning, match="HEARS is called SUBSCRIBES"):
        assert read_interface("nodes.computed", workspace.folders).subscribes == (topics.SPEECH,)


@pytest.mark.parametrize("module", NODES)
def test_no_node_has_to_be_imported_to_be_known(module, monkeypatch):
    """Each of those would make every launch two seconds longer."""
    asked = []
    monkeypatch.setattr("paramove.supervision.interfaces._imported", lambda *ask: asked.append(ask) or ((), ()))
    read_interface(module, Workspace.at(ROOT))
    assert asked == []


def test_parameters_that_were_right_are_not_checked_again_until_the_code_changes(monkeypatch, tmp_path):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    installed = Workspace.at(ROOT)
    launch = launch_file.load(installed, "pointing")
    asked = []
    check = parameters._check_in_process
    monkeypatch.setattr(
        parameters, "_check_in_process", lambda *arguments: asked.append(arguments) or check(*arguments)
    )
    for _ in range(2):
        application.check(launch, installed)
    assert len(asked) == 1
    wrong = launch_file.load(installed, "pointing", None, ["action_tracker.particles=0"])
    with pytest.raises(DocumentError, match="particles"):
        application.check(wrong, installed)
    monkeypatch.setattr(parameters, "code_digest", lambda *modules: "of changed code")
    application.check(launch, installed)
    assert len(asked) == 3


def reader_of_goals(workspace, also=""):
    (workspace.root / "nodes" / "goal_reader.py").write_text(
        "from paramove.bus import topics\n"
        f"SUBSCRIBES = (topics.RELOCATION_GOAL, {also})\nPUBLISHES = (topics.SPEECH,)\n"
    )


def test_a_topic_from_outside_needs_no_publisher(workspace):
    reader_of_goals(workspace)
    checked(workspace, "external: [relocation/goal]\nnodes: {main: {module: nodes.goal_reader}}")


@pytest.mark.parametrize(
    ("external", "reason"),
    [
        ("speech", "'main' publishes speech"),
        ("relocation/gaol", "did you mean 'relocation/goal'?"),
        ("operator/stop", "for nodes and persons"),
        ("truth/state", "for nodes and persons"),
    ],
)
def test_a_topic_that_nobody_may_or_needs_to_publish_from_outside_is_rejected(workspace, external, reason):
    reader_of_goals(workspace, "topics.OPERATOR_STOP, topics.TRUTH_STATE")
    with pytest.raises(DocumentError) as raised:
        checked(workspace, f"external: [{external}]\nnodes: {{main: {{module: nodes.goal_reader, truth: true}}}}")
    assert reason in next(finding.message for finding in raised.value if finding.position.line == 1)


def test_the_same_node_in_two_namespaces_has_topics_of_its_own(workspace):
    two = "\n".join(
        f"  {side}_{name}: {{module: nodes.{module}, namespace: {side}}}"
        for side in ("left", "right")
        for name, module in (("robot", "actor"), ("ear", "listener"))
    )
    checked(workspace, f"nodes:\n{two}")
    alone = two.replace("  right_robot: {module: nodes.actor, namespace: right}\n", "")
    with pytest.raises(DocumentError, match="'right_ear' subscribes to right/speech, which no node"):
        checked(workspace, f"nodes:\n{alone}")


@pytest.mark.parametrize("namespace", ["truth", "status"])
def test_what_names_of_topics_begin_with_is_no_namespace(workspace, namespace):
    with pytest.raises(DocumentError, match=f"'{namespace}' is no namespace"):
        checked(workspace, f"nodes:\n  robot: {{module: nodes.actor, namespace: {namespace}}}")


def test_a_node_for_every_namespace_has_the_topics_of_each(workspace):
    source = (workspace.root / "nodes" / "listener.py").read_text()
    entry = 'if __name__ == "__main__":\n    main(run, SUBSCRIBES, PUBLISHES, Config, every_namespace=True)\n'
    (workspace.root / "nodes" / "recorder.py").write_text(source + entry)
    text = """nodes:
  left_robot: {module: nodes.actor, namespace: left}
  recorder: {module: nodes.recorder, optional_topics: [speech]}
  left_recorder: {module: nodes.recorder, namespace: left}
"""
    interfaces = checked(workspace, text)
    assert [topic.name for topic in interfaces["recorder"].subscribes] == ["speech", "left/speech"]
    assert interfaces["left_recorder"].subscribes == (topics.SPEECH,)
