"""Sends damaged messages to all that reads them from another process or host; anything but a rejection fails.

    python benchmarks/fuzz_protocols.py [--seconds 60] [--seed 0]

Good messages of every kind are made of their schemas. Their bytes are changed, as in `fuzz_bus.py`, and so is what is
in them: other types, missing, added and repeated keys, nesting, huge numbers, control characters, paths as names, lists
and texts as long as a message may be. Each target gets the same time:

    readers    every reader of messages; each text that comes out is printable, 1 s and 200 MB are enough
    control    the control socket: pieces of requests, floods, clients that go; a good request is answered
    launcher   the launcher's end of another host, whose agent and shell send anything
    agent      the agent on another host, whose launcher sends anything, at any time of a run
    relay      a relay with a trusted host that has the right keys; in the end a good message crosses both ways
    simulated  the same in simulated time

Prints executions and outcomes of each; the exit code is 1, the seed is named and the latest input is stored if anything
else happened. The same seed gives the readers the same inputs; the others depend on the times of processes as well.
"""

from __future__ import annotations

import contextlib
import copy
import json
import logging
import os
import random
import re
import shutil
import signal
import socket
import sys
import tempfile
import threading
import time
import traceback
from collections import Counter
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, Literal

import zmq

ROOT = Path(__file__).parents[1]
sys.path.insert(0, str(ROOT))  # run as a program, only this folder is known

from benchmarks.fuzz_bus import example as bus_message  # noqa: E402
from benchmarks.fuzz_bus import memory_mib, mutate, run  # noqa: E402
from benchmarks.fuzz_files import peak_mib  # noqa: E402
from benchmarks.hosts import hosts  # noqa: E402
from paramove.bus import Bus, BusSettings, BusVisitor, Envelope, pack, schema_hash, topics  # noqa: E402
from paramove.documents import InputError, Message, MessageError, MessageReader  # noqa: E402
from paramove.hosts import HostKeys, KeyPair, Relay, RelaySettings, link  # noqa: E402
from paramove.msgs.clock_pb2 import TickDone  # noqa: E402
from paramove.msgs.rule_pb2 import Rule, Rules, Speech  # noqa: E402
from paramove.supervision import (  # noqa: E402
    Agent,
    ControlServer,
    HostSettings,
    LaunchFile,
    RemoteHost,
    RunFolder,
    ask_host,
    guard,
    messages,
    release_of,
)
from paramove.workspace import Workspace  # noqa: E402

MOST_S = 1.0
"""Of processor time, for one input."""
MOST_MIB = 200.0
MORE_DESCRIPTORS = 40
"""Than in the beginning: libzmq closes those of a connection that has gone a little later."""
READERS: dict[str, MessageReader[Any]] = {
    "request": messages.REQUESTS,
    "answer": messages.ANSWERS,
    "to agent": messages.TO_AGENT,
    "from agent": messages.FROM_AGENT,
    "about": messages.ABOUTS,
    "guard": guard.CHANGES,
    "asked": link.ASKED,
    "given": link.GIVEN,
}


class DefectError(Exception):
    """Something happened that must not, whatever was sent."""


def expect(condition: bool, what: str) -> None:
    """Raises DefectError with `what` unless the condition is true."""
    if not condition:
        raise DefectError(what)


def is_printable(text: str) -> bool:
    """Whether a terminal shows the text as lines, and takes nothing of it as a command."""
    return all(line.isprintable() for line in text.split("\n"))


def limited(call: Callable[[], Any]) -> Any:
    """What the call returns; raises DefectError if it needs more processor time than one input may."""
    begun_s = time.process_time()
    result = call()
    seconds = time.process_time() - begun_s
    expect(seconds <= MOST_S, f"{seconds:.1f} s of processor time")
    return result


# Messages ---------------------------------------------------------------------------------------------------------

