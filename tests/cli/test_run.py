"""One node beside a running application, or alone; and what can be set in a launch file."""

import os
import signal
import subprocess
import sys

import pytest

from paramove.bus import Bus, BusSettings, topics
from paramove.documents import exit_codes
from tests.supervision.conftest import until

NODE = """
from paramove.bus import Bus, NodeConfig, main, topics
from paramove.msgs.rule_pb2 import Speech

SUBSCRIBES = (topics.GESTURES,)
PUBLISHES = (topics.SPEECH,)


class Config(NodeConfig):
    text: str = "hello"
    times: int
    ends: bool = False


def run(bus: Bus, config: Config) -> None:
    bus.ready("announces")
    for _ in range(config.times):
        bus.publish(topics.SPEECH, Speech(text=config.text))
    if config.ends:
        return
    for _ in bus.events():
        bus.publish(topics.SPEECH, Speech(text=config.text))


if __name__ == "__main__":
    main(run, SUBSCRIBES, PUBLISHES, Config)
"""


@pytest.fixture
def folder(user_workspace, short_folder, monkeypatch):
    """A workspace with a node, in a domain of its own."""
    user_workspace.write("nodes/announcer.py", NODE)
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(short_folder))
    monkeypatch.delenv("PARAMOVE_DOMAIN", raising=False)
    return user_workspace.root


def paramove(*words, **options):
    command = [sys.executable, "-m", "paramove.cli.main", *words]
    return subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, **options)


def ended(*words):
    process = paramove(*words)
    output, errors = process.communicate(timeout=120)
    return process.returncode, output, errors


def test_alone_it_is_an_application_of_one_node(folder):
    code, output, errors = ended("run", "nodes.announcer", "--set", "times=0", "--set", "ends=true")
    assert code == exit_codes.OK, errors
    assert "done: " in output
    assert "announcer" in (folder / "runs" / "latest" / "launch.yaml").read_text()


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("nodes.anouncer",), "announcer"),
        (("announcer",), "did you mean nodes.announcer?"),
        (("nodes.announcer",), "'times' is missing"),
        (("nodes.announcer", "--set", "times=x"), "times: input should be a valid integer"),
        (("nodes.announcer", "--set", "tmes=1"), "did you mean 'times'?"),
        (("nodes.announcer", "--set", "times=1", "--remap", "speach=a"), "did you mean 'speech'?"),
        (("nodes.announcer", "--set", "times=1", "--name", "No Name"), "No Name"),
    ],
)
@pytest.mark.parametrize("beside", [False, True])
def test_what_is_wrong_is_reported_before_anything_starts(folder, short_folder, words, message, beside):
    if beside:
        (short_folder / "paramove" / "default").mkdir(mode=0o700, parents=True)
    code, _, errors = ended("run", *words)
    assert code == exit_codes.CONFIGURATION
    assert message in errors


def test_beside_others_it_joins_their_bus_with_its_topics_renamed_and_ends_by_ctrl_c(folder, short_folder):
    settings = BusSettings(folder=short_folder / "paramove" / "default")
    with Bus("other", settings, (), (topics.SPEECH,)) as bus:
        bus.ready("is here")
        code, _, errors = ended("run", "nodes.announcer", "--set", "times=1")
        assert code == exit_codes.TEMPORARY
        assert f"pid {os.getpid()} (other)" in errors
        words = ("--set", "times=1", "--set", "text=there", "--name", "second", "--remap", "speech=rules/speech")
        process = paramove("run", "nodes.announcer", *words)
        bus.exchange.subscribe(topics.status("second"))
        states = []

        def is_ready() -> bool:
            bus.idle(0.05)
            states.extend(one.message.detail for one in bus.exchange.take(["status/second"]))
            return "announces" in states

        until(is_ready, "the node has joined")
        assert (settings.folder / "rules.speech").exists()
        process.send_signal(signal.SIGINT)
        _, errors = process.communicate(timeout=30)
        assert process.returncode == exit_codes.OK, errors


def test_show_args_lists_what_can_be_set(folder):
    (folder / "launch" / "talk.yaml").write_text(
        "nodes:\n  announcer: {module: nodes.announcer, optional_topics: ['*'], parameters: {text: hi}}\n"
    )
    code, output, errors = ended("launch", "talk", "--show-args")
    assert code == exit_codes.OK, errors
    assert [line.split() for line in output.splitlines()] == [
        ["announcer.text", '"hi"', "str"],
        ["announcer.times", "(needed)", "int"],
        ["announcer.ends", "false", "bool"],
    ]


def test_a_remap_of_the_command_line_is_checked_and_used(folder):
    (folder / "launch" / "talk.yaml").write_text(
        "nodes:\n  announcer: {module: nodes.announcer, optional_topics: ['*'], parameters: {times: 0, ends: true},"
        " ends_run: true}\n"
    )
    code, _, errors = ended("launch", "talk", "--remap", "announcer:speech=gestures")
    assert code == exit_codes.CONFIGURATION
    assert "speech cannot become gestures" in errors
    code, _, errors = ended("launch", "talk", "--remap", "announcer:speech=their/speech")
    assert code == exit_codes.OK, errors
    assert "their/speech" in (folder / "runs" / "latest" / "nodes" / "announcer.yaml").read_text()
