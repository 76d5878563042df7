"""Launch files: read, overlaid, changed by `--set` and checked; errors have the position in the file and a remedy."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from paramove.bus import topics
from paramove.documents import (
    MAX_CHARACTERS,
    Document,
    DocumentError,
    InputError,
    KeyPath,
    Position,
    checked,
    exit_codes,
    is_identifier,
    nearest,
    raise_any,
    read_mapping,
    read_text,
    read_value,
)
from paramove.supervision.included_files import with_included
from paramove.supervision.launch_schema import IncludedFile, LaunchFile
from paramove.workspace import Workspace

_MODULE = "names joined by dots, such as nodes.camera"
_PATTERNS = {"module": _MODULE, "after_run": _MODULE, "": "a name such as my_node"}
_FOLDER = Path("launch")
SERVO_ARM = "servo_arm"
"""Overlay of a launch file for arms of servos."""


class LaunchFileMissingError(DocumentError):
    """There is no launch file or overlay of that name."""

    exit_code = exit_codes.INPUT_MISSING


@dataclass(frozen=True)
class Launch:
    """A checked launch file: its name, its content, and where each value came from."""

    name: str
    overlays: tuple[str, ...]
    file: LaunchFile
    document: Document
    seed: int | None = None
    headless: bool = False

    def error(self, path: KeyPath, message: str) -> DocumentError:
        """An error at the position in the file of `path`."""
        return self.document.error(path, message)


def load(
    workspace: Workspace,
    name: str,
    overlays: Sequence[str] | None = None,
    settings: Sequence[str] = (),
    seed: int | None = None,
    headless: bool = False,
    robot: str | None = None,
    remaps: Sequence[str] = (),
) -> Launch:
    """Reads `launch/<name>.yaml` with its overlays and settings and checks the result.

    Args:
        workspace: Holds the launch files; overlays lie in `launch/overlays`, those for this launch file alone in a
            folder of its name there.
        name: Of the launch file without `.yaml`, or a path that ends in `.yaml`.
        overlays: Names or paths likewise; None takes the file's `default_overlays`, which are names.
        settings: Each `node.parameter=value`; the value is YAML.
        seed: Written into each of the file's `seed_parameters`.
        headless: Sets the parameters that the file names under `headless`, before `settings`.
        robot: Written into the parameter `robot` of each node for which the files give one, before `settings`. For one
            with a chain of servos the overlay `servo_arm` is laid on top, if the launch file has one, with each
            `servo_arm_NAME` that there is for an overlay NAME.
        remaps: Each `node:topic=topic on the bus`.

    Raises LaunchFileMissingError, or DocumentError with all that is wrong.
    """
    path = _typed(workspace, (_FOLDER,), name, "launch file")
    document, chosen = _with_overlays(workspace, path.stem, _read(path), overlays, robot)
    document = with_included(document, lambda namespace, about: _included(workspace, document, namespace, about))
    document, findings = _with_values(document, settings, seed, headless, overlays is not None, robot)
    document, wrong_remaps = _with_remaps(document, remaps)
    file = _checked(document, findings + wrong_remaps)
    return Launch(Path(name).stem, tuple(chosen), file, document, seed, headless)


def _included(
    workspace: Workspace, including: Document, namespace: str, about: IncludedFile
) -> tuple[LaunchFile, Document]:
    """A launch file that another one includes in a namespace, with its overlays; checked. Raises DocumentError."""
    key = ("include", namespace)
    path = _by_name(workspace, (_FOLDER,), including, (*key, "launch"), about.launch, "a launch file")
    document = _read(path)
    if "include" in document.data:
        raise including.error((*key, "launch"), f"{about.launch} includes others itself; include those instead")
    if about.overlays is not None:
        positions: dict[KeyPath, Position] = {("default_overlays",): including.position((*key, "overlays"))}
        for index in range(len(about.overlays)):
            positions["default_overlays", str(index)] = including.position((*key, "overlays", str(index)))
        document = document.overlaid(Document({"default_overlays": about.overlays}, positions))
    document, _ = _with_overlays(workspace, path.stem, document, None, about.robot)
    document, findings = _with_values(document, (), robot=about.robot)
    return _checked(document, findings), document


def node_alone(
    module: str, name: str = "", settings: Sequence[str] = (), remaps: Sequence[str] = (), namespace: str = ""
) -> Launch:
    """A launch file of one node, whose end is the end of the run and which may miss the publishers of its topics.

    Args:
        module: Such as nodes.camera.
        name: Of the node; default: the last part of the module.
        settings: Each `parameter=value`; the value is YAML.
        remaps: Each `topic=topic on the bus`.
        namespace: Of its topics, and the begin of its default name.

    Raises DocumentError with all that is wrong.
    """
    name = name or "_".join(filter(None, (namespace, module.rpartition(".")[2])))
    node = {"module": module, "optional_topics": ["*"], "ends_run": True, "namespace": namespace}
    document = Document({"nodes": {name: node}}, {(): Position(module)})
    document, findings = _with_values(document, [f"{name}.{setting}" for setting in settings])
    document, wrong_remaps = _with_remaps(document, [f"{name}:{remap}" for remap in remaps])
    return Launch(name, (), _checked(document, findings + wrong_remaps), document)


def _checked(document: Document, findings: list[DocumentError]) -> LaunchFile:
    """The document as a launch file; raises DocumentError with the findings so far and its own."""
    try:
        file = validated(document)
    except DocumentError as error:
        findings = [*findings, error]
    raise_any([*findings, *_wrong_references(document)])
    return file


def _with_overlays(
    workspace: Workspace, name: str, document: Document, overlays: Sequence[str] | None, robot: str | None
) -> tuple[Document, list[str]]:
    """The document with its overlays, and their names; raises DocumentError with what is wrong in any of them."""
    folders = overlay_folders(name)
    if overlays is None:
        chosen, findings = _default_overlays(workspace, folders, document)
    else:
        chosen = {overlay: _typed(workspace, folders, overlay, "overlay") for overlay in overlays}
        findings = []
    if robot is not None and SERVO_ARM in workspace.names(folders[0]) and _has_chain(workspace, robot):
        names = [SERVO_ARM, *(f"{SERVO_ARM}_{overlay}" for overlay in chosen)]
        chosen |= {name: path for name in names if (path := _named(workspace, folders, name)).is_file()}
    laid_on = dict[str, Path]()
    for overlay, path in chosen.items():
        try:
            for top in _overlay(workspace, folders, overlay, path, laid_on):
                raise_any(list(_left_out_in_vain(document, top)))
                document = document.overlaid(top)
        except DocumentError as error:
            findings.append(error)
    raise_any(findings)
    return document, list(laid_on)


def _left_out_in_vain(document: Document, top: Document) -> Iterator[DocumentError]:
    """Nodes that an overlay removes from a document without them."""
    nodes = _mapping_at(document, "nodes")
    for name, node in _mapping_at(top, "nodes").items():
        if node is None and name not in nodes:
            remedy = nearest(name, nodes)
            if document.data.get("include"):
                remedy = "a node of an included file is left out by 'include: {NAMESPACE: {without: [NODE]}}'"
            yield top.error(("nodes", name), f"there is no node '{name}' to leave out; {remedy}")


def _default_overlays(
    workspace: Workspace, folders: Sequence[Path], document: Document
) -> tuple[dict[str, Path], list[DocumentError]]:
    """Name and file of each overlay that a launch file has without `--with`, and what is wrong with them."""
    names = document.data.get("default_overlays", [])
    if not isinstance(names, list) or not all(isinstance(overlay, str) for overlay in names):
        raise document.error(("default_overlays",), f"expected a list of names of overlays, found {names!r:.80}")
    chosen, findings = {}, []
    for index, overlay in enumerate(names):
        try:
            chosen[overlay] = _by_name(workspace, folders, document, ("default_overlays", str(index)), overlay)
        except DocumentError as error:
            findings.append(error)
    return chosen, findings


def _by_name(
    workspace: Workspace, folders: Sequence[Path], document: Document, key: KeyPath, name: str, kind: str = "an overlay"
) -> Path:
    """File of an overlay or a launch file that a file names; raises DocumentError."""
    if not is_identifier(name):
        raise document.error(key, f"{name!r}: expected the plain name of {kind} in {folders[-1]}, no path")
    path = _named(workspace, folders, name)
    if not path.is_file():
        message = f"there is no {kind.partition(' ')[2]} '{name}' ({path}); {nearest(name, _known(workspace, folders))}"
        raise document.error(key, message)
    return path


def _overlay(
    workspace: Workspace,
    folders: Sequence[Path],
    name: str,
    path: Path,
    laid_on: dict[str, Path],
    above: tuple[str, ...] = (),
) -> Iterator[Document]:
    """An overlay, after those that its key `over` names: they are laid below it.

    Args:
        workspace, folders: Where overlays are.
        name, path: Of the overlay.
        laid_on: Those that have been laid on before; each is laid on once.
        above: Names of those that lie over it.

    Raises DocumentError for an overlay that cannot be read, names one that there is not, or lies over itself.
    """
    if path in laid_on.values():
        return
    document = _read(path)
    if "default_overlays" in document.data:
        message = "an overlay has no default overlays; those that belong below it are named by its key 'over'"
        raise document.error(("default_overlays",), message)
    below = document.data.pop("over", [])
    if not isinstance(below, list) or not all(isinstance(other, str) for other in below):
        raise document.error(("over",), f"expected a list of names of overlays, found {below!r:.80}")
    for index, other in enumerate(below):
        key = ("over", str(index))
        if other in (*above, name):
            raise document.error(key, f"'{other}' would lie over itself: {' over '.join((*above, name, other))}")
        beneath = _by_name(workspace, folders, document, key, other)
        yield from _overlay(workspace, folders, other, beneath, laid_on, (*above, name))
    laid_on[name] = path
    yield document


def _with_values(
    document: Document,
    settings: Sequence[str],
    seed: int | None = None,
    headless: bool = False,
    named: bool = False,
    robot: str | None = None,
) -> tuple[Document, list[DocumentError]]:
    """The document with the values that `--headless`, `--robot`, `--set` and `--seed` give, and the errors in these.

    Args:
        document: Launch file with its overlays.
        settings: Each `node.parameter=value`; the value is YAML.
        seed: Written into each of the file's `seed_parameters`.
        headless: Sets the parameters that the file names under `headless`, before `settings`.
        named: Whether the overlays were named by `--with`.
        robot: Written into the parameter `robot` of each node for which the files give one, before `settings`.
    """
    findings: list[DocumentError] = []
    values: list[tuple[str, Any, Position]] = []
    if headless:
        for target, value in _mapping_at(document, "headless").items():
            values.append((target, value, document.position(("headless", target))))
    if robot is not None:
        where = Position(f"--robot {robot}")
        robots = [node for node in _mapping_at(document, "nodes") if _value_at(document, node, ["robot"]) is not None]
        if not robots:
            findings.append(DocumentError(where, "no node of this launch file names a robot, so none can be replaced"))
        values += [(f"{node}.robot", robot, where) for node in robots]
    for setting in map(topics.present_names, settings):
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
        targets = _list_at(document, "seed_parameters")
        if not targets:
            message = "this launch file has no 'seed_parameters', so nothing in it takes a seed"
            findings.append(DocumentError(where, message))
        values += [(str(target), seed, where) for target in targets]
    for target, value, where in values:
        node, *parameters = target.split(".")
        nodes = _mapping_at(document, "nodes")
        if node not in nodes:
            findings.append(DocumentError(where, f"there is no node '{node}'; {nearest(node, nodes)}"))
        elif (
            where.source.startswith("--set")
            and target in _list_at(document, "connections")
            and not (named and _value_at(document, node, parameters))
        ):
            message = f"select an overlay that sets what is connected there, such as --with real --set {target}=..."
            findings.append(DocumentError(where, message))
        elif all(parameters) and parameters:  # otherwise `_wrong_references` reports it
            document = document.overlaid(_parameter(node, parameters, value, where))
    return document, findings


def _with_remaps(document: Document, remaps: Sequence[str]) -> tuple[Document, list[DocumentError]]:
    """The document with the remaps of the command line, each `node:topic=topic on the bus`, and the errors in these."""
    findings = []
    nodes = _mapping_at(document, "nodes")
    for remap in map(topics.present_names, remaps):
        where = Position(f"--remap {remap}")
        node, colon, names = remap.partition(":")
        topic, equals, target = names.partition("=")
        if not (node and colon and topic and equals and target):
            message = "expected node:topic=topic, such as recognizer:objects/tracked=left/objects"
            findings.append(DocumentError(where, message))
        elif node not in nodes:
            findings.append(DocumentError(where, f"there is no node '{node}'; {nearest(node, nodes)}"))
        else:
            path = ("nodes", node, "remaps", topic)
            document = document.overlaid(Document({"nodes": {node: {"remaps": {topic: target}}}}, {path: where}))
    return document, findings


def _mapping_at(document: Document, key: str) -> dict[str, Any]:
    """A mapping at the top level; empty where there is something else, which `validated` reports."""
    value = document.data.get(key)
    return value if isinstance(value, dict) else {}


def _list_at(document: Document, key: str) -> list[Any]:
    """A list at the top level, likewise."""
    value = document.data.get(key)
    return value if isinstance(value, list) else []


def _value_at(document: Document, node: str, parameters: Sequence[str]) -> Any:
    value: Any = _mapping_at(document, "nodes")[node]
    for key in ("parameters", *parameters):
        value = value.get(key) if isinstance(value, dict) else None
    return value


def _parameter(node: str, parameters: Sequence[str], value: Any, where: Position) -> Document:
    path = ("nodes", node, "parameters", *parameters)
    data: Any = value
    for key in reversed(path):
        data = {key: data}
    return Document(data, {path: where})


def _wrong_references(document: Document) -> Iterator[DocumentError]:
    """References to missing names, and cycles of `after`; works on a file with other errors, too."""
    nodes = _mapping_at(document, "nodes")
    after = {name: _after(node) for name, node in nodes.items()}
    for name, others in after.items():
        for index, other in enumerate(others):
            if other not in nodes:
                message = f"'{name}' is started after '{other}', which is not a node; {nearest(other, nodes)}"
                yield document.error(("nodes", name, "after", str(index)), message)
    for cycle in _cycles(after):
        message = f"these nodes wait for each other ('after'): {', '.join(cycle)}"
        yield document.error(("nodes", cycle[0], "after"), message)
    targets: list[tuple[str, str, Any]] = [
        (key, str(index), target)
        for key in ("seed_parameters", "connections")
        for index, target in enumerate(_list_at(document, key))
    ]
    targets += [("headless", target, target) for target in _mapping_at(document, "headless")]
    for key, index_or_name, target in targets:
        node, *parameters = str(target).split(".")
        if node not in nodes or not parameters or not all(parameters):
            remedy = f"write {node}.<parameter>" if node in nodes else nearest(node, nodes)
            yield document.error((key, index_or_name), f"'{target}' is not a node.parameter; {remedy}")


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


def validated(document: Document) -> LaunchFile:
    """The document as a `LaunchFile`; raises DocumentError with every finding, one per line."""
    return checked(LaunchFile, document, _PATTERNS)


def overlay_folders(launch: str) -> tuple[Path, Path]:
    """Folders of a workspace with the overlays of a launch file: those for it alone, and those for all."""
    return _FOLDER / "overlays" / launch, _FOLDER / "overlays"


def _has_chain(workspace: Workspace, robot: str) -> bool:
    """Whether a robot, named by its folder, is an arm of servos. One that cannot be read is rejected by its nodes."""
    folder = Path(robot)
    if not folder.exists() and not folder.is_absolute():
        folder = workspace.find(folder if len(folder.parts) > 1 else Path("robot_description", folder))
    try:
        return "chain" in read_mapping(read_text(folder / "robot.yaml", "robot description"), robot).data
    except InputError:
        return False


def _named(workspace: Workspace, folders: Sequence[Path], name: str) -> Path:
    """The file of this name in the first of the folders that has one; in the last where none has."""
    paths = [workspace.find(folder / f"{name}.yaml") for folder in folders]
    return next((path for path in paths if path.is_file()), paths[-1])


def _known(workspace: Workspace, folders: Sequence[Path]) -> list[str]:
    return list(dict.fromkeys(name for folder in folders for name in workspace.names(folder)))


def _typed(workspace: Workspace, folders: Sequence[Path], name: str, kind: str) -> Path:
    """File of a launch file or overlay named on the command line; raises LaunchFileMissingError."""
    if name.endswith(".yaml"):
        path = Path(name)
    elif is_identifier(name):
        path = _named(workspace, folders, name)
    else:
        raise LaunchFileMissingError(
            Position(name), f"not a name of a {kind}: expected letters, digits, '_', or a *.yaml"
        )
    if not path.is_file():
        message = f"there is no such {kind}; {nearest(path.stem, _known(workspace, folders))}"
        raise LaunchFileMissingError(Position(str(path)), message)
    return path


def _read(path: Path) -> Document:
    try:
        text = read_text(path, "launch file", max_bytes=4 * MAX_CHARACTERS)
    except InputError as error:
        raise DocumentError(Position(str(path)), str(error).removeprefix(f"{path}: ")) from error
    return read_mapping(topics.present_names(text), str(path))
