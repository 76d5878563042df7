"""What a run must not leave behind: processes, sockets, held locks."""

from __future__ import annotations

import contextlib
import fcntl
import os
from pathlib import Path

import psutil

from paramove.bus import is_alive


def processes_of(domain: str) -> list[tuple[int, str]]:
    """Id and command of living processes whose environment names the domain.

    Zombies do not count.
    """
    processes = []
    for process in psutil.process_iter():
        with contextlib.suppress(psutil.Error, OSError):  # it has just ended
            named = process.environ().get("PARAMOVE_DOMAIN") == domain and process.pid != os.getpid()
            if named and process.status() not in (psutil.STATUS_ZOMBIE, psutil.STATUS_DEAD):
                processes.append((process.pid, " ".join(process.cmdline()[1:4])))
    return processes


def left_over(domain: str, runtime: Path) -> list[str]:
    """Messages on what is left of a run that has ended: processes, open sockets, locks that are held.

    Args:
        domain: Of the run.
        runtime: Folder above the domain's.
    """
    messages = [f"process {pid} ({command})" for pid, command in processes_of(domain)]
    folders = [runtime / domain, runtime / f"truth-{domain}"]
    with contextlib.suppress(FileNotFoundError):
        folders[1].chmod(0o700)  # it cannot be listed while a run goes on
    # A folder that vanishes meanwhile is passed over, as `rglob` does not.
    files = [Path(top) / name for folder in folders for top, _, names in os.walk(folder) for name in names]
    files.append(runtime / f"{domain}.lock")
    for path in files:
        if path.is_socket() and is_alive(path):
            messages.append(f"socket {path.name} is open")
        elif path.suffix == ".lock" and _held(path):
            messages.append(f"lock {path.name} is held")
    return messages


def _held(path: Path) -> bool:
    try:
        with path.open("r+b") as file:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return True
    except OSError:
        return False
    return False
