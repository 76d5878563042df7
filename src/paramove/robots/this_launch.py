"""Whether a robot is emulated by the very launch that its driver belongs to: only then a program may arm it.

The evidence comes from the system, never from a parameter: who has started this process, who holds the other end of a
pseudo-terminal, who owns a topic.
"""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path

from paramove.bus import BusSettings, is_first_start, lock_of, owner_of, socket_path, topics
from paramove.devices import opened_files, serving
from paramove.robots.emulator_process import why_no_emulator

PSEUDO_TERMINALS = Path("/dev/pts")
SERIAL_PORTS = "/dev/tty"
BY_HAND = "its driver was started by hand, not by a launch"
RESTARTED = "its driver has been restarted"


@dataclass(frozen=True)
class ThisLaunch:
    """The launch that this process belongs to.

    Attributes:
        launcher: Its process id; None: this process was started by hand.
        restarted: Whether another process of this node ran before in this launch.
    """

    launcher: int | None = None
    restarted: bool = False

    @classmethod
    def of(cls, settings: BusSettings) -> ThisLaunch:
        """That of this process: its parent is the launcher if it holds the lock of the bus folder."""
        parent = os.getppid()
        if str(lock_of(settings.folder.resolve())) not in opened_files(parent).values():
            return cls()
        return cls(parent, not is_first_start())

    def why_not_servos(self, port: Path) -> str:
        """Why a serial port does not lead to servos that this launch emulates; "" if it does.

        It does if the port is a pseudo-terminal whose other end is held by emulators alone that this launch has
        started, and by none that has a real serial port open, to which it could pass on what it receives.
        """
        device = port.resolve()
        if self.launcher is None:
            return BY_HAND
        if device.parent != PSEUDO_TERMINALS:
            return f"{device} is no pseudo-terminal"
        servers = serving(device)
        if not servers:
            return f"no process holds the other end of {device}"
        for server in servers:
            if reason := self._why_no_emulator(server.pid):
                return f"{server} at the other end of {device} {reason}"
            if any(_is_serial_port(name) for name in opened_files(server.pid).values()):
                return f"{server} at the other end of {device} has a serial port open"
        return ""

    def why_no_program(self, settings: BusSettings) -> str:
        """Why no program may arm HOAP-3: this launch does not simulate it, or has restarted its driver.

        It is simulated if the process that publishes its state is a simulator that this launch has started, and makes
        the time of the run.
        """
        if self.launcher is None or self.restarted:
            return RESTARTED if self.restarted else BY_HAND
        names = [settings.name_of(topic) for topic in (topics.WIRE_HOAP3_STATE, topics.CLOCK)]
        robot, clock = (owner_of(socket_path(settings.folder, name)) for name in names)
        if robot is None or robot != clock:
            return f"the process that publishes {names[0]} does not publish {names[1]}, as a simulator does"
        reason = self._why_no_emulator(robot)
        return f"pid {robot}, which publishes {names[0]}, {reason}" if reason else ""

    def _why_no_emulator(self, pid: int) -> str:
        return BY_HAND if self.launcher is None else why_no_emulator(pid, self.launcher)


def _is_serial_port(name: str) -> bool:
    return name.startswith(SERIAL_PORTS) and not name.removeprefix(SERIAL_PORTS).isdecimal() and name != SERIAL_PORTS
