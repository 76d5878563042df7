"""The same as `actor`; its interface is that of one who keeps the time."""

import runpy

from paramove.bus import topics

SUBSCRIBES = ()
PUBLISHES = (topics.CLOCK, topics.TRUTH_STATE)

if __name__ == "__main__":
    runpy.run_module("nodes.actor", run_name="__main__")
