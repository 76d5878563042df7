"""Topics and messages of a workspace: compiled, checked with position and remedy, and then as those of the library."""

from __future__ import annotations

import re
import stat
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from google.protobuf.descriptor_pool import DescriptorPool
from google.protobuf.message_factory import GetMessageClass

from paramove.bus import changed_field, own_messages, schema_hash, topics
from paramove.bus.topics import Profile
from paramove.documents import DocumentError, InputError
from paramove.msgs.arm_pose_pb2 import ArmPose
from paramove.recording import RecordingWriter, contents, read
from tests.own_workspace import EVERYTHING, UserWorkspace

LAMP = "message Lamp { bool is_on = 1; }\n"


def test_a_topic_of_the_workspace_is_one_of_all_topics(user_workspace: UserWorkspace) -> None:
    user_workspace.schema(LAMP)
    user_workspace.table(
        "lamp/state: {type: {package}.Lamp, rate_hz: 10, profile: latched, frame: table, max_bytes: 100}",
        "lamp/brightness: {type: paramove.msgs.ArmPose, limit_hz: 3, recorded: false}",
        "truth/lamp: {type: foxglove.PoseInFrame, profile: latest}",
    )
    lamp, brightness, truth = topics.TOPICS[len(topics.LIBRARY) :]
    assert (lamp.name, lamp.type_name, lamp.rate_hz) == ("lamp/state", f"{user_workspace.package}.Lamp", 10.0)
    assert (lamp.profile, lamp.frame, lamp.max_bytes) == (Profile.LATCHED, "table", 100)
    assert (brightness.type, brightness.limit_hz) == (ArmPose, 3.0)
    assert [topic.recorded for topic in (lamp, brightness, truth)] == [True, False, False]
    assert topics.LAMP_STATE is topics.by_name("lamp/state") is lamp
    assert lamp in topics.RECORDED
    assert brightness not in topics.RECORDED
    assert truth.truth
    assert lamp.type(is_on=True).SerializeToString() == b"\x08\x01"


@pytest.mark.parametrize(
    ("rows", "other"),
    [
        (("lamp/state: {type: foxglove.Log}", "lamp_state: {type: foxglove.Log}"), "lamp/state"),
        (("camera_image: {type: foxglove.Log}",), "camera/image"),
    ],
)
def test_two_topics_that_a_node_would_call_the_same_are_rejected(user_workspace, rows, other):
    user_workspace.table(*rows)
    with pytest.raises(DocumentError, match=f"as they call '{other}'"):
        topics.own()


NOW = "{bool is_on = 1; double watt = 2; Kind kind = 3;} enum Kind {NONE = 0; LED = 1;}"


@pytest.mark.parametrize(
    ("former", "what"),
    [
        (NOW.replace("= 1; double", "= 2; double").replace("watt = 2", "watt = 1"), "'bool is_on = 2' is 'double watt"),
        (NOW.replace("double watt", "float watt"), "'float watt = 2' is 'double watt = 2' now"),
        (NOW.replace("watt", "power_w"), "'double power_w = 2' is 'double watt = 2' now"),
        (NOW.replace("bool is_on", "repeated bool is_on"), "'repeated bool is_on = 1' is 'bool is_on = 1' now"),
        (NOW.replace("LED = 1", "LED = 2"), "'LED = 2' is 'LED = 1' now"),
        (NOW.replace("double watt = 2;", ""), ""),
        (NOW.replace("Kind kind", "double spare = 9; Kind kind"), ""),
    ],
)
def test_a_message_with_a_changed_field_is_another_type_on_the_bus_and_read_as_it_was_recorded(
    user_workspace, tmp_path, former, what
):
    recorded = tmp_path / "changed.mcap"
    user_workspace.schema(f"message Lamp {former}")
    user_workspace.table("lamp: {type: {package}.Lamp}")
    row = topics.by_name("lamp")
    with RecordingWriter(recorded, "test") as writer:
        writer.write("lamp", row.type(is_on=[True] if "repeated" in former else True), 0, 0, 1)
    present = replace(row, type=compiled(user_workspace, f"message Lamp {NOW}"))
    change = changed_field(present.type.DESCRIPTOR, row.type.DESCRIPTOR)
    assert change.startswith(what)
    assert bool(change) == bool(what)
    assert schema_hash(present.type) != schema_hash(row.type)
    topics._own_by_folder[Path.cwd()] = (present,)
    (one,) = read(recorded)
    assert one.message.is_on in (True, [True])
    assert (type(one.message) is present.type) == (not what)
    (topic,) = contents(recorded)
    assert topic.change == change


