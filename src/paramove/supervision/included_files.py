"""Launch files that another one includes: their nodes get a namespace, and names that begin with it."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

from paramove.bus import topics
from paramove.documents import Document, DocumentError, KeyPath, Position, checked, is_identifier, raise_any
from paramove.supervision.launch_schema import IncludedFile, LaunchFile

NO_NAMESPACES = ("truth", "status")
"""Names of topics begin with them in each namespace."""
LISTS = ("seed_parameters", "connections", "external")
"""Keys whose entries are added to those of the including file."""
_REFERENCE = re.compile(r"\{(\w+)\.")


@dataclass(frozen=True)
class _Included:
    """A launch file as a part of another.

    Args:
        namespace: Of its nodes.
        without: Its nodes that are left out.
        file: The launch file, checked.
        document: The same with positions.
    """

    namespace: str
    without: frozenset[str]
    file: LaunchFile
    document: Document

    def entries(self, key: str) -> list[str]:
        """Its entries of one of `LISTS`."""
        written = self.document.data.get(key, [])
        if key == "external":
            return [topics.name_in(self.namespace, topic) for topic in written]
        return [self._prefixed(target) for target in written if self._has(target)]

    def as_document(self) -> Document:
        """The rest of its content; the positions of its nodes are those in the file itself."""
        written = self.document.data
        headless = written.get("headless", {})
        data: dict[str, Any] = {
            "nodes": dict(self._nodes(written["nodes"])),
            "headless": {self._prefixed(name): headless[name] for name in headless if self._has(name)},
            "needs": dict(self._needs(written.get("needs", {}))),
            **{key: written[key] for key in ("bus", "hosts") if key in written},
        }
        if self.file.after_run is not None:
            data["after_run_of"] = {self.namespace: self.file.after_run}
        positions: dict[KeyPath, Position] = {}
        for path, position in self.document.positions.items():
            if path[:1] in (("nodes",), ("needs",)) and len(path) > 1:
                positions[path[0], self._prefixed(path[1]), *path[2:]] = position
        return Document(data, positions)

    def _prefixed(self, name: str) -> str:
        return f"{self.namespace}_{name}"

    def _has(self, target: str) -> bool:
        """Whether the node of a `node.parameter` is not left out."""
        return target.partition(".")[0] not in self.without

    def _nodes(self, nodes: dict[str, Any]) -> Iterator[tuple[str, dict[str, Any]]]:
        for name, node in nodes.items():
            if name in self.without:
                continue
            settings = {**node, "namespace": self.namespace}
            if "after" in node:
                settings["after"] = [self._prefixed(other) for other in node["after"] if other not in self.without]
            yield self._prefixed(name), settings

    def _needs(self, needs: dict[str, Any]) -> Iterator[tuple[str, dict[str, Any]]]:
        for name, need in needs.items():
            named = {node for text in need.values() for node in _REFERENCE.findall(text)}
            if named.isdisjoint(self.without):
                texts = {key: _REFERENCE.sub(rf"{{{self.namespace}_\1.", text) for key, text in need.items()}
                yield self._prefixed(name), texts


def with_included(document: Document, read: Callable[[str, IncludedFile], tuple[LaunchFile, Document]]) -> Document:
    """The launch file with all nodes of the files that its key `include` names, below its own content.

    Its own `after_run` takes the place of theirs.

    Args:
        document: The file with its overlays.
        read: Reads an included file by its namespace and the settings under the key, with its overlays; checked.

    Raises DocumentError with what is wrong with the key, and what `read` raises.
    """
    includes = document.data.get("include", {})
    if not isinstance(includes, dict) or not includes:
        return document  # anything else is found when the file is checked
    findings = []
    included: list[_Included] = []
    for namespace in includes:
        try:
            included.append(_included(document, namespace, read))
        except DocumentError as error:
            findings.append(error)
    raise_any([*findings, *_different_buses(document, included)])
    below = Document({}, {})
    for one in included:
        below = below.overlaid(one.as_document())
    own = {key: value for key, value in document.data.items() if key != "include"}
    if "after_run" in own:  # which judges the whole run
        below.data.pop("after_run_of", None)
    positions = dict(document.positions)
    for key in LISTS:
        entries = [entry for one in included for entry in one.entries(key)]
        if isinstance(own.get(key, []), list):  # anything else is found when the file is checked
            positions |= _moved(document, key, len(entries))
            own[key] = entries + own.get(key, [])
    merged = below.overlaid(Document(own, positions))
    return Document(merged.data, {**merged.positions, (): document.position(())})


def _included(
    document: Document, namespace: str, read: Callable[[str, IncludedFile], tuple[LaunchFile, Document]]
) -> _Included:
    key = ("include", namespace)
    if not is_identifier(namespace) or namespace in NO_NAMESPACES:
        raise document.error(key, f"{namespace!r} is no namespace; expected a name such as left")
    about = document.data["include"][namespace]
    if not isinstance(about, dict):
        raise document.error(key, f"expected a mapping such as '{{launch: dynamixel_arm}}', found {about!r:.80}")
    below = {path[2:]: position for path, position in document.positions.items() if path[:2] == key}
    settings = checked(IncludedFile, Document(about, below))
    file, content = read(namespace, settings)
    for index, name in enumerate(settings.without):
        if name not in file.nodes:
            raise document.error((*key, "without", str(index)), f"{settings.launch} has no node '{name}'")
    if nested := [name for name, node in file.nodes.items() if node.namespace]:
        message = f"{settings.launch} has namespaces of its own ({nested[0]}); a namespace holds no further one"
        raise document.error(key, message)
    return _Included(namespace, frozenset(settings.without), file, content)


def _different_buses(document: Document, included: list[_Included]) -> Iterator[DocumentError]:
    """Keys of the bus that two included files set differently and the including file does not."""
    own = document.data.get("bus")
    for key in ("clock", "lockstep"):
        found = {one.namespace: getattr(one.file.bus, key) for one in included}
        if len(set(found.values())) > 1 and not (isinstance(own, dict) and key in own):
            listed = ", ".join(f"{namespace} {value}" for namespace, value in found.items())
            yield document.error(
                ("include",), f"a run has one bus, but '{key}' differs: {listed}; write it below 'bus'"
            )


def _moved(document: Document, key: str, by: int) -> dict[KeyPath, Position]:
    """Positions of the entries of a list that others stand before."""
    return {
        (key, str(int(path[1]) + by), *path[2:]): position
        for path, position in document.positions.items()
        if path[:1] == (key,) and len(path) > 1
    }
