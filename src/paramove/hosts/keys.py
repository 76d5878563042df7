"""Keys of hosts: a pair of this user on this host, and the pinned public keys of others, as ssh has them."""

from __future__ import annotations

import os
import re
import stat
from dataclasses import dataclass
from pathlib import Path

import zmq
from platformdirs import user_config_path

from paramove.documents import InputError, replacing

OWN, TRUSTED = "own.key", "trusted"
_KEY = re.compile(r"[0-9a-zA-Z.\-:+=^!/*?&<>()\[\]{}@%$#]{40}")  # Z85
_NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9._@-]{0,62}")


class HostKeyError(InputError):
    """A key that is missing, changed, damaged or open to others; the text has the remedy."""


@dataclass(frozen=True)
class KeyPair:
    """CURVE keys of one user on one host, Z85 text."""

    public: str
    secret: str


class HostKeys:
    """The folder of a user's keys.

    Args:
        folder: Default: `hosts` in the user's configuration folder of paramove.
    """

    def __init__(self, folder: Path | None = None) -> None:
        self.folder = folder or user_config_path("paramove") / "hosts"

    def own(self) -> KeyPair:
        """This host's pair, made at its first use. Raises HostKeyError if others can read it, or it is damaged."""
        path = self.folder / OWN
        self.folder.mkdir(mode=0o700, parents=True, exist_ok=True)
        if not path.exists():
            public, secret = (key.decode("ascii") for key in zmq.curve_keypair())
            with replacing(path, 0o600) as unfinished:
                unfinished.write_text(f"{public}\n{secret}\n", encoding="ascii")
        found = path.stat()
        if found.st_mode & 0o077 or found.st_uid != os.geteuid():
            mode = stat.S_IMODE(found.st_mode)
            raise HostKeyError(f"{path} can be read by others (mode {mode:04o}): chmod 600 {path}")
        lines = path.read_text(encoding="ascii", errors="replace").split()
        if len(lines) != 2 or not all(map(_KEY.fullmatch, lines)):
            raise HostKeyError(f"{path} holds no pair of keys: remove it, and trust the hosts again")
        return KeyPair(*lines)

    def trusted(self) -> dict[str, str]:
        """Name -> public key of the hosts that this user trusts. Raises HostKeyError if the file is damaged."""
        path = self.folder / TRUSTED
        try:
            lines = path.read_text(encoding="utf-8", errors="replace").splitlines()
        except FileNotFoundError:
            return {}
        known = {}
        for number, line in enumerate(lines, 1):
            name, _, key = line.partition(" ")
            if not (_NAME.fullmatch(name) and _KEY.fullmatch(key)):
                raise HostKeyError(f"{path}:{number}: expected a name and its public key, found {line!r:.80}")
            known[name] = key
        return known

    def trust(self, name: str, key: str) -> bool:
        """Pins a host's public key; whether it is new.

        Raises HostKeyError for what is no name or no key, and where another key is pinned for this name.
        """
        if not _NAME.fullmatch(name) or not _KEY.fullmatch(key):
            raise HostKeyError(f"a host's name and its public key (40 characters) expected, found {name!r} {key!r:.80}")
        known = self.trusted()
        if known.get(name, key) != key:
            raise HostKeyError(
                f"the key of {name} has changed: pinned is {known[name]}, found {key}. If it was set up anew, remove "
                f"its line in {self.folder / TRUSTED} and trust it again; else another computer pretends to be {name}"
            )
        if name in known:
            return False
        self.folder.mkdir(mode=0o700, parents=True, exist_ok=True)
        lines = [f"{one} {its}" for one, its in {**known, name: key}.items()]
        with replacing(self.folder / TRUSTED, 0o600) as unfinished:
            unfinished.write_text("\n".join(lines) + "\n", encoding="ascii")
        return True
