"""A node that tests start as a process: computes in a pool of forked processes until it is to end."""

from __future__ import annotations

import multiprocessing
import os
import signal

from paramove.bus import topics
from paramove.bus.node import Bus, NodeConfig, main
from paramove.msgs.rule_pb2 import Speech

SUBSCRIBES = ()
PUBLISHES = (topics.SPEECH,)
FORK = multiprocessing.get_context("fork")
WAITING = FORK.Semaphore(0)


def _work(number: int) -> int:
    return os.getpid()


def _wait(number: int) -> None:
    WAITING.release()
    signal.pause()


def run(bus: Bus, config: NodeConfig) -> None:
    """Publishes the processes of the pool once a tick."""
    with FORK.Pool(3) as pool:
        pids = sorted({pid for _ in range(20) for pid in pool.map(_work, range(30), chunksize=1)})
        pool.map_async(_wait, range(3), chunksize=1)
        for _ in range(
            3
        ):  # an idle process has the lock of the pool's queue, and a pool ends no more if that one is killed
            WAITING.acquire()
        child = os.fork()  # without a pool
        if child == 0:
            signal.pause()
        bus.ready("computes")
        for _ in bus.events(tick=True):
            bus.publish(topics.SPEECH, Speech(text=" ".join(map(str, (*pids, child)))))
        os.kill(child, signal.SIGTERM)
        os.waitpid(child, 0)


if __name__ == "__main__":
    main(run, SUBSCRIBES, PUBLISHES, NodeConfig)