TEXTS = ("nodes.far", "far", "near_2", "one two", "é€", "x" * 40, "0" * 40)
ANYTHING = (None, True, 3, 0.5, "text", [1, [2]], {"key": {"a": "b"}})
KEYS = ("more", "kind", "node", "nodes", "", "../x", "far\n", "\x1b[2J", "\x9b2J", "\u202e", "é", "k" * 5000)
FRAGMENTS = (
    *(b"null", b"true", b"0", b"-1", b"0.5", b'""', b"[]", b"{}", b'["x"]', b'{"a": 1}', b"", b"x", b'"'),
    *(b"NaN", b"-Infinity", b"1e999", b"1e308", b"-0", b"1" + b"0" * 18, b"9" * 400, b"9" * 4300, b"9" * 9000),
    *(b'"../x"', b'"/tmp/x"', b'"."', b'"far\\n"', b'"\\u0000"', b'"FAR"', b'"-x"', b'"' + b"n" * 3000 + b'"'),
    *(
        b'"\\u001b[2J"',
        b'"\\r\\u009b31m"',
        b'"\xc2\x9b2J\x7f"',
        b'"\xe2\x80\xae"',
        b'"\x1b[2J"',
        b'"\\ud800"',
        b'"\xff"',
    ),
    *(b'0, "kind": "log"', b'"far", "node": "../x"', b'"a", "a": 1', b'"begin"', b'"alive"', b'["begin"]'),
    *(b"[" * depth + b"]" * depth for depth in (10, 22, 100, 1500)),
    *(b'{"a":' * depth + b"0" + b"}" * depth for depth in (10, 22, 100)),
)
"""JSON, and what is none, in place of a value."""
REPEATED = (b"0,", b"{},", b"[],", b'"",', b'{"node":0},', b'{"kind":[]},', b"null,")
FILLS = (b"x", b"\x7f", b"\xc2\x9b", b"\xe2\x80\xae", b"\\u001b", b"\\n", b"[", b'\\"', b",", b"{},")


def example(schema: dict[str, Any], generator: random.Random, definitions: dict[str, Any]) -> Any:
    """A value that fits a schema."""
    if "$ref" in schema:
        return example(definitions[schema["$ref"].rpartition("/")[2]], generator, definitions)
    if "const" in schema:
        return schema["const"]
    choices = schema.get("anyOf") or schema.get("enum")
    if choices:
        chosen = generator.choice(choices)
        return example(chosen, generator, definitions) if "anyOf" in schema else chosen
    kind = schema.get("type")
    if kind == "object":
        required = schema.get("required", ())
        fields = {
            name: example(field, generator, definitions)
            for name, field in schema.get("properties", {}).items()
            if name in required or name == "kind" or generator.random() < 0.6
        }
        others = [*schema.get("patternProperties", {}).values(), schema.get("additionalProperties")]
        return fields | {
            generator.choice(TEXTS[1:3]): example(other, generator, definitions)
            for other in others
            if isinstance(other, dict)
        }
    if kind == "array":
        return [example(schema["items"], generator, definitions) for _ in range(generator.randrange(3))]
    if kind == "string":
        return generator.choice([text for text in TEXTS if re.search(schema.get("pattern", ""), text)])
    if kind == "integer":
        return generator.choice([schema.get("minimum", -5), schema.get("maximum", 2**31), schema.get("minimum", 0) + 1])
    if kind == "number":
        return generator.choice([1.5, 3])
    if kind == "boolean":
        return generator.random() < 0.5
    return None if kind == "null" else generator.choice(ANYTHING)


def places(value: Any) -> Iterator[tuple[Any, Any]]:
    """Every part of a value, as what holds it and its key there."""
    keys = list(value) if isinstance(value, dict) else range(len(value)) if isinstance(value, list) else ()
    for key in keys:
        yield value, key
        yield from places(value[key])


