"""Files that a run needs: which are missing, and the commands that make them."""

import pytest

from paramove.documents.positions import DocumentError
from paramove.supervision import launch_file
from paramove.supervision.needs import missing_files
from paramove.workspace import Workspace

NODES = "nodes: {camera: {module: nodes.camera, parameters: {source: 'device:/dev/video0', cameras: a b.yaml}}}\n"
NEEDS = """
needs:
  cameras:
    file: "{camera.cameras}"
    about: where it is
    made_by: "paramove calibrate {camera.source} --out 'a b.yaml'"
  person: {file: person.yaml, about: the person, made_by: paramove webcam person}
"""


def missing(launches, text, *settings):
    (launches / "one.yaml").write_text(NODES + text)
    workspace = Workspace(launches.parent, (launches.parent,))
    return missing_files(launch_file.load(workspace, "one", settings=settings), workspace)


def test_commands_have_the_values_of_parameters(launches):
    first, second = missing(launches, NEEDS, "camera.source=file:x")
    assert first.path == launches.parent / "a b.yaml"
    assert first.command == ("calibrate", "file:x", "--out", "a b.yaml")
    assert first.typed == "paramove calibrate file:x --out 'a b.yaml'"
    assert second.about == "the person"


def test_a_file_that_is_there_is_not_missing(launches):
    found = missing(launches, NEEDS)
    assert next(found).about == "where it is"
    (launches.parent / "person.yaml").touch()  # the first command wrote both
    assert next(found, None) is None


@pytest.mark.parametrize(
    ("entry", "message"),
    [
        ("file: x, about: x, made_by: rm x", "paramove …"),
        ("file: x, about: x, made_by: ''", "paramove …"),
        ("file: '{camera.nothing}', about: x, made_by: paramove x", "camera.nothing"),
        ("file: x, about: x, made_by: 'paramove x {other.source}'", "other.source"),
    ],
)
def test_wrong_entries_are_named_with_their_position(launches, entry, message):
    with pytest.raises(DocumentError, match=r"one.yaml:\d+:\d+.*" + message):
        list(missing(launches, f"needs: {{a: {{{entry}}}}}\n"))
