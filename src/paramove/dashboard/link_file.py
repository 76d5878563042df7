"""`live_page.json` in the run's folder: the link for a person, and what the next process of the page needs.

Only its owner may read it (mode 0600). All secrets end with the process. The next one, after a failure or a step of
setting up, takes the same port if it is free, and the key that the file holds as `next_key`. Connected browsers were
given that key over the socket once both sides had proved themselves, so they follow; it was in no link, cookie, storage
or request before, so nobody else has it. When the page has ended for good the file is removed.
"""

from __future__ import annotations

import json
import logging
import os
import secrets
from dataclasses import dataclass, field, replace
from pathlib import Path

from paramove.dashboard.access import Secrets
from paramove.documents import replacing

_log = logging.getLogger(__name__)

NAME = "live_page.json"


def _secret() -> str:
    return secrets.token_urlsafe(24)


@dataclass(frozen=True)
class LinkFile:
    """Content of the file.

    Attributes:
        path: Of the file.
        port: Where the page listens.
        secrets: Of this process of the page.
        next_key: The key of the next process.
    """

    path: Path
    port: int
    secrets: Secrets
    next_key: str = field(repr=False)

    @property
    def link(self) -> str:
        """Link to open in a browser; works once."""
        return f"http://127.0.0.1:{self.port}/?token={self.secrets.token}"

    @classmethod
    def following(cls, folder: Path, port: int) -> LinkFile:
        """That of the process that follows the one which wrote the file, else of the first; not written yet."""
        stored, key = _content(folder), _secret()
        stored_port, stored_key = stored.get("port"), stored.get("next_key")
        if isinstance(stored_port, int) and isinstance(stored_key, str) and len(stored_key) == len(key):
            port, key = stored_port, stored_key
        return cls(folder / NAME, port, Secrets(_secret(), _secret(), key), _secret())

    def at(self, port: int) -> LinkFile:
        """The same at another port."""
        return replace(self, port=port)

    def with_fresh_token(self) -> LinkFile:
        """The same with a token that was never used."""
        return replace(self, secrets=replace(self.secrets, token=_secret()))

    def write(self) -> None:
        """Writes the file at once and whole. On a full disk there is none: what an older one says is over."""
        content = {"link": self.link, "port": self.port, "next_key": self.next_key, "pid": os.getpid()}
        try:
            with replacing(self.path, 0o600) as unfinished:
                unfinished.write_text(json.dumps(content, indent=1), encoding="utf-8")
        except OSError as error:
            self.remove()
            _log.warning("%s cannot be written: %s", self.path, error.strerror)

    def remove(self) -> None:
        """Removes the file."""
        self.path.unlink(missing_ok=True)


def link_in(folder: Path) -> str:
    """The link of the page of a run; "" while there is none."""
    return str(_content(folder).get("link", ""))


def process_in(folder: Path) -> int:
    """Process id of the page of a run; 0 while there is none. Each process has links of its own."""
    pid = _content(folder).get("pid", 0)
    return pid if isinstance(pid, int) else 0


def _content(folder: Path) -> dict[str, object]:
    try:
        content = json.loads((folder / NAME).read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return {}
    return content if isinstance(content, dict) else {}
