"""References to nodes by name in a launch file and on the command line: values set, and names that must exist."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from paramove.documents import Document, DocumentError, Position, nearest, read_value

Findings = list[DocumentError]


def with_values(
    document: Document,
    settings: Sequence[str],
    seed: int | None,
    headless: bool,
    named: bool,
    robot: str | None,
) -> tuple[Document, Findings]:
    """The document with the values that `--headless`, `--robot`, `--set` and `--seed` give, and the errors in these.

    Args:
        document: Launch file with its overlays.
        settings: Each `node.parameter=value`; the value is YAML.
        seed: Written into each of the file's `seed_parameters`.
        headless: Sets the parameters that the file names under `headless`, before `settings`.
        named: Whether the overlays were named by `--with`.
        robot: Written into the parameter `robot` of each node for which the files give one, before `settings`.
    """
    findings: Findings = []
    values: list[tuple[str, Any, Position]] = []
    if headless and isinstance(document.data.get("headless"), dict):
        for target, value in document.data["headless"].items():
            values.append((target, value, document.position(("headless", target))))
    if robot is not None:
        where = Position(f"--robot {robot}")
        robots = [node for node in _nodes(document) if _value_at(document, node, ["robot"]) is not None]
        if not robots:
            findings.append(DocumentError(where, "no node of this launch file names a robot, so none can be replaced"))
        values += [(f"{node}.robot", robot, where) for node in robots]
    for setting in settings:
        where = Position(f"--set {setting}")
        target, equals, text = setting.partition("=")
        if not equals or not all(target.strip().split(".")) or "." not in target:
            findings.append(DocumentError(where, "expected node.parameter=value, such as simulator.seed=7"))
            continue
        try:
            values.append((target.strip(), read_value(text, str(where)), where))
        except DocumentError as error:
            findings.append(error)
    if seed is not None:
        where = Position(f"--seed {seed}")
        targets = document.data.get("seed_parameters")
        if not targets or not isinstance(targets, list):
            message = "this launch file has no 'seed_parameters', so nothing in it takes a seed"
            findings.append(DocumentError(where, message))
            targets = []
        values += [(str(target), seed, where) for target in targets]
    for target, value, where in values:
        node, *parameters = target.split(".")
        if node not in _nodes(document):
            findings.append(DocumentError(where, f"there is no node '{node}'; {nearest(node, _nodes(document))}"))
        elif (
            where.source.startswith("--set")
            and _is_connection(document, target)
            and not (named and _value_at(document, node, parameters))
        ):
            message = f"select an overlay that sets what is connected there, such as --with real --set {target}=..."
            findings.append(DocumentError(where, message))
        elif all(parameters) and parameters:  # otherwise `wrong_references` reports it
            document = document.overlaid(_parameter(node, parameters, value, where))
    return document, findings


def _is_connection(document: Document, target: str) -> bool:
    connections = document.data.get("connections")
    return isinstance(connections, list) and target in connections


def _value_at(document: Document, node: str, parameters: Sequence[str]) -> Any:
    value: Any = _nodes(document)[node]
    for key in ("parameters", *parameters):
        value = value.get(key) if isinstance(value, dict) else None
    return value


def _parameter(node: str, parameters: Sequence[str], value: Any, where: Position) -> Document:
    path = ("nodes", node, "parameters", *parameters)
    data: Any = value
    for key in reversed(path):
        data = {key: data}
    return Document(data, {path: where})


def _nodes(document: Document) -> dict[str, Any]:
    nodes = document.data.get("nodes")
    return nodes if isinstance(nodes, dict) else {}


def wrong_references(document: Document) -> Findings:
    """References to missing names, and cycles of `after`; works on a file with other errors, too."""
    findings: Findings = []
    nodes = _nodes(document)
    after = {name: _after(node) for name, node in nodes.items()}
    for name, others in after.items():
        for index, other in enumerate(others):
            if other not in nodes:
                path = ("nodes", name, "after", str(index))
                findings.append(
                    document.error(
                        path, f"'{name}' is started after '{other}', which is not a node; {nearest(other, nodes)}"
                    )
                )
    for cycle in _cycles(after):
        where = ("nodes", cycle[0], "after")
        findings.append(document.error(where, f"these nodes wait for each other ('after'): {', '.join(cycle)}"))
    headless = document.data.get("headless")
    targets: list[tuple[str, str, Any]] = [
        (key, str(index), target)
        for key in ("seed_parameters", "connections")
        for index, target in enumerate(document.data[key] if isinstance(document.data.get(key), list) else ())
    ]
    targets += [("headless", target, target) for target in (headless if isinstance(headless, dict) else ())]
    for key, index_or_name, target in targets:
        node, *parameters = str(target).split(".")
        if node not in nodes or not parameters or not all(parameters):
            remedy = f"write {node}.<parameter>" if node in nodes else nearest(node, nodes)
            message = f"'{target}' is not a node.parameter; {remedy}"
            findings.append(document.error((key, index_or_name), message))
    return findings


def _after(node: Any) -> list[str]:
    after = node.get("after") if isinstance(node, dict) else None
    return [other for other in after if isinstance(other, str)] if isinstance(after, list) else []


def _cycles(after: dict[str, list[str]]) -> list[tuple[str, ...]]:
    """Nodes that wait for themselves, directly or through others; each cycle once, in the order of the file."""
    before = {name: set(others) for name, others in after.items()}
    for middle in after:  # Warshall's transitive closure
        for name in after:
            if middle in before[name]:
                before[name] |= before[middle]
    waiting = [name for name in after if name in before[name]]
    cycles = [tuple(other for other in waiting if other in before[name] and name in before[other]) for name in waiting]
    return list(dict.fromkeys(cycles))
