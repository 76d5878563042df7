"""The bus: protobuf messages over ZeroMQ, counted exactly, with a clock that may be simulated.

A node needs `paramove.bus.topics` (the one table of topics) and `paramove.bus.node` (`Bus`, `NodeConfig`, `main`).
The simulator needs `paramove.bus.barrier`, a replay test `paramove.bus.recorded`, a tool that looks on
`paramove.bus.inspection`.
"""
