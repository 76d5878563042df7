"""Real processes under real supervision."""

import io
import os
import re
import stat
from pathlib import Path

import pytest
from rich.console import Console
from ruamel.yaml import YAML

from paramove.documents import exit_codes
from paramove.supervision import application
from paramove.supervision.view import LineView
from tests.recording.small_disk import fill, small_disk


def test_nodes_start_in_order_and_end_against_it(workspace):
    workspace.write("""
nodes:
  last: {module: nodes.silent_actor, after: [second], ends_run: true, parameters: {lasts_s: 0.3}}
  second: {module: nodes.silent_actor, after: [first]}
  first: {module: nodes.silent_actor}
  recorder: {module: nodes.silent_actor, stop: last, after: [second]}
  arm: {module: nodes.silent_actor, stop: first}
""")
    outcome, _, shown = workspace.run()
    assert outcome.code == exit_codes.OK, shown
    assert outcome.reason == "last has finished"
    started = [event for event in workspace.events if event.startswith(("first", "second", "last"))]
    assert started[:5] == ["first started", "first ready", "second started", "second ready", "last started"]
    ended = [event.split()[0] for event in workspace.events if event.endswith(" ended")]
    assert ended == ["last", "arm", "second", "first", "recorder"]


def test_crashing_node_is_restarted_until_it_works(workspace):
    workspace.write("""
nodes:
  shaky:
    module: nodes.silent_actor
    restart: on-failure
    backoff_s: 0.05
    ends_run: true
    parameters: {crashes: 2, lasts_s: 0.1}
""")
    outcome, folder, shown = workspace.run()
    assert outcome.code == exit_codes.OK, shown
    assert "restart 1 in 0.05 s" in shown
    assert "restart 2 in 0.1 s" in shown
    assert "restarts: 2" in (folder.path / "run.yaml").read_text()


def test_budget_ends_a_crash_loop_and_shows_the_last_lines(workspace):
    workspace.write("""
nodes:
  broken:
    module: nodes.silent_actor
    restart: always
    backoff_s: 0.01
    budget: {restarts: 2, window_s: 100}
    parameters: {crashes: 99}
""")
    outcome, _, shown = workspace.run()
    assert outcome.code == exit_codes.FAILURE
    assert (
        "broken ended with exit code 1; given up after 2 restarts in 100 s; the run cannot continue without it"
        in outcome.reason
    )
    assert "RuntimeError: crash number 3" in shown
    assert workspace.events.count("broken started") == 3


def test_exit_code_78_is_never_restarted(workspace):
    workspace.write("""
nodes:
  wrong: {module: nodes.silent_actor, restart: always, parameters: {lasts_s: 0, exit_code: 78}}
""")
    outcome, _, shown = workspace.run()
    assert outcome.code == exit_codes.FAILURE
    assert "exit code 78: its parameters" in outcome.reason
    assert workspace.events.count("wrong started") == 1, shown


def test_failure_of_a_node_that_is_not_required_does_not_end_the_run(workspace):
    workspace.write("""
nodes:
  extra: {module: nodes.silent_actor, required: false, parameters: {lasts_s: 0, exit_code: 5}}
  main: {module: nodes.silent_actor, ends_run: true, after: [other], parameters: {lasts_s: 0.3}}
  other: {module: nodes.silent_actor}
""")
    outcome, _, shown = workspace.run()
    assert outcome.code == exit_codes.OK, shown
    assert "exit code 5" in shown


def test_node_that_waits_for_one_given_up_is_named(workspace):
    workspace.write("""
nodes:
  extra: {module: nodes.silent_actor, required: false, parameters: {crashes: 9}}
  main: {module: nodes.silent_actor, after: [extra]}
""")
    outcome, _, _ = workspace.run()
    assert outcome.code == exit_codes.FAILURE
    assert outcome.reason == "never started: main"


def test_node_that_hangs_at_start_is_named_with_its_last_words(workspace):
    workspace.write("""
nodes:
  slow: {module: nodes.silent_actor, ready_timeout_s: 6, parameters: {hangs: true}}
""")
    outcome, _, _ = workspace.run()
    assert outcome.code == exit_codes.FAILURE
    assert "slow was not ready within 6 s (ready_timeout_s" in outcome.reason
    assert "last message: warming up the lamp" in outcome.reason