class Messages:
    """Good and damaged lines of one reader.

    Args:
        fixed: Values of the fields that a good message must have to be of use.
    """

    def __init__(
        self, reader: MessageReader[Any], generator: random.Random, fixed: dict[str, Any] | None = None
    ) -> None:
        self._generator, self._bound = generator, reader.max_bytes
        self._examples: list[dict[str, Any]] = []
        for kind in reader.kinds:
            schema = kind.model_json_schema()
            for _ in range(8):
                made = example(schema, generator, schema.get("$defs", {}))
                made |= {name: value for name, value in (fixed or {}).items() if name in made}
                self._examples.append(made)
                reader.read(json.dumps(made).encode())

    def good(self) -> bytes:
        """A line as it may come."""
        return json.dumps(self._generator.choice(self._examples)).encode()

    def damaged(self, big: float = 0.003) -> bytes:
        """A line that hardly can be a message; with probability `big` it is about as long as it may be."""
        if self._generator.random() < big:
            return self._changed(self._big())
        content = self._changed() if self._generator.random() < 0.6 else self.good()
        if self._generator.random() < 0.5:
            content = mutate(content, self.good(), self._generator)
        return content

    def _changed(self, fragment: bytes | None = None) -> bytes:
        """A message of which parts were replaced, left out or added; one of them by this fragment."""
        value = copy.deepcopy(self._generator.choice(self._examples))
        fragments = [self._generator.choice(FRAGMENTS) for _ in range(self._generator.choice([1, 1, 2, 4]))]
        found = list(places(value))
        for number, _ in enumerate(fragments):
            holder, key = self._generator.choice(found)
            way = self._generator.randrange(4)
            if way == 0 and isinstance(holder, dict):
                key = self._generator.choice(KEYS)
            if way == 1 and isinstance(holder, dict) and fragment is None:
                holder.pop(key, None)
            else:
                holder[key] = f"@{number}@"
        content = json.dumps(value, ensure_ascii=self._generator.random() < 0.5).encode()
        for number, replacement in enumerate([fragment or fragments[0], *fragments[1:]]):
            content = content.replace(b'"@%d@"' % number, replacement)
        return content

    def _big(self) -> bytes:
        way = self._generator.randrange(3)
        if way == 0:
            part = self._generator.choice(REPEATED)
            return b"[" + part * (self._room() // len(part)) + b"0]"
        if way == 1:
            count = self._room() // 12
            return b"{" + b"".join(b'"a%07d":0,' % number for number in range(count)) + b'"b":0}'
        part = self._generator.choice(FILLS)
        return b'"' + part * (self._room() // len(part)) + b'"'

    def _room(self) -> int:
        """Bytes, mostly below the bound by what else is in a message."""
        return round(self._bound * self._generator.choice([0.1, 0.5, 0.97, 1.1]))


# Targets ----------------------------------------------------------------------------------------------------------


class Readers:
    """Every reader of messages, called as a function."""

    def __init__(self, generator: random.Random, _: Path) -> None:
        self._generator = generator
        self._messages = {name: Messages(reader, generator) for name, reader in READERS.items()}
        self.executions, self.latest = 0, b""
        self.outcomes: Counter[str] = Counter()
        self._before_mib = peak_mib()

    def step(self) -> None:
        """Reads one line."""
        name = self._generator.choice([*READERS])
        made = self._messages[name]
        self.latest = made.good() if self._generator.random() < 0.1 else made.damaged()
        self.executions += 1
        try:
            message = limited(lambda: self._read(name))
        except MessageError as error:
            self.outcomes["rejected"] += 1
            expect(str(error).isprintable() and error.content.isprintable(), "an error that is not printable")
            return
        self.outcomes["read"] += 1
        message.line()
        check_texts(message)

    def _read(self, name: str) -> Message:
        if len(self.latest) < 10_000:
            return READERS[name].read(self.latest)  # type: ignore[no-any-return]
        before_mib = peak_mib(anew=True)
        try:
            return READERS[name].read(self.latest)  # type: ignore[no-any-return]
        finally:
            more_mib = peak_mib() - before_mib
            expect(more_mib <= MOST_MIB, f"{more_mib:.0f} MiB")

    def end(self) -> None:
        """Nothing is left to be checked."""


def check_texts(message: Message) -> None:
    """Raises DefectError if a text of a message is not printable; those of a launch file are not printed."""
    for holder, key in places(message.model_dump(exclude={"launch"})):
        for text in (key, holder[key]):
            if isinstance(text, str):
                fits = is_printable(text) if isinstance(message, messages.Log) else text.isprintable()
                expect(fits, f"{key} is not printable: {text!r:.80}")


class Control:
    """The control socket of a launcher, with clients that send anything."""

    def __init__(self, generator: random.Random, folder: Path) -> None:
        self._generator, self._path = generator, folder / "control"
        self._messages = Messages(messages.REQUESTS, generator)
        self._server = ControlServer(folder, self._answer)
        self.executions, self.latest = 0, b""
        self.outcomes: Counter[str] = Counter()
        self._descriptors = descriptors()

    def _answer(self, request: messages.Request) -> messages.Answer:
        row = messages.NodeRow(node="far", state="ready", sentence="", pid=None, restarts=0, exit_reason="")
        rows = [row] * (1000 if self._generator.random() < 0.01 else 1)
        return messages.Answer(ok=True, sentence=f"{request.do} {request.node}", nodes=rows)

    def step(self) -> None:
        """A round: some clients, and a good one when they have gone."""
        clients = []
        for _ in range(self._generator.choice([1, 4, 8, 60])):
            clients.append(self._connected())
            self._send(clients[-1])
            if self._generator.random() < 0.2:
                clients.pop(self._generator.randrange(len(clients))).close()
        for _ in range(2):
            limited(self._server.serve)
        for client in clients:
            self._check(received(client))
            client.close()
        self._server.serve()
        with self._connected() as client:
            client.send(messages.Request(do="list").line() + b"\n")
            content = b""
            while not content.endswith(b"\n"):
                limited(self._server.serve)
                part = received(client)
                expect(bool(part), "a good request is not answered")
                content += part
            expect(messages.ANSWERS.read(content).ok, "a good request is rejected")
        self._server.serve()
        expect(len(self._server.descriptors) == 1, "clients are left")

    def _connected(self) -> socket.socket:
        client = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM | socket.SOCK_NONBLOCK)
        try:
            client.connect(os.fspath(self._path))
        except BlockingIOError:
            self._server.serve()
            client.connect(os.fspath(self._path))
        return client

    def _send(self, client: socket.socket) -> None:
        """Nothing, half a line, a line in pieces, several lines, or a flood."""
        way = self._generator.randrange(8)
        line = self._messages.good() if way == 0 else self._messages.damaged(0.05)
        end = b"" if way == 1 else b"\n"
        count = self._generator.choice([2, 40]) if way == 3 else 1
        self.latest = b"" if way == 2 else (line + end) * count
        self.executions += count
        at = self._generator.randrange(len(self.latest) + 1)
        for part in (self.latest[:at], self.latest[at:]):
            with contextlib.suppress(BlockingIOError, BrokenPipeError, ConnectionResetError):
                client.send(part)
            if self._generator.random() < 0.2:
                limited(self._server.serve)

    def _check(self, content: bytes) -> None:
        if not content.endswith(b"\n"):  # without an answer, or with a large one's beginning
            self.outcomes["disconnected" if not content else "read"] += 1
            return
        expect(content[:-1].decode().isprintable(), "an answer is not printable")
        answer = messages.ANSWERS.read(content)
        self.outcomes["read" if answer.ok else "rejected"] += 1

    def end(self) -> None:
        """Nothing is left behind."""
        self._server.__exit__()
        expect(descriptors() <= self._descriptors, "descriptors are left")


def received(client: socket.socket) -> bytes:
    """What has come in; b"" also for a connection that has ended."""
    with contextlib.suppress(BlockingIOError, ConnectionResetError):
        return client.recv(2**20)
    return b""


def descriptors() -> int:
    """How many this process has open."""
    return len(os.listdir("/proc/self/fd"))


def files(folder: Path) -> set[Path]:
    """All that is in a folder and below."""
    return set(folder.rglob("*"))


class Launcher:
    """The launcher's end of another host: a shell that prints anything, then an agent that sends anything."""

    SETTINGS = HostSettings(ssh="other")

    def __init__(self, generator: random.Random, folder: Path) -> None:
        self._generator, self._root = generator, folder
        self._home = folder / "home" / "runs"
        self._home.mkdir(parents=True)
        self._greeting = folder / "greeting"
        self._messages = Messages(messages.FROM_AGENT, generator, {"node": "far"})
        self._abouts = Messages(messages.ABOUTS, generator)
        nodes = {"far": {"module": "nodes.far", "host": "there"}, "near": {"module": "nodes.far"}}
        launch = LaunchFile.model_validate({"hosts": {"here": {}, "there": {"ssh": "other"}}, "nodes": nodes})
        self._begin = messages.Begin(
            launch=launch, name="", domain="fuzz", clock=None, launcher="", release="1", host="there"
        )
        self.executions, self.latest = 0, b""
        self.outcomes: Counter[str] = Counter()

    def step(self) -> None:
        """A run, or a question for `paramove host`."""
        if self._generator.random() < 0.2:
            self._ask()
        else:
            self._run()

    def _lines(self, made: Messages, most: int) -> bytes:
        count = self._generator.randrange(most)
        self.executions += count
        damaged = self._generator.random() < 0.9
        lines = [made.damaged() if damaged else made.good() for _ in range(count)]
        return b"".join(line + b"\n" for line in lines)

    def _ask(self) -> None:
        self._greeting.write_bytes(self._lines(self._abouts, 20))
        self._shell(f"cat {self._greeting}")
        self._attempt(lambda: ask_host(self.SETTINGS, "about"))

    def _attempt(self, call: Callable[[], Any]) -> Any:
        """What the call returns; None if it is rejected."""
        try:
            result = limited(call)
        except (InputError, OSError) as error:
            expect(is_printable(str(error)), f"an error that is not printable: {error!r}")
            self.outcomes["ended"] += 1
            return None
        self.outcomes["went on"] += 1
        return result

    def _shell(self, script: str) -> None:
        os.environ["PARAMOVE_SSH"] = f"sh -c '{script}' --"

    def _run(self) -> None:
        goes_on = self._generator.random() < 0.8
        ready = b"\n" + messages.Alive().line() + b"\n" + messages.Ready(folder="there").line() + b"\n"
        self.latest = self._lines(self._messages, 5) + (ready if goes_on else b"")
        self._greeting.write_bytes(self.latest)
        reads, writes = os.pipe2(os.O_NONBLOCK | os.O_CLOEXEC)
        agent = f"cat /proc/{os.getpid()}/fd/{reads} &" if goes_on else ""
        self._shell(f"cat {self._greeting}; {agent} exec cat > /dev/null")
        run_folder = RunFolder(self._home / "run")
        run_folder.logs.mkdir(parents=True)
        before = files(self._root)
        host = self._attempt(lambda: RemoteHost(self.SETTINGS, self._begin, run_folder))
        if host is not None:
            self._talk(host, writes)
        os.close(writes)
        os.close(reads)
        if host is not None:
            host.close()
            expect(host.lost.isprintable(), f"{host.lost!r:.200}")
        self._check(run_folder, before)
        shutil.rmtree(run_folder.path)

    def _talk(self, host: RemoteHost, writes: int) -> None:
        for _ in range(30):
            self.latest = self._lines(self._messages, 40)
            self._write(host, writes, self.latest)
            if self._generator.random() < 0.2:
                answers = [messages.Started(node="far", pid=77), messages.Failed(node="far", reason="\x1b[2J")]
                with contextlib.suppress(BlockingIOError):  # it is read when the request has been sent
                    os.write(writes, b"\n" + self._generator.choice(answers).line() + b"\n")
                process = self._attempt(lambda: host.start("far"))
                if process is not None:
                    process.terminate()
                    process.halted()
                    process.kill()
            limited(host.serve)
            expect(all(problem.isprintable() for problem in host.problems), "a problem is not printable")
            self.outcomes["problems"] += len(host.problems)
            host.problems.clear()

    def _write(self, host: RemoteHost, writes: int, content: bytes) -> None:
        """All of it; the launcher reads while the pipe is full."""
        left = memoryview(content)
        while left and not host.lost:
            with contextlib.suppress(BlockingIOError):
                left = left[os.write(writes, left) :]
            limited(host.serve)

    def _check(self, run_folder: RunFolder, before: set[Path]) -> None:
        """Nothing but the log of the node that runs there has been written."""
        log = run_folder.log("far")
        new = files(self._root) - before
        expect(new <= {log, run_folder.log("agent_there")}, f"files were written: {new}")
        if log.exists():
            expect(is_printable(log.read_text(encoding="utf-8")), "a log is not printable")

    def end(self) -> None:
        """Nothing is left to be checked."""
        del os.environ["PARAMOVE_SSH"]


PRINTS = """
import sys, time
print("\\x1b[2J\\x9b2Jprinted\\r", flush=True)
time.sleep(600.0)
"""


class Agents:
    """The agent on another host in this process; a launcher has sent all before it reads, and has gone."""

    def __init__(self, generator: random.Random, folder: Path) -> None:
        self._generator, self._root = generator, folder
        self._home = folder / "home" / "workspace"
        for part in ("launch", "nodes"):
            (self._home / part).mkdir(parents=True)
        (self._home / "nodes" / "far.py").write_text(PRINTS)
        os.environ["XDG_RUNTIME_DIR"] = str(folder)
        self._workspace = Workspace(self._home, (self._home,))
        self._release = release_of(self._workspace)
        fixed: dict[str, Any] = {"release": self._release, "domain": "fuzz", "node": "far", "host": "there"}
        self._messages = Messages(messages.TO_AGENT, generator, fixed)
        far = {"module": "nodes.far", "host": "there"}
        self._begin = {**fixed, "kind": "begin", "launch": {"nodes": {"far": far, "near_2": far}}}
        self._begin |= {"name": "", "clock": None, "launcher": ""}
        del self._begin["node"]
        self.executions, self.latest = 0, b""
        self.outcomes: Counter[str] = Counter()

    def step(self) -> None:
        """One connection: a first message that is damaged or not, and many that follow it."""
        first, others = self._messages.damaged(), list[bytes]()
        if self._generator.random() < 0.5:
            first = json.dumps(self._begin).encode()
            others = [self._messages.damaged(0.0005) for _ in range(300)]
            others[200:200] = [messages.Start(node=node).line() for node in ("far", "near_2")]
        self.executions += 1 + len(others)
        self.latest = b"\n".join([first, *others])
        before = files(self._root)
        sent = self._connected(first + b"\n", b"".join(line + b"\n" for line in others))
        for line in sent.splitlines():
            if line:
                expect(line.decode().isprintable(), f"the agent sends {line!r:.100}")
                self.outcomes[type(messages.FROM_AGENT.read(line)).__name__.lower()] += 1
        allowed = (self._home / "runs", self._root / "paramove")
        new = [path for path in files(self._root) - before if not any(path.is_relative_to(one) for one in allowed)]
        expect(new == [], f"files were written: {new}")
        shutil.rmtree(self._home / "runs", ignore_errors=True)

    def _connected(self, first: bytes, others: bytes) -> bytes:
        """What an agent sends that gets the first line and, once it is ready, the others."""
        handlers = {number: signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)}
        ours, theirs = socket.socketpair()
        sent: list[bytes] = []
        launcher = threading.Thread(target=converse, args=(ours, first, others, sent))
        with ours:
            launcher.start()
            with theirs:
                try:
                    limited(Agent(self._workspace, theirs.fileno(), theirs.fileno()).run)
                finally:
                    for number, handler in handlers.items():
                        signal.signal(number, handler)
            launcher.join()
        return b"".join(sent)

    def end(self) -> None:
        """Nothing is left to be checked."""
        del os.environ["XDG_RUNTIME_DIR"]


