"""A node that a person starts beside those of a running application."""

from __future__ import annotations

import os
import sys
from pathlib import Path
from typing import NoReturn

from paramove.bus import CLOCK, inspection
from paramove.supervision.application import check
from paramove.supervision.environment import node_environment
from paramove.supervision.launch_file import Launch
from paramove.supervision.run_folder import write_node_file
from paramove.workspace import Workspace

_FOLDER = "joined"
"""In the bus folder, which is removed at the end of the run: configurations of such nodes."""


def join(launch: Launch, workspace: Workspace, folder: Path) -> NoReturn:
    """Turns this process into the one node of a launch file, on the bus of a running application.

    Nothing supervises it: it is not restarted, the application goes on without it, and simulated time does not wait
    for it. Files that it writes go to the current folder.

    Args:
        launch: See `node_alone`.
        workspace: Where the module is found.
        folder: Of the application's bus.

    Raises DocumentError if the node does not exist, or its parameters or topics are wrong.
    """
    check(launch, workspace)
    ((name, node),) = launch.file.nodes.items()
    is_simulated = inspection.publisher_of(folder, CLOCK).alive
    bus = {"folder": str(folder), "clock": "simulated" if is_simulated else "monotonic"}
    file = folder / _FOLDER / f"{name}.yaml"
    file.parent.mkdir(mode=0o700, exist_ok=True)
    write_node_file(file, name, node, bus, Path.cwd())
    environment = node_environment(os.environ, workspace)
    os.chdir(workspace.root)
    os.execve(sys.executable, [sys.executable, "-P", "-m", node.module, "--config", str(file)], environment)
