"""A workspace of a user with messages and topics of its own."""

from __future__ import annotations

import itertools
from pathlib import Path
from typing import Any

import pytest

from paramove.bus import topics

_numbers = itertools.count()

EVERYTHING = """
import "foxglove/PoseInFrame.proto";
import "google/protobuf/timestamp.proto";
import "google/protobuf/duration.proto";
import "paramove/msgs/arm_pose.proto";

enum Colour { COLOUR_UNKNOWN = 0; COLOUR_RED = 1; }
message Branch {
  Tree tree = 1;
}
message Tree {
  repeated Branch branches = 1;
  google.protobuf.Timestamp at = 2;
  double height = 3;
  map<string, double> leaves = 4;
  map<int32, Tree> nests = 5;
  map<string, google.protobuf.Timestamp> visits = 6;
  map<string, Colour> colours = 7;
  foxglove.PoseInFrame where = 8;
  paramove.msgs.ArmPose arm = 9;
  optional double age = 10;
  oneof kind { double oak = 11; string name = 12; }
  google.protobuf.Duration grown = 13;
}
message Plain { string text = 1; Plain next = 2; map<string, string> words = 3; }
"""
"""Whatever a schema may have: recursion, maps, enumerations, messages of others."""


class UserWorkspace:
    """Files of a user's folder, which is the current one. `{package}` in them becomes a name that no other test has."""

    def __init__(self, root: Path, monkeypatch: pytest.MonkeyPatch) -> None:
        self.root, self.package = root, f"own_{next(_numbers)}"
        for folder in ("launch", "nodes", "msgs"):
            (root / folder).mkdir()
        monkeypatch.chdir(root)
        monkeypatch.setattr(topics, "_own_by_folder", {})

    def write(self, name: str, text: str) -> None:
        """A file."""
        (self.root / name).write_text(text.replace("{package}", self.package))

    def schema(self, text: str, name: str = "") -> None:
        """A `.proto` file, which has a name of its own as well."""
        head = 'syntax = "proto3";\npackage {package};\n'
        self.write(f"msgs/{name or self.package}.proto", head + text)

    def table(self, *rows: str) -> None:
        """`msgs/topics.yaml`, a row a line."""
        self.write("msgs/topics.yaml", "topics:\n" + "".join(f"  {row}\n" for row in rows))

    def message(self, name: str, schema: str = EVERYTHING) -> Any:
        """Class of a message of a schema, by its topic."""
        self.schema(schema)
        self.table("some/topic: {type: {package}." + name + "}")
        return topics.by_name("some/topic").type
