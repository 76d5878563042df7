"""`live_page.json` in the run's folder: the link for a person, and what a page needs to restart after a failure.

Only its owner may read it (mode 0600). With the same port, session and key a restarted page answers the browsers that
were connected before. The secrets are useless once the page has ended; the file is then removed.
"""

from __future__ import annotations

import json
import logging
import secrets
from dataclasses import dataclass, replace
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
        secrets: Of the page.
    """

    path: Path
    port: int
    secrets: Secrets

    @property
    def link(self) -> str:
        """Link to open in a browser; works once."""
        return f"http://127.0.0.1:{self.port}/?token={self.secrets.token}"

    @classmethod
    def stored_or_new(cls, folder: Path, port: int) -> LinkFile:
        """The file of a page that ran before in this run, else a new one that is not written yet."""
        path = folder / NAME
        try:
            stored = json.loads(path.read_text(encoding="utf-8"))
            return cls(
                path, int(stored["port"]), Secrets(str(stored["token"]), str(stored["session"]), str(stored["key"]))
            )
        except (OSError, ValueError, KeyError, TypeError):
            return cls(path, port, Secrets(_secret(), _secret(), _secret()))

    def at(self, port: int) -> LinkFile:
        """The same at another port."""
        return replace(self, port=port)

    def with_fresh_token(self) -> LinkFile:
        """The same with a token that was never used."""
        return replace(self, secrets=replace(self.secrets, token=_secret()))

    def write(self) -> None:
        """Writes the file at once and whole. On a full disk the file stays as it was."""
        content = {
            "link": self.link,
            "port": self.port,
            "token": self.secrets.token,
            "session": self.secrets.session,
            "key": self.secrets.key,
        }
        try:
            with replacing(self.path, 0o600) as unfinished:
                unfinished.write_text(json.dumps(content, indent=1), encoding="utf-8")
        except OSError as error:
            _log.warning("%s cannot be written: %s", self.path, error.strerror)

    def remove(self) -> None:
        """Removes the file."""
        self.path.unlink(missing_ok=True)


def link_in(folder: Path) -> str:
    """The link of the page of a run; "" while there is none."""
    try:
        return str(json.loads((folder / NAME).read_text(encoding="utf-8"))["link"])
    except (OSError, ValueError, KeyError, TypeError):
        return ""