def converse(connection: socket.socket, first: bytes, others: bytes, came: list[bytes]) -> None:
    """A launcher that sends a line and, once an answer to it has come, the others; keeps all that came."""
    connection.settimeout(10.0)
    with contextlib.suppress(OSError):
        connection.sendall(first)
        while others and (part := connection.recv(2**20)):
            came.append(part)
            if b'"alive"' not in part.splitlines()[-1]:
                connection.sendall(others)
                break
    with contextlib.suppress(OSError):
        connection.shutdown(socket.SHUT_WR)
        while part := connection.recv(2**20):
            came.append(part)


class RawHost:
    """A trusted host in other hands: raw sockets with its key, in place of its relay.

    Args:
        own: Its keys.
        port: Of its relay; images take the next one.
        key, port_there: Public key and port of the relay that it is connected to.
    """

    def __init__(self, own: KeyPair, port: int, key: str, port_there: int) -> None:
        self._own, self._key, self._port_there = own, key, port_there
        self.context: zmq.Context[Any] = zmq.Context()
        self._gate = link.Gatekeeper(self.context, {"here": key})
        self.offer, self.images = self._offer(port), self._offer(port + 1)
        self.asks = self.connection()

    def _offer(self, port: int) -> zmq.Socket[Any]:
        made: zmq.Socket[Any] = self.context.socket(zmq.ROUTER)
        made.setsockopt(zmq.LINGER, 0)
        made.setsockopt(zmq.CURVE_SERVER, 1)
        made.setsockopt_string(zmq.CURVE_SECRETKEY, self._own.secret)
        made.bind(f"tcp://127.0.0.1:{port}")
        return made

    def connection(self, images: bool = False) -> zmq.Socket[Any]:
        """A further connection to the relay."""
        made: zmq.Socket[Any] = self.context.socket(zmq.DEALER)
        made.setsockopt(zmq.LINGER, 0)
        made.setsockopt_string(zmq.CURVE_SERVERKEY, self._key)
        made.setsockopt_string(zmq.CURVE_PUBLICKEY, self._own.public)
        made.setsockopt_string(zmq.CURVE_SECRETKEY, self._own.secret)
        made.connect(f"tcp://127.0.0.1:{self._port_there + images}")
        return made

    def close(self) -> None:
        """Closes all sockets but further connections."""
        for one in (self.offer, self.images, self.asks):
            one.close(linger=0)
        self._gate.close()
        self.context.term()