def test_required_node_that_ends_early_ends_the_run_as_a_failure(workspace):
    workspace.write("""
nodes:
  camera: {module: nodes.silent_actor, parameters: {lasts_s: 0.1}}
  other: {module: nodes.silent_actor}
""")
    outcome, _, _ = workspace.run()
    assert outcome.code == exit_codes.FAILURE
    assert outcome.reason == "camera has finished; the run cannot continue without it"


def test_stubborn_node_is_killed_with_its_children(workspace):
    workspace.write("""
nodes:
  stubborn: {module: nodes.silent_actor, parameters: {ignores_sigterm: true, child: true}}
  main: {module: nodes.silent_actor, ends_run: true, after: [stubborn], parameters: {lasts_s: 0.1}}
""")
    outcome, _, shown = workspace.run()
    assert outcome.code == exit_codes.OK
    assert "was killed (SIGKILL)" in shown
    assert workspace.processes() == {}


def test_story_is_told(workspace):
    workspace.write("""
nodes:
  robot: {module: nodes.actor, ends_run: true, parameters: {say: "Please hand me<bell> an object", lasts_s: 1.0}}
""")
    outcome, _, shown = workspace.run()
    assert outcome.code == exit_codes.OK
    assert 'robot: "Please hand me\\x07 an object"' in shown


def test_time_limit(workspace):
    workspace.write("time_limit_s: 0.5\nnodes:\n  main: {module: nodes.silent_actor}\n")
    outcome, _, _ = workspace.run()
    assert outcome.code == exit_codes.TIME_LIMIT
    assert "within 0.5 s" in outcome.reason


def test_module_called_after_the_run_decides(workspace):
    (workspace.root / "nodes" / "judge.py").write_text(
        "import pathlib, sys\n"
        "folder = pathlib.Path(sys.argv[1])\n"
        "sys.exit(0 if 'main ended' in (folder / 'events.txt').read_text() and (folder / 'fair').exists() else 3)\n"
    )
    workspace.write("""
after_run: nodes.judge
nodes:
  main: {module: nodes.silent_actor, ends_run: true, parameters: {lasts_s: 0}}
""")
    outcome, _, _ = workspace.run()
    assert outcome.code == 3
    assert outcome.reason == "main has finished; nodes.judge: exit code 3"
    (workspace.root / "nodes" / "judge.py").write_text("")
    outcome, _, _ = workspace.run()
    assert outcome.code == exit_codes.OK


def test_module_called_after_a_headless_run_makes_no_video(workspace):
    (workspace.root / "nodes" / "judge.py").write_text(
        "import pathlib, sys\npathlib.Path(sys.argv[1], 'told').write_text(' '.join(sys.argv[2:]))\n"
    )
    workspace.write("""
after_run: nodes.judge
nodes:
  main: {module: nodes.silent_actor, ends_run: true, parameters: {lasts_s: 0}}
""")
    _, folder, _ = workspace.run(headless=True)
    assert (folder.path / "told").read_text() == "--no-video"


def test_run_folder_holds_what_was_run(workspace):
    workspace.write("""
bus: {clock: simulated, lockstep: true}
seed_parameters: [world.seed]
nodes:
  world: {module: nodes.world, truth: true, ends_run: true, after: [one], parameters: {lasts_s: 0, seed: 1}}
  one: {module: nodes.silent_actor}
  two: {module: nodes.silent_actor, lockstep: false}
""")
    outcome, folder, _ = workspace.run()
    assert outcome.code == exit_codes.OK
    assert (folder.path.parent / "latest").resolve() == folder.path
    configs = {node: YAML(typ="safe").load(folder.config(node).read_text()) for node in ("world", "one", "two")}
    assert configs["world"]["bus"]["members"] == ["one"]
    assert [configs[node]["bus"]["lockstep"] for node in ("world", "one", "two")] == [True, True, False]
    assert [node for node, config in configs.items() if "truth_folder" in config["bus"]] == ["world"]
    assert configs["world"]["parameters"]["seed"] == 1
    assert "restart: never" in (folder.path / "launch.yaml").read_text()
    assert "exit_code: 0" in (folder.path / "run.yaml").read_text()
    assert not list(Path(os.environ["XDG_RUNTIME_DIR"]).glob("paramove/truth-*"))
    _, second, _ = workspace.run()
    assert second.path != folder.path


