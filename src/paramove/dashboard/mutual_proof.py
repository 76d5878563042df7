"""Mutual proof of page and browser that both have the key, which itself never crosses the socket.

The page proves itself first: a program that has taken the port of a page that died learns nothing, and cannot pass for
the page. Each proof contains the address that the browser connected to, so it cannot be relayed to a page at another
port, and a random number of each side, so it cannot be repeated. `page/proof.js` has the browser's side.
"""

from __future__ import annotations

import hashlib
import hmac
import re
import secrets
from enum import StrEnum

_NONCE = re.compile(r"[0-9a-f]{32}")


class Side(StrEnum):
    """Whose proof it is."""

    PAGE = "page"
    BROWSER = "browser"


def nonce() -> str:
    """A random number, 32 hexadecimal digits."""
    return secrets.token_hex(16)


def is_nonce(text: object) -> bool:
    """Whether it has the form of one."""
    return isinstance(text, str) and _NONCE.fullmatch(text) is not None


def proof(key: str, side: Side, host: str, browser_nonce: str, page_nonce: str) -> str:
    """HMAC-SHA256 of side, address (`127.0.0.1:4711`) and both nonces, 64 hexadecimal digits."""
    content = "\n".join((side, host, browser_nonce, page_nonce))
    return hmac.new(key.encode(), content.encode(), hashlib.sha256).hexdigest()


def is_proof(given: object, expected: str) -> bool:
    """Compares in constant time."""
    return isinstance(given, str) and hmac.compare_digest(given.encode(), expected.encode())