class Crossing(logging.Handler):
    """A relay, and in place of another host's one a program with its keys, which sends anything."""

    WANTS = (topics.RULES, topics.CAMERA_IMAGE)
    CLOCK: Literal["monotonic", "simulated"] = "monotonic"
    GIVES = (topics.SPEECH, topics.ARM_TRAJECTORY, topics.OPERATOR_STOP, topics.OPERATOR_ARM, topics.CAMERA_IMAGE_RAW)

    def __init__(self, generator: random.Random, folder: Path) -> None:
        super().__init__()
        self._generator = generator
        self._opened = contextlib.ExitStack()
        _, ((_, there, _), (name, here, made)) = self._opened.enter_context(hosts(folder, 1))
        settings = RelaySettings(**made)
        (peer,) = settings.peers.values()
        rows = [{topic.name: topic.name for topic in row} for row in (self.WANTS, self.GIVES)]
        peer = peer.model_copy(update={"wants": rows[0], "gives": rows[1], "members": ("tracker",), "commands": True})
        settings = settings.model_copy(update={"peers": {"there": peer}})
        own = HostKeys(there.parent / "keys").own()
        self._raw = RawHost(own, peer.port, HostKeys(settings.keys).own().public, settings.port)
        self._opened.callback(self._raw.close)
        bus = Bus(f"relay_{name}", BusSettings(folder=here, clock=self.CLOCK))
        self._opened.callback(bus.close)
        self._relay = self._opened.enter_context(Relay(bus, settings))
        visitor = self._opened.enter_context(BusVisitor(here, "fuzz"))
        self._subscriber = visitor.subscriber(topics.SPEECH)
        self._publisher = visitor.publisher(topics.RULES)
        self._asked, self._given = (Messages(reader, generator) for reader in (link.ASKED, link.GIVEN))
        self._ends: dict[tuple[zmq.Socket[Any], bytes], list[str]] = {}
        self.executions, self.latest = 0, b""
        self.outcomes: Counter[str] = Counter()
        self._before = (0, 0.0)
        logging.getLogger("paramove").addHandler(self)
        logging.getLogger("paramove").propagate = False

    def emit(self, record: logging.LogRecord) -> None:
        """What the relay logs is printable."""
        expect(record.getMessage().isprintable(), f"it logs {record.getMessage()!r:.200}")

    def step(self) -> None:
        """Some messages each way."""
        self._drain()
        for _ in range(10):
            self._send()
        if self._generator.random() < 0.02:
            for _ in range(12):
                with self._raw.connection(self._generator.random() < 0.5) as one:
                    one.send_multipart(self._frames(self._asked))
                    self._turn()
        self._turn()
        if self._before == (0, 0.0) and self.executions > 3000:
            self._before = (descriptors(), memory_mib())
        if self.executions % 5000 < 10:
            self._check()

    def _turn(self) -> None:
        limited(self._relay.step)
        self._publisher.serve()
        while self._subscriber.receive() is not None:
            self.outcomes["crossed"] += 1

    def _drain(self) -> None:
        """Reads beats and requests of the relay, and answers some beats as it should be."""
        for offer in (self._raw.offer, self._raw.images):
            while offer.poll(0):
                identity, first, *_ = offer.recv_multipart()
                message = link.ASKED.read(first)
                if isinstance(message, link.Want):
                    self._ends.pop((offer, identity), None)
                    self._ends[offer, identity] = message.names
                elif isinstance(message, link.Beat) and self._generator.random() < 0.5:
                    answer = message.model_copy(update={"there_ns": time.monotonic_ns()})
                    offer.send_multipart([identity, answer.line()], zmq.NOBLOCK)
        self._ends = dict(list(self._ends.items())[-6:])  # a connection that was made anew has another identity
        while self._raw.asks.poll(0):
            self._raw.asks.recv_multipart()

    def _send(self) -> None:
        self.executions += 1
        topic = self._generator.choice(self.GIVES)
        if self._generator.random() < 0.5 or not self._ends:
            with contextlib.suppress(zmq.Again):
                self._raw.asks.send_multipart(self._frames(self._asked), zmq.NOBLOCK)
            return
        ends = [end for end, names in self._ends.items() if topic.name in names or self._generator.random() < 0.05]
        for offer, identity in ends[:1]:
            offer.send_multipart([identity, *self._frames(self._given, topic)], zmq.NOBLOCK)

    def _frames(self, made: Messages, topic: topics.Topic = topics.SPEECH) -> list[bytes]:
        """A damaged first frame; or a good one, and damaged ones behind it."""
        way = self._generator.randrange(4)
        frames = [made.damaged()]
        if way == 0:
            frames = [
                made.good(),
                *(self._generator.randbytes(9) for _ in range(self._generator.choice([0, 1, 3, 30]))),
            ]
        elif way > 1 and made is self._given:
            frames = [link.Content(topic=topic.name).line(), *self._message(topic.type)]
        elif way > 1:
            frames = [link.Answered().line(), *self._message(TickDone)]
        self.latest = b"\n".join(frames)
        return frames

    def _message(self, kind: Any) -> list[bytes]:
        """Header and payload; one of them, both or none damaged, or with impossible times."""
        payload = bus_message(kind, self._generator).SerializeToString()
        if kind is TickDone and self._generator.random() < 0.5:
            payload = TickDone(node="tracker", kind=TickDone.KIND_JOIN, pid=3).SerializeToString()
        if self._generator.random() < 0.3:
            payload = mutate(payload, payload, self._generator)
        time_ns = self._generator.choice([0, time.monotonic_ns(), time.monotonic_ns(), 2**63 - 1, -(2**63)])
        sequence = self._generator.choice([0, 2**64 - 1]) if self._generator.random() < 0.02 else self.executions
        flags = self._generator.choice([0, 0, self._generator.randrange(256)])
        epoch = 1 + self.executions // self._generator.choice([500, 500, 700])
        header = pack(Envelope(schema_hash(kind), 1, epoch, sequence, time_ns, time_ns, flags), payload)
        if self._generator.random() < 0.2:
            header = mutate(header, header, self._generator)
        return [header, payload]

    def _check(self) -> None:
        """Good messages cross both ways, and nothing has grown without bound."""
        number = self.outcomes["checked"]
        text = f"good {number}"
        payload = Speech(text=text).SerializeToString()
        epoch = 2**31 + number
        sequence = 0
        now_ns = time.monotonic_ns()
        self._publisher.publish(Rules(rules=[Rule(object=text)]), now_ns, now_ns)
        want = link.Want(names=[topics.RULES.name]).line()
        came = gave = False
        end_s = time.monotonic() + 20.0
        with self._raw.connection() as asks:
            while not (came and gave):
                expect(time.monotonic() < end_s, f"a good message does not cross: in {came}, out {gave}")
                self._drain()
                asks.send_multipart([want], zmq.NOBLOCK)
                sequence += 1  # a subscriber that connects late counts the ones before as published
                envelope = Envelope(schema_hash(Speech), 1, epoch, sequence, time.monotonic_ns(), time.monotonic_ns())
                header = pack(envelope, payload)
                for (offer, identity), names in self._ends.items():
                    if topics.SPEECH.name in names:
                        frames = [link.Content(topic=topics.SPEECH.name).line(), header, payload]
                        offer.send_multipart([identity, *frames], zmq.NOBLOCK)
                limited(self._relay.step)
                self._publisher.serve()
                while (received := self._subscriber.receive()) is not None:
                    came = came or received.message.text == text
                while asks.poll(0):
                    gave = gave or text.encode() in asks.recv_multipart()[-1]
        self.outcomes["checked"] += 1
        if self._before != (0, 0.0):
            more, more_mib = descriptors() - self._before[0], memory_mib() - self._before[1]
            expect(more <= MORE_DESCRIPTORS, f"{more} more descriptors")
            expect(more_mib <= MOST_MIB, f"{more_mib:.0f} MiB more")

    def end(self) -> None:
        """A good message crosses, whatever came before."""
        self._check()
        self.outcomes["rejected"] = sum(map(int, re.findall(r"(\d+) rejected", self._relay.detail)))
        logging.getLogger("paramove").removeHandler(self)
        self._opened.close()