@pytest.mark.parametrize("umask", [0o000, 0o077])
def test_all_that_a_run_writes_is_for_its_user_only(workspace, umask):
    before = os.umask(umask)
    try:
        workspace.write("nodes:\n  one: {module: nodes.silent_actor, ends_run: true, parameters: {lasts_s: 0}}\n")
        _, folder, _ = workspace.run()
        assert os.umask(umask) == umask
    finally:
        os.umask(before)
    files = [folder.path, *folder.path.rglob("*")]
    assert {path.name for path in files} >= {"run.yaml", "launch.yaml", "events.jsonl", "one.log", "one.yaml"}
    assert "events.txt" in {path.name for path in files}  # the node wrote it itself
    for path in files:
        assert stat.S_IMODE(path.stat().st_mode) == (0o700 if path.is_dir() else 0o600), path


def test_an_outcome_that_finds_no_room_changes_nothing(workspace, caplog):
    workspace.write("nodes:\n  one: {module: nodes.silent_actor, ends_run: true, parameters: {lasts_s: 0}}\n")
    with small_disk(workspace.root / "runs", 2) as runs:

        def filled(folder):
            fill(runs)
            return LineView(Console(file=io.StringIO()))

        _, folder = application.run(workspace.load(), workspace.folders, filled)
        facts = YAML(typ="safe").load((folder.path / "run.yaml").read_text())
    assert "outcome" not in facts
    assert facts["launch"] == "test"
    assert re.search("outcome could not be written to .*run.yaml: No space left on device", caplog.text)


def test_node_over_its_memory_limit_is_given_up_with_the_figure(workspace):
    workspace.write("""
nodes:
  greedy: {module: nodes.silent_actor, memory_limit_mb: 200, parameters: {ballast_mb: 200}}
""")
    outcome, _, _ = workspace.run()
    assert outcome.code == exit_codes.FAILURE
    assert re.search(r"greedy used \d{3} MB of memory, its limit is 200 MB", outcome.reason)


@pytest.mark.parametrize(
    "odd",
    [
        {"LC_ALL": "C"},
        {"LC_ALL": "tr_TR.ISO8859-9", "PYTHONIOENCODING": "latin-1"},
        {"TZ": "No/Where"},
        {"PYTHONSAFEPATH": "1"},
        {"TERM": "", "COLUMNS": "zero"},
    ],
    ids=lambda odd: next(iter(odd)),
)
def test_odd_environment_does_no_harm(workspace, odd):
    workspace.write("""
nodes:
  robot: {module: nodes.actor, ends_run: true, parameters: {say: "ξ = 1 is open", lasts_s: 1.0}}
""")
    environment = {key: value for key, value in os.environ.items() if key != "HOME"} | odd
    launcher = workspace.start(env=environment, encoding="utf-8", errors="replace")
    shown = launcher.communicate(timeout=60)[0]
    assert launcher.returncode == exit_codes.OK, shown
    assert "= 1 is open" in shown


def test_a_run_ends_when_each_namespace_has_done_its_work(workspace):
    (workspace.root / "nodes" / "judge.py").write_text(
        "import sys, pathlib\n(pathlib.Path(sys.argv[1]) / 'judged').touch()\n"
    )
    workspace.write("""
after_run_of: {left: nodes.judge}
nodes:
  left_short: {module: nodes.silent_actor, namespace: left, ends_run: true, parameters: {lasts_s: 0.1}}
  right_long: {module: nodes.silent_actor, namespace: right, ends_run: true, parameters: {lasts_s: 1.5}}
  right_other: {module: nodes.silent_actor, namespace: right}
""")
    outcome, folder, shown = workspace.run()
    assert outcome.code == exit_codes.OK, shown
    ended = [event["node"] for event in workspace.happened if event["event"] in ("ended", "stopped")]
    assert ended == ["left_short", "right_long", "right_other"]
    assert (folder.path / "left" / "judged").exists(), "the folder of its nodes"
    assert (folder.path / "right" / "nodes" / "long.yaml").exists(), "the nodes have their names in it"
