"""The topic table and the schema hashes."""

from __future__ import annotations

import pytest

from paramove.bus import topics
from paramove.bus.schemas import hash_of, schema_hash, type_of_hash
from paramove.bus.topics import Profile
from paramove.msgs.clock_pb2 import Clock
from paramove.msgs.node_status_pb2 import NodeStatus


def test_names_are_unique_and_well_formed() -> None:
    names = [topic.name for topic in topics.TOPICS]
    assert len(names) == len(set(names))
    assert all(name == name.lower() and " " not in name and "." not in name for name in names)


def test_truth_is_never_recorded() -> None:
    assert {topic.name for topic in topics.TOPICS if topic.truth} == {
        "truth/layout",
        "truth/state",
        "truth/arm",
        "truth/view",
    }
    assert not any(topic.recorded for topic in topics.TOPICS if topic.truth)


def test_only_images_drop_older_messages() -> None:
    assert all(topic.is_image == (topic.profile is Profile.LATEST) for topic in topics.TOPICS)


def test_a_topic_is_found_by_name_and_a_wrong_name_gets_a_hint() -> None:
    assert topics.by_name("gestures") is topics.GESTURES
    assert topics.by_name("status/camera").type is NodeStatus
    with pytest.raises(KeyError, match="camera/image"):
        topics.by_name("camera/imgae")


@pytest.mark.parametrize(
    ("name", "on_the_bus"),
    [
        ("arm/safety", "left/arm/safety"),
        ("speech", "left/speech"),
        ("truth/state", "truth/left/state"),
        ("clock", "clock"),
        ("operator/stop", "operator/stop"),
        ("operator/arm", "left/operator/arm"),
        ("status/camera", "status/camera"),
    ],
)
def test_a_topic_exists_in_each_namespace_but_what_is_of_the_whole_run(name: str, on_the_bus: str) -> None:
    assert topics.name_in("left", name) == on_the_bus
    assert topics.name_in("", name) == name
    topic = topics.by_name(on_the_bus)
    assert topic.name == on_the_bus
    assert topic.type is topics.by_name(name).type
    assert topics.split_name(on_the_bus) == (("left", name) if on_the_bus != name else ("", name))


def test_the_topics_of_the_run_itself_are_the_rows_of_the_table() -> None:
    run, *left = topics.in_all(["left"], [topics.SPEECH])
    assert run is topics.SPEECH, "nodes compare rows by identity"
    assert [topic.name for topic in left] == ["left/speech"]
    assert topics.topic_in("left", topics.CLOCK) is topics.CLOCK


@pytest.mark.parametrize(
    "name", ["left/clock", "left/operator/stop", "left/right/speech", "left/speach", "truth/left/x"]
)
def test_what_is_in_no_namespace_is_no_topic(name: str) -> None:
    with pytest.raises(KeyError, match="no topic"):
        topics.by_name(name)


@pytest.mark.parametrize("node", ["a/b", "A", "", "x y"])
def test_a_bad_node_name_is_refused(node: str) -> None:
    with pytest.raises(ValueError, match="node name"):
        topics.status(node)


def test_schema_hashes_differ_between_types_and_find_their_type() -> None:
    hashes = {topic.type: schema_hash(topic.type) for topic in topics.TOPICS}
    assert len(set(hashes.values())) == len(hashes)
    assert type_of_hash(schema_hash(Clock)) == "paramove.msgs.Clock"
    assert type_of_hash(1) is None


def test_schema_hash_is_the_same_in_every_process_and_release() -> None:
    """A pinned value: it covers the name of the type and its generation, nothing else."""
    assert schema_hash(Clock) == hash_of("paramove.msgs.Clock", 1) == 0x61541BA9BCF96F72
    assert type_of_hash(hash_of("paramove.msgs.Clock", 3)) == "paramove.msgs.Clock of generation 3"


def test_only_topics_whose_rate_is_of_the_bus_clock_have_a_budget() -> None:
    without = {topic.name for topic in topics.TOPICS if topic.rate_hz and not topic.budget_hz}
    assert without == {"clock"}
    assert topics.status("camera").budget_hz is None


@pytest.mark.filterwarnings("ignore:topics.*LIGHT:FutureWarning")
def test_a_renamed_topic_is_known_by_its_name_before() -> None:
    assert topics.by_name("camera_2/light") is topics.CAMERA_IMAGES_RAW[1]
    assert topics.CAMERA_LIGHT is topics.CAMERA_IMAGE_RAW
    assert topics.CAMERA_LIGHTS is topics.CAMERA_IMAGES_RAW
    with pytest.raises(AttributeError, match="CAMERA_DARK"):
        topics.CAMERA_DARK  # noqa: B018
