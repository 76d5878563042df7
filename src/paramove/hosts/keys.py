"""Keys of hosts: a pair of this user on this host, and the pinned public keys of others, as ssh has them."""

from __future__ import annotations

import os
import re
import stat
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import zmq
from platformdirs import user_config_path
from pydantic import Field

from paramove.documents import InputError, read_text, replacing

OWN, TRUSTED = "own.key", "trusted"
_Z85 = r"^[0-9a-zA-Z.\-:+=^!/*?&<>()\[\]{}@%$#]{40}$"
_KEY = re.compile(_Z85)
MAX_BYTES = 100_000
PublicKey = Annotated[str, Field(pattern=_Z85)]
"""A public key, Z85 text."""
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
        if not _is_there(path):
            public, secret = (key.decode("ascii") for key in zmq.curve_keypair())
            self._write(path, f"{public}\n{secret}\n")
        found = path.stat()
        if found.st_mode & 0o077 or found.st_uid != os.geteuid():
            mode = stat.S_IMODE(found.st_mode)
            raise HostKeyError(f"{path} can be read by others (mode {mode:04o}): chmod 600 {path}")
        lines = read_text(path, "pair of keys", HostKeyError, MAX_BYTES).split()
        if len(lines) != 2 or not all(map(_KEY.fullmatch, lines)):
            raise HostKeyError(f"{path} holds no pair of keys: remove it, and trust the hosts again")
        return KeyPair(*lines)

    def trusted(self) -> dict[str, str]:
        """Name -> public key of the hosts that this user trusts. Raises HostKeyError if the file is damaged."""
        path = self.folder / TRUSTED
        if not _is_there(path):
            return {}
        lines = read_text(path, "file of trusted hosts", HostKeyError, MAX_BYTES).splitlines()
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
        lines = [f"{one} {its}" for one, its in {**known, name: key}.items()]
        self._write(self.folder / TRUSTED, "\n".join(lines) + "\n")
        return True

    def _write(self, path: Path, text: str) -> None:
        try:
            self.folder.mkdir(mode=0o700, parents=True, exist_ok=True)
            with replacing(path, 0o600) as unfinished:
                unfinished.write_text(text, encoding="ascii")
        except OSError as error:
            raise HostKeyError(
                f"{path} cannot be written: {error.strerror}; let XDG_CONFIG_HOME be a folder that you may write to"
            ) from error


def _is_there(path: Path) -> bool:
    """Whether there is a file; raises HostKeyError where nobody may look."""
    try:
        path.stat()
    except (FileNotFoundError, NotADirectoryError):
        return False
    except OSError as error:
        raise HostKeyError(f"{path} cannot be read: {error.strerror}") from error
    return True
