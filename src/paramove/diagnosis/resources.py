"""Whether folders can be written and are short enough for sockets, and whether disk and open files suffice."""

from __future__ import annotations

import os
import re
import resource
import shlex
import shutil
import stat
import tempfile
from collections.abc import Iterator, Mapping
from functools import partial
from pathlib import Path

from platformdirs import user_cache_path

from paramove.bus import default_folder
from paramove.diagnosis.finding import Finding, Fix, Level, Machine, as_root
from paramove.supervision import (
    DEFAULT_DOMAIN,
    LONGEST_FOLDER,
    NICE,
    OPEN_FILES,
    DomainError,
    check_name,
    examined,
)
from paramove.workspace import Workspace

LITTLE_BYTES, FEW_BYTES = 1_000_000_000, 5_000_000_000
"""Free on a disk: less than the first is a problem, as a run of the demo records 0.5 GB and more; less than the second
is a warning."""
SYS_NICE = 23
"""Number of the capability, of capability.h."""


def resources_findings(machine: Machine) -> Iterator[Finding]:
    """Of folders, disks, limits, and variables of the environment."""
    workspace = Workspace.at(machine.folder)
    folders = {"cache": user_cache_path("paramove"), "temporary": Path(tempfile.gettempdir())}
    folders["runs"] = workspace.root / "runs"
    for name, folder in folders.items():
        yield folder_finding(name, folder)
    yield sockets_finding()
    yield from disk_findings(folders)
    yield open_files_finding(resource.getrlimit(resource.RLIMIT_NOFILE)[1])
    yield priority_finding(may_set_any_priority(), resource.getrlimit(resource.RLIMIT_NICE)[0])
    yield from environment_findings(workspace)


def folder_finding(name: str, folder: Path) -> Finding:
    """Whether something can be written into a folder, or it can be made."""
    subject, facts = f"{name} folder", {"folder": str(folder)}
    there = _nearest(folder)
    if there.is_dir() and os.access(there, os.W_OK | os.X_OK):
        return Finding(subject, Level.OK, f"{folder} can be written", facts=facts)
    status = there.stat()
    if not there.is_dir():
        message = f"{there} is no folder"
        own = there.is_file() and _is_in_own_folder(there)
        remedy = shlex.join(["mv", str(there), f"{there}.old"]) if own else _another(name)
        return Finding(subject, Level.PROBLEM, message, (remedy,), facts=facts)
    message = f"{there} cannot be written by this user"
    if status.st_uid == os.geteuid():
        mode = stat.S_IMODE(status.st_mode) | stat.S_IRWXU
        command = shlex.join(["chmod", "u+rwx", str(there)])
        fix = Fix(f"run {command}", partial(there.chmod, mode))
        return Finding(subject, Level.PROBLEM, message, (command,), fix, facts)
    own = there == folder and _is_in_own_folder(there)  # made by this user's command as root, such as by sudo
    remedy = as_root(f"chown -R {os.geteuid()} {shlex.quote(str(there))}") if own else _another(name)
    return Finding(subject, Level.PROBLEM, message, (remedy,), facts=facts)


def _is_in_own_folder(path: Path) -> bool:
    """Whether it is no link and lies in a folder of this user, so that this user's programs made it."""
    return not path.is_symlink() and path.parent.stat().st_uid == os.geteuid()


def _another(name: str) -> str:
    """How to use another folder, where the present one is not this user's to change."""
    folder = shlex.quote(str(Path(tempfile.gettempdir()) / f"paramove-{os.geteuid()}"))
    if name == "runs":
        return "change into a folder of yours, or name one: paramove launch NAME --runs FOLDER"
    variable = "TMPDIR" if name == "temporary" else "XDG_CACHE_HOME"
    return f"mkdir -m 700 -p {folder} && export {variable}={folder}"


