"""labels.yaml of a demonstration set: the labelled segments of each recording; read, checked and written."""

from __future__ import annotations

import errno
import io
import os
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field
from ruamel.yaml import YAML
from ruamel.yaml.comments import CommentedMap, CommentedSeq
from ruamel.yaml.nodes import MappingNode, Node, SequenceNode

from paramove.demonstrations.movement import DemonstrationError
from paramove.documents import (
    Document,
    DocumentError,
    FileName,
    KeyPath,
    checked,
    raise_any,
    read_mapping,
    read_text,
    replacing,
)

FILE_NAME = "labels.yaml"
MAX_CHARACTERS = 4_000_000
EXAMPLE = "segments: [{recording: a.mcap, start: 0.0, end: 2.5, action: reaching}]"
HEAD = """\
# A demonstration set. Each segment is one movement: start and end in seconds from the first pose of its recording.
# Parameters whose names end in _x, _y, _z are a place in the frame of the recording, in metres.
"""


class LabelsError(DemonstrationError):
    """labels.yaml is wrong: one finding per line, each with file:line:column."""

    def __init__(self, findings: DocumentError) -> None:
        super().__init__(str(findings))
        self.findings = findings

    def __str__(self) -> str:
        return str(self.findings)


class _Checked(BaseModel):
    model_config = ConfigDict(extra="forbid", strict=True, frozen=True, allow_inf_nan=False)


def _number_as_text(value: object) -> object:
    return str(value) if isinstance(value, int) and not isinstance(value, bool) else value


def _nothing_as_none_yet(value: object) -> object:
    return [] if value is None else value


Word = Annotated[str, Field(min_length=1, max_length=80)]


class Segment(_Checked):
    """One movement in a recording."""

    recording: FileName = Field(description="file in the folder of labels.yaml")
    start: float = Field(ge=0.0, description="s from the first pose of the recording; the first frame of the movement")
    end: float = Field(gt=0.0, description="s; the last frame of the movement")
    action: Annotated[FileName, Field(max_length=80)] = Field(
        description="what is done, such as reaching; a model is named after it"
    )
    theta: list[float] = Field(
        default_factory=list, description="the movement's parameters, as `parameters` names them"
    )
    subject: Annotated[str, BeforeValidator(_number_as_text)] = Field(default="", max_length=80, description="who")
    repetition: int = Field(default=0, ge=0, description="counts movements with the same action, theta and subject")
    side: Literal["right", "left"] = Field(default="right", description="which arm moves")

    def __str__(self) -> str:
        return f"{self.recording}, {self.start:g} to {self.end:g} s"


class LabelsFile(_Checked):
    """The content of labels.yaml."""

    version: Literal[1] = Field(default=1, description="of this form")
    description: str = Field(default="", description="for people")
    parameters: list[Word] = Field(default_factory=list, description="names of the components of theta")
    points: list[Word] | None = Field(default=None, min_length=1, description="which points, in which order; null: all")
    max_gap: float = Field(default=0.1, ge=0.0, le=1.0, description="s; longer losses of a point are not filled")
    segments: Annotated[list[Segment], BeforeValidator(_nothing_as_none_yet)] = Field(
        default_factory=list, description="the movements"
    )


@dataclass(frozen=True)
class Labels:
    """A checked labels.yaml and the position of each value."""

    path: Path
    file: LabelsFile
    document: Document

    def error(self, index: int, message: str, key: str = "") -> DocumentError:
        """A finding about segment number `index` from 0, at one of its keys or at its beginning."""
        path: KeyPath = ("segments", str(index), *([key] if key else []))
        return self.document.error(path, message)

    def line(self, index: int) -> int:
        """Line of segment number `index` from 0."""
        return self.document.position(("segments", str(index))).line


def load_labels(path: Path) -> Labels:
    """Reads and checks labels.yaml; the recordings are not read.

    Raises DemonstrationError if there is no such file, LabelsError with the positions of all faults in it.
    """
    if not path.is_file():
        raise DemonstrationError(
            f"there is no {path}: a demonstration set is a folder with recordings and a {FILE_NAME}; "
            "make one with `paramove demos import`, `paramove demos label` or `paramove demos synthesize`",
            missing=True,
        )
    try:
        document = read_mapping(_text(path), str(path), max_characters=MAX_CHARACTERS, example=EXAMPLE)
        labels = Labels(path, checked(LabelsFile, document), document)
        raise_any(_contradictions(labels))
    except DocumentError as error:
        raise LabelsError(error) from error
    return labels


def _text(path: Path) -> str:
    return read_text(path, "text of labels", DemonstrationError, 4 * MAX_CHARACTERS)