class SimulatedCrossing(Crossing):
    """The same in simulated time, where messages cross as they are."""

    CLOCK = "simulated"


TARGETS: dict[str, Any] = {
    "readers": Readers,
    "control": Control,
    "launcher": Launcher,
    "agent": Agents,
    "relay": Crossing,
    "simulated": SimulatedCrossing,
}


def fuzz(seconds: float, seed: int, write: Callable[[str], object]) -> int:
    """Fuzzes and prints the counts; returns the exit code."""
    write(f"{'':9} {'inputs':>9}  memory  outcomes\n")
    for name, kind in TARGETS.items():
        with tempfile.TemporaryDirectory(prefix="pm-", dir="/tmp") as folder:  # paths of sockets are short
            target = kind(random.Random(seed), Path(folder))
            begun_s = time.monotonic()
            try:
                while time.monotonic() - begun_s < seconds / len(TARGETS):
                    target.step()
                target.end()
            except Exception:
                with tempfile.NamedTemporaryFile(prefix="paramove-fuzz-", delete=False) as file:
                    file.write(target.latest)
                write(f"{traceback.format_exc()}seed {seed}, {name}, input {target.executions}: {file.name}\n")
                return 1
        outcomes = ", ".join(f"{outcome} {count}" for outcome, count in sorted(target.outcomes.items()))
        write(f"{name:9} {target.executions:9} {memory_mib():4.0f} MiB  {outcomes}\n")
    return 0


if __name__ == "__main__":
    run(__doc__, fuzz)