def sockets_finding() -> Finding:
    """Whether the sockets of a run can be in the folder that the environment names."""
    subject, name = "sockets folder", os.environ.get("PARAMOVE_DOMAIN") or DEFAULT_DOMAIN
    own = ("mkdir -p -m 700 /tmp/r-$USER && export XDG_RUNTIME_DIR=/tmp/r-$USER",)
    try:
        check_name(name)
    except DomainError as error:
        return Finding(subject, Level.PROBLEM, str(error), ("unset PARAMOVE_DOMAIN",))
    folder = default_folder(name)
    facts = {"folder": str(folder)}
    size = len(os.fsencode(folder))
    if size > LONGEST_FOLDER:
        message = f"{folder} is too long for sockets: {size} bytes, allowed {LONGEST_FOLDER}"
        return Finding(subject, Level.PROBLEM, message, own, facts=facts)
    above = folder.parent
    if above.is_symlink() or (above.exists() and above.stat().st_uid != os.geteuid()):
        return Finding(subject, Level.PROBLEM, f"{above} is no folder of this user", own, facts=facts)
    finding = folder_finding("sockets", folder)
    if finding.level is Level.OK:
        return Finding(subject, Level.OK, f"{folder} can be written, and is short enough", facts=facts)
    return Finding(subject, finding.level, finding.detail, (*finding.remedy, *own), finding.fix, facts)


def disk_findings(folders: Mapping[str, Path]) -> Iterator[Finding]:
    """Free bytes of each disk on which one of the folders lies."""
    checked = set[int]()
    for name, folder in folders.items():
        there = _nearest(folder)
        if (number := there.stat().st_dev) not in checked:
            checked.add(number)
            yield disk_finding(name, there, shutil.disk_usage(there).free)


def disk_finding(name: str, folder: Path, free_bytes: int) -> Finding:
    """Whether a run has room on the disk of a folder."""
    message = f"{free_bytes / 1e9:.1f} GB free on the disk of {folder} ({name})"
    facts = {"folder": str(folder), "free_bytes": free_bytes}
    if free_bytes >= FEW_BYTES:
        return Finding("disk", Level.OK, message, facts=facts)
    remedy = (
        f"du -xh --max-depth=2 {folder} | sort -h | tail",
        "remove what is not needed, such as old folders in runs/",
    )
    level = Level.PROBLEM if free_bytes < LITTLE_BYTES else Level.WARNING
    return Finding("disk", level, f"only {message}", remedy, facts=facts)


def open_files_finding(hard_limit: int) -> Finding:
    """Whether a run may have enough files open; below the hard limit `paramove launch` raises its own."""
    if hard_limit == resource.RLIM_INFINITY or hard_limit >= OPEN_FILES:
        allowed = "any number" if hard_limit == resource.RLIM_INFINITY else str(hard_limit)
        return Finding("open files", Level.OK, f"a process may have {allowed} open", facts={"hard_limit": hard_limit})
    message = f"a process may have {hard_limit} files open, a run needs {OPEN_FILES}"
    line = f"echo '*  -  nofile  {4 * OPEN_FILES}' | {as_root('tee')} /etc/security/limits.d/paramove.conf"
    return Finding("open files", Level.PROBLEM, message, (line, "log out and in again"))


def may_set_any_priority(status: Path = Path("/proc/self/status")) -> bool:
    """Whether this process may give another any priority, as root may (the capability SYS_NICE)."""
    capabilities = re.search(r"^CapEff:\s*([0-9a-f]+)$", status.read_text(encoding="utf-8"), re.MULTILINE)
    return capabilities is not None and bool(int(capabilities[1], 16) >> SYS_NICE & 1)


def priority_finding(may_set_any: bool, limit: int) -> Finding:
    """Whether the launcher may give a node `priority: high`; the kernel's limit is 20 less the lowest nice value."""
    facts = {"limit": limit}
    if may_set_any or limit == resource.RLIM_INFINITY or limit >= 20 - NICE["high"]:
        return Finding("priority", Level.OK, "the arm's driver may come before other programs", facts=facts)
    message = "the arm's driver may not come before other programs: a stop takes longer while both are busy"
    if os.geteuid() == 0:  # of a container
        return Finding(
            "priority", Level.WARNING, message, ("start the container with --cap-add SYS_NICE",), facts=facts
        )
    line = f"echo $(id -un) - nice {NICE['high']} | {as_root('tee')} /etc/security/limits.d/paramove-priority.conf"
    return Finding("priority", Level.WARNING, message, (line, "log out and in again"), facts=facts)


def environment_findings(workspace: Workspace) -> Iterator[Finding]:
    """Variables and folders that a run in this workspace ignores or that disturb it."""
    try:
        notes = examined(os.environ, workspace).notes
    except DomainError:  # reported with the sockets
        return
    for note in notes:
        yield Finding("environment", Level.WARNING, note)
    if not notes:
        yield Finding("environment", Level.OK, "no variable disturbs a run")


def _nearest(folder: Path) -> Path:
    """The folder, or the nearest above it that exists."""
    return next((one for one in (folder, *folder.parents) if os.path.exists(one)), Path("/"))
