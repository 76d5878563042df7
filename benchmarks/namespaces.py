"""Two hosts as two network namespaces, joined by a link that may be slow, lossy or cut. Needs root."""

from __future__ import annotations

import contextlib
import fcntl
import heapq
import itertools
import json
import os
import random
import select
import shutil
import struct
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

HERE, THERE = "10.99.0.1", "10.99.0.2"
NAMES = ("camera-pc", "robot-pc")
"""Of the second host, on the first one."""
CLOCK_AHEAD_S = 5000
"""The monotonic clock of `there`, which has a time namespace of its own."""
ROOT = Path(__file__).resolve().parent.parent
STAND_IN = ROOT / "tests" / "supervision" / "ssh_stand_in.py"
_TUNSETIFF, _TUN_WITHOUT_HEAD = 0x400454CA, 0x1001
_MTU = 9000


def ip(*words: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(["ip", *words], capture_output=True, text=True, check=False)


class Namespaces:
    """While a context: `names` are those of the namespaces, `within` and `within_there` what commands begin with.

    Raises OSError on entering where there are none: for others than root, or without /dev/net/tun.
    """

    def __init__(self, seed: int = 0) -> None:
        self.names = [f"paramove_{side}_{os.getpid()}" for side in ("here", "there")]
        self._devices = [f"pm{index}_{os.getpid()}" for index in range(2)]
        self.within, there = (("ip", "netns", "exec", name) for name in self.names)
        self.within_there = (*there, "unshare", "--time", "--monotonic", str(CLOCK_AHEAD_S), "--fork", "--kill-child")
        self._seed = seed

    def __enter__(self) -> Namespaces:
        with contextlib.ExitStack() as opened:
            self._open(opened)
            self._opened = opened.pop_all()
        return self

    def __exit__(self, *_: object) -> None:
        self._opened.close()

    def _open(self, opened: contextlib.ExitStack) -> None:
        for name in self.names:
            if ip("netns", "add", name).returncode:
                raise OSError("network namespaces need root")
            opened.callback(ip, "netns", "del", name)
        names = Path("/etc/netns", self.names[0])  # `ip netns exec` lays what is in it over /etc
        names.mkdir(parents=True)
        opened.callback(shutil.rmtree, names)
        (names / "hosts").write_text(f"127.0.0.1 localhost\n{THERE} {' '.join(NAMES)}\n")
        self._link = subprocess.Popen(
            ["nice", "-n", "-15", sys.executable, __file__, str(self._seed), *self._devices],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
        )
        opened.callback(self._end_link)
        assert self._link.stdout is not None
        if self._link.stdout.readline() != b"ready\n":
            raise OSError("there is no /dev/net/tun")
        for name, device, address in zip(self.names, self._devices, (HERE, THERE), strict=True):
            ip("link", "set", device, "netns", name)
            ip("-n", name, "addr", "add", f"{address}/24", "dev", device)
            ip("-n", name, "link", "set", device, "mtu", str(_MTU))
            for one in (device, "lo"):
                assert ip("-n", name, "link", "set", one, "up").returncode == 0

    def link(self, delay_s: float = 0.0, jitter_s: float = 0.0, loss: float = 0.0) -> None:
        """How late packets arrive, and which part does not; a `loss` of 1 is a cut link."""
        assert self._link.stdin is not None
        self._link.stdin.write(json.dumps([delay_s, jitter_s, loss]).encode() + b"\n")
        self._link.stdin.flush()

    def processes(self) -> list[int]:
        """Of the other host."""
        return [int(pid) for pid in ip("netns", "pids", self.names[1]).stdout.split()]

    def agent(self) -> int:
        """Process of the agent on the other host."""
        commands = {pid: Path(f"/proc/{pid}/cmdline").read_bytes().split(b"\0") for pid in self.processes()}
        return next(pid for pid, words in commands.items() if words[-3:-1] == [b"host", b"agent"] and b"-m" in words)

    def ssh(self, folder: Path, runtime: Path, config: Path) -> dict[str, str]:
        """Environment of a launcher here that reaches the other host by the stand-in for ssh."""
        file = folder / "environment_there.json"
        home = folder / "home_there"
        home.mkdir()
        (home / "paramove").symlink_to(ROOT)
        path = f"{ROOT / '.venv' / 'bin'}{os.pathsep}{os.environ['PATH']}"
        there = {"XDG_RUNTIME_DIR": str(runtime), "XDG_CONFIG_HOME": str(config), "HOME": str(home), "PATH": path}
        file.write_text(json.dumps(there))
        runtime.mkdir(mode=0o700, exist_ok=True)
        return {"PARAMOVE_SSH": " ".join([*self.within_there, sys.executable, str(STAND_IN), str(file)])}

    def _end_link(self) -> None:
        assert self._link.stdin is not None
        self._link.communicate()


def _tun(name: str) -> int:
    descriptor = os.open("/dev/net/tun", os.O_RDWR | os.O_NONBLOCK)
    fcntl.ioctl(descriptor, _TUNSETIFF, struct.pack("16sH", name.encode(), _TUN_WITHOUT_HEAD))
    return descriptor


def _packets(descriptor: int) -> Iterator[bytes]:
    with contextlib.suppress(BlockingIOError):
        while True:
            yield os.read(descriptor, 65536)


def forward(seed: int, first: str, second: str) -> None:
    """Packets between two TUN devices, until standard input ends."""
    ends = [_tun(first), _tun(second)]
    sys.stdout.write("ready\n")
    sys.stdout.flush()
    draw, order = random.Random(seed), itertools.count()
    delay_s = jitter_s = loss = 0.0
    under_way: list[tuple[float, int, int, bytes]] = []
    while True:
        left_s = max(0.0, under_way[0][0] - time.monotonic()) if under_way else 1.0
        ready = select.select([sys.stdin, *ends], [], [], left_s)[0]
        if sys.stdin in ready:
            line = sys.stdin.readline()
            if not line:
                return
            delay_s, jitter_s, loss = json.loads(line)
        now_s = time.monotonic()
        for end, other in (ends, ends[::-1]):
            for packet in _packets(end) if end in ready else ():
                if draw.random() >= loss:
                    due_s = now_s + delay_s + draw.uniform(-jitter_s, jitter_s)
                    heapq.heappush(under_way, (due_s, next(order), other, packet))
        now_s = time.monotonic()
        while under_way and under_way[0][0] <= now_s:
            _, _, other, packet = heapq.heappop(under_way)
            with contextlib.suppress(OSError):  # the device is down, or its queue is full
                os.write(other, packet)


if __name__ == "__main__":
    forward(int(sys.argv[1]), *sys.argv[2:])
