"""A launch whose driver and emulator share the process of a test."""

import os

import psutil

from paramove.robots.this_launch import ThisLaunch


class OneProcessLaunch(ThisLaunch):
    """Takes this process, and those that it has started, for emulators, without a look at their code."""

    def _why_no_emulator(self, pid: int) -> str:
        started = self.launcher in (pid, *(parent.pid for parent in psutil.Process(pid).parents()))
        return "" if started else "was not started by the launcher of this run"


HERE = OneProcessLaunch(os.getpid())
