"""The bus: protobuf messages over ZeroMQ, counted exactly, with a clock that may be simulated.

A node needs `paramove.bus.topics` (the one table of topics) and `paramove.bus.node` (`Bus`, `NodeConfig`, `main`).
The simulator needs `paramove.bus.barrier`, a replay test `paramove.bus.recorded`, a tool that only observes
`paramove.bus.inspection`.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