def _contradictions(labels: Labels) -> list[DocumentError]:
    """Segments that contradict themselves or each other."""
    findings: list[DocumentError] = []
    first_index: dict[tuple[object, ...], int] = {}
    names = labels.file.parameters
    for kind, words in (("parameters", names), ("points", labels.file.points or [])):
        if len(set(words)) < len(words):
            findings.append(labels.document.error((kind,), f"{kind}: each name once, found {', '.join(words)}"))
    for index, segment in enumerate(labels.file.segments):
        if segment.end <= segment.start:
            message = f"the segment ends at {segment.end:g} s, before its start at {segment.start:g} s"
            findings.append(labels.error(index, message, "end"))
        if len(segment.theta) != len(names):
            message = f"theta has {len(segment.theta)} components; 'parameters' names {len(names)}: {', '.join(names)}"
            findings.append(labels.error(index, message, "theta"))
        key = (segment.recording, segment.start, segment.end, segment.action, segment.side)
        first = first_index.setdefault(key, index)
        if first != index:
            message = f"the same segment ({segment}) is in line {labels.line(first)} too; remove one"
            findings.append(labels.error(index, message))
    return findings


def write_labels(path: Path, content: LabelsFile) -> None:
    """Writes a new labels.yaml; raises FileExistsError if there is one."""
    tree = CommentedMap(content.model_dump(exclude={"segments", "points", "max_gap"}, exclude_defaults=True))
    tree.insert(0, "version", content.version)
    tree["parameters"] = _in_one_line(content.parameters)
    if content.points is not None:
        tree["points"] = _in_one_line(content.points)
    tree["max_gap"] = content.max_gap
    tree["segments"] = CommentedSeq([_segment(segment) for segment in content.segments])
    if path.exists():
        raise FileExistsError(errno.EEXIST, os.strerror(errno.EEXIST), str(path))
    with replacing(path) as unfinished:
        unfinished.write_text(HEAD + _dumped(tree), encoding="utf-8")


def append_segments(path: Path, segments: Sequence[Segment]) -> None:
    """Adds segments to a labels.yaml; everything else in it, comments too, is unchanged.

    Raises DemonstrationError or LabelsError, and leaves the file alone, if the result would not be valid.
    """
    before = _text(path)
    load_labels(path)
    with replacing(path) as after:
        text = _with_segments(before, [_in_flow(_segment(segment)) for segment in segments])
        after.write_text(text, encoding="utf-8")
        try:
            load_labels(after)
        except LabelsError as error:
            messages = "; ".join(finding.message for finding in error.findings)
            raise DemonstrationError(f"{path} would not be valid with this segment: {messages}") from error


def _with_segments(text: str, lines: Sequence[str]) -> str:
    """The text with a line for each new segment at the end of its list, however the list is written."""
    pairs = {key.value: (key, value) for key, value in _yaml().compose(text).value}
    key, listed = pairs.get("segments", (None, None))
    fresh = "\n".join(f"  - {line}" for line in lines)
    if listed is None:
        return f"{text.rstrip()}\nsegments:\n{fresh}\n"
    if isinstance(listed, SequenceNode) and listed.flow_style and listed.value:
        at = _end(listed.value[-1])
        return f"{text[:at]}, {', '.join(lines)}{text[at:]}"
    if isinstance(listed, SequenceNode) and not listed.flow_style:
        at, indent = _end(listed.value[-1]), " " * listed.start_mark.column
        fresh = "\n".join(f"{indent}- {line}" for line in lines)
    else:  # `[]`, or nothing at all
        if isinstance(listed, SequenceNode):
            text = text[: listed.start_mark.index].rstrip(" ") + text[listed.end_mark.index :]
        at = key.end_mark.index
    line_end = text.find("\n", at)
    line_end = len(text) if line_end < 0 else line_end
    return f"{text[:line_end]}\n{fresh}{text[line_end:] or chr(10)}"


def _end(node: Node) -> int:
    """Where a node's own text ends: a block's end mark lies behind the comments and empty lines that follow it."""
    if not isinstance(node, SequenceNode | MappingNode) or node.flow_style or not node.value:
        return int(node.end_mark.index)
    last = node.value[-1]
    return _end(last[1] if isinstance(last, tuple) else last)


def _in_flow(tree: CommentedMap) -> str:
    """A mapping in one line."""
    return _dumped(CommentedSeq([tree])).strip().removeprefix("-").strip()


def _segment(segment: Segment) -> CommentedMap:
    values: dict[str, Any] = segment.model_dump()
    values["theta"] = _in_one_line(values["theta"])
    for key, empty in (("side", "right"), ("subject", "")):
        if values[key] == empty:
            del values[key]
    tree = CommentedMap(values)
    tree.fa.set_flow_style()
    return tree


def _in_one_line(values: Sequence[Any]) -> CommentedSeq:
    sequence = CommentedSeq(values)
    sequence.fa.set_flow_style()
    return sequence


def _yaml() -> YAML:
    yaml = YAML()
    yaml.version = (1, 2)
    yaml.width = 4096
    yaml.preserve_quotes = True
    yaml.indent(mapping=2, sequence=4, offset=2)
    return yaml


def _dumped(tree: CommentedMap | CommentedSeq) -> str:
    text = io.StringIO()
    _yaml().dump(tree, text)
    return text.getvalue().removeprefix("%YAML 1.2\n---\n")