def compiled(user_workspace: UserWorkspace, text: str) -> Any:
    """Class of the message Lamp of a schema that another process would compile."""
    user_workspace.schema(text)
    (file,) = own_messages._compiled(user_workspace.root).file
    pool = DescriptorPool()
    pool.Add(file)
    return GetMessageClass(pool.FindMessageTypeByName(f"{user_workspace.package}.Lamp"))


def test_without_a_table_there_are_the_topics_of_the_library(user_workspace: UserWorkspace) -> None:
    user_workspace.schema("this is not read")
    assert topics.TOPICS == topics.LIBRARY
    with pytest.raises(AttributeError, match="LAMP_STATE"):
        _ = topics.LAMP_STATE


def test_messages_import_each_other_and_those_of_others(user_workspace: UserWorkspace) -> None:
    user_workspace.schema(EVERYTHING)
    forest = f'import "msgs/{user_workspace.package}.proto";\nmessage Forest {{ repeated Tree trees = 1; ' + "}"
    user_workspace.schema(forest, "a_file_that_comes_before")
    user_workspace.table("forest: {type: {package}.Forest}")
    tree = topics.FOREST.type().trees.add()
    tree.arm.CopyFrom(ArmPose(frame="table"))
    tree.where.frame_id = "table"
    assert topics.FOREST.type.FromString(topics.FOREST.type(trees=[tree]).SerializeToString()).trees[0] == tree


@pytest.mark.parametrize(
    ("row", "position", "words"),
    [
        ("lamp: {type: {package}.Lmp}", "2:10", ("there is no message", "did you mean", ".Lamp'?")),
        ("lamp: {type: Lamp}", "2:10", ("there is no message 'Lamp'",)),
        ("lamp: {typ: {package}.Lamp}", "2:10", ("unknown key 'typ'", "did you mean 'type'?")),
        ("lamp: {rate_hz: 3}", "2:3", ("type is missing",)),
        ("lamp: {type: {package}.Lamp, rate_hz: 0}", "2:", ("greater than 0",)),
        ("lamp: {type: {package}.Lamp, profile: last}", "2:", ("'latest', 'queue' or 'latched'",)),
        ("lamp: {type: {package}.Lamp, max_bytes: 99999999}", "2:", ("less than or equal to 16777216",)),
        ("Lamp: {type: {package}.Lamp}", "2:3", ("lower-case letters",)),
        ("lamp/: {type: {package}.Lamp}", "2:3", ("lower-case letters",)),
        ("speech: {type: {package}.Lamp}", "2:3", ("a topic of the library already",)),
        ("status/lamp: {type: {package}.Lamp}", "2:3", ("given by the library",)),
        ("my/arm: {type: paramove.msgs.ArmRequest}", "2:12", ("for topics of the library alone",)),
        ("my/clock: {type: paramove.msgs.Clock}", "2:14", ("for topics of the library alone",)),
        ("truth/lamp: {type: {package}.Lamp, recorded: true}", "2:3", ("ground truth", "not recorded")),
    ],
)
def test_a_wrong_row_is_reported_with_its_place_and_what_would_work(
    user_workspace: UserWorkspace, row: str, position: str, words: tuple[str, ...]
) -> None:
    user_workspace.schema(LAMP)
    user_workspace.table(row)
    with pytest.raises(DocumentError) as raised:
        topics.own()
    assert str(raised.value).startswith(f"{user_workspace.root}/msgs/topics.yaml:{position}")
    for word in words:
        assert word in str(raised.value)


