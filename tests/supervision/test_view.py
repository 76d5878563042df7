"""What a person sees of a run."""

import io
import os
from unittest.mock import Mock

import pytest
from rich.console import Console

from paramove.msgs.node_status_pb2 import NodeStatus
from paramove.supervision.launch_schema import NodeSettings
from paramove.supervision.supervised_node import State, SupervisedNode
from paramove.supervision.view import LineView, TableView


class OwnProcess:
    """Stands for a node's process: this one."""

    pid = os.getpid()


@pytest.fixture
def node():
    made = SupervisedNode("camera", NodeSettings(module="m"), lambda _: OwnProcess(), lambda _: None)
    made.start(0.0)
    status = NodeStatus(node="camera", state=NodeStatus.STATE_READY, detail="480x360 [red]", pid=os.getpid())
    status.received.add(topic="clock", lost=3)
    made.handle(status)
    return made


def console(width=100, terminal=False):
    return Console(file=io.StringIO(), width=width, force_terminal=terminal, color_system=None, legacy_windows=False)


def test_words_of_another_process_are_passed_over(node):
    node.handle(NodeStatus(node="camera", state=NodeStatus.STATE_FAILED, detail="old", pid=1))
    assert (node.state, node.detail) == (State.READY, "480x360 [red]")


def test_lines(node):
    screen = console()
    view = LineView(screen)
    view.changed(node)
    view.story("robot: hello")
    lines = screen.file.getvalue().splitlines()
    assert lines[0].endswith("s  camera           ready       480x360 [red]")
    assert lines[1].endswith("s  robot: hello")


def test_table_shows_the_node_and_the_story_above(node):
    screen = console(terminal=True)
    view = TableView(screen)
    view.refresh([node])
    view.story("robot: hello")
    view.close()
    shown = screen.file.getvalue()
    row = next(line for line in shown.splitlines() if line.startswith("camera"))
    assert "ready" in row
    assert " 3 " in row
    assert "480x360 [red]" in row
    assert "robot: hello" in shown


def test_no_table_is_drawn_for_a_terminal_that_is_behind(node):
    screen = console(terminal=True)
    view = TableView(screen, Mock(is_behind=True))
    begun = screen.file.tell()
    view.refresh([node])
    assert screen.file.tell() == begun
