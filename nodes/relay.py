"""Relay: forwards topics between this host and the other hosts of the run; the launcher starts one on each.

It subscribes to and publishes whatever crosses, on its own behalf.
"""

from paramove.bus import Bus, NodeConfig, main
from paramove.hosts import Relay, RelaySettings

SUBSCRIBES = ()
PUBLISHES = ()


class Config(NodeConfig, RelaySettings):
    """See `RelaySettings`."""


def run(bus: Bus, config: Config) -> None:
    """Loop until the bus closes."""
    with Relay(bus, config) as relay:
        bus.ready("waits for the other hosts")
        while not bus.stopped:
            relay.step()
            bus.idle(0.0)
            bus.degraded(trouble) if (trouble := relay.trouble) else bus.ready(relay.detail)


if __name__ == "__main__":
    main(run, SUBSCRIBES, PUBLISHES, Config)