def test_all_faults_of_a_table_are_reported_at_once(user_workspace: UserWorkspace) -> None:
    user_workspace.schema(LAMP)
    user_workspace.table(
        "speech: {type: {package}.Lamp}", "lamp: {type: {package}.Lmp}", "good: {type: {package}.Lamp}"
    )
    with pytest.raises(DocumentError) as raised:
        topics.own()
    assert [error.position.line for error in raised.value] == [2, 3]


def test_what_protoc_rejects_is_reported_with_file_line_and_column(user_workspace: UserWorkspace) -> None:
    user_workspace.schema("message Lamp { bol is_on = 1; }\n", "lamp")
    user_workspace.table("lamp: {type: {package}.Lamp}")
    with pytest.raises(DocumentError, match=re.escape(f'{user_workspace.root}/msgs/lamp.proto:3:16: "bol" is not')):
        topics.own()


def test_a_name_that_a_library_has_is_no_name_for_own_messages(user_workspace: UserWorkspace) -> None:
    user_workspace.write(
        "msgs/pose.proto", 'syntax = "proto3";\npackage foxglove;\nmessage PoseInFrame { bool x = 1; }\n'
    )
    user_workspace.table("pose: {type: foxglove.PoseInFrame}")
    with pytest.raises(InputError, match=r"pose\.proto"):
        topics.own()


def test_compiled_messages_are_kept_until_a_schema_changes(
    user_workspace: UserWorkspace, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(user_workspace.root / "cache"))
    user_workspace.schema(LAMP)
    user_workspace.table("lamp: {type: {package}.Lamp}")
    first = topics.LAMP.type
    monkeypatch.setattr(topics, "_own_by_folder", {})
    monkeypatch.setattr(own_messages.sys, "executable", "/nonexistent")
    assert topics.LAMP.type is first
    monkeypatch.setattr(topics, "_own_by_folder", {})
    user_workspace.schema(LAMP + "message More {}\n")
    with pytest.raises(OSError, match="nonexistent"):
        topics.own()


def test_without_a_cache_messages_are_compiled_each_time(
    user_workspace: UserWorkspace, monkeypatch: pytest.MonkeyPatch
) -> None:
    user_workspace.write("no_folder", "")
    monkeypatch.setenv("XDG_CACHE_HOME", str(user_workspace.root / "no_folder"))
    user_workspace.schema(LAMP)
    user_workspace.table("lamp: {type: {package}.Lamp}")
    assert topics.LAMP.type(is_on=True).is_on


def test_without_protoc_its_package_is_named(user_workspace: UserWorkspace, monkeypatch: pytest.MonkeyPatch) -> None:
    python = user_workspace.root / "python"
    python.write_text("#!/bin/sh\necho 'python: No module named grpc_tools' >&2\nexit 1\n")
    python.chmod(python.stat().st_mode | stat.S_IXUSR)
    monkeypatch.setattr(own_messages.sys, "executable", str(python))
    monkeypatch.setenv("XDG_CACHE_HOME", str(user_workspace.root / "cache"))
    user_workspace.schema(LAMP)
    user_workspace.table("lamp: {type: {package}.Lamp}")
    with pytest.raises(InputError, match="pip install grpcio-tools"):
        topics.own()


def test_a_recording_has_own_messages_with_their_schema(user_workspace: UserWorkspace, tmp_path: Path) -> None:
    tree = user_workspace.message("Tree")(height=3.0)
    tree.leaves["a"] = 0.5
    path = tmp_path / "own.mcap"
    with RecordingWriter(path, "test") as writer:
        writer.write("some/topic", tree, 5, 6, 1)
    (recorded,) = read(path)
    assert (recorded.topic, recorded.message) == ("some/topic", tree)
