"""What the operating system has to allow a run, looked at before anything starts."""

from __future__ import annotations

import resource

OPEN_FILES = 256
"""A node has two or three for each topic; the recorder, which hears nearly all, about a hundred."""


class LimitError(RuntimeError):
    """The operating system allows less than a run needs; the text says how to raise the limit."""


def allow_open_files(needed: int = OPEN_FILES) -> None:
    """Raises this process's limit of open files if it is too low; nodes inherit it.

    Raises LimitError if the hard limit, which only a privileged user raises, is too low.
    """
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    if soft == resource.RLIM_INFINITY or soft >= needed:
        return
    if hard != resource.RLIM_INFINITY and hard < needed:
        raise LimitError(
            f"a process may have {soft} files open here (hard limit {hard}), a run needs {needed}; raise the limit: "
            f"`ulimit -Hn {needed}` as root, `nofile` in /etc/security/limits.conf, or LimitNOFILE= of the service"
        )
    resource.setrlimit(resource.RLIMIT_NOFILE, (needed, hard))
