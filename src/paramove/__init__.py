"""paramove: parametric human movements, learned from few demonstrations.

`paramove.connect()` is the running application, for a program of one's own: see `paramove.client`.
"""

from typing import Any

__version__: str


def __getattr__(name: str) -> Any:
    if name == "connect":
        from paramove.client import connect

        return connect
    if name != "__version__":
        raise AttributeError(f"module 'paramove' has no attribute {name!r}")
    from importlib.metadata import version  # takes longer than all that a help page needs

    return version("paramove")
