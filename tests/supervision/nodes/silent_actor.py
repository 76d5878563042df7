"""The same as `actor`, which says nothing on the bus but its status, so that several may run."""

import runpy

from paramove.bus import topics  # noqa: F401 (SUBSCRIBES and PUBLISHES would name topics from here)

SUBSCRIBES = ()
PUBLISHES = ()

if __name__ == "__main__":
    runpy.run_module("nodes.actor", run_name="__main__")
