"""What a change of the code leaves equal: payloads of repeatable runs, and numbers of short evaluations.

    python studies/payload_hashes.py measure before.json     with the code before the change (half an hour)
    python studies/payload_hashes.py measure after.json      with the code after it, on the same machine
    python studies/payload_hashes.py compare before.json after.json

Applications run in simulated time, so one seed gives the same messages each time. Of each recorded topic all payloads
are hashed, without messages for people, and truth too. Status and images are left out: a status follows the wall
clock, and an image is as large as everything else. Of an evaluation all numbers but times are compared. The hashes
hold on one machine: rendering and linear algebra differ between processors in the last bits.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import os
import re
import shlex
import subprocess
import sys
import tempfile
from collections import deque
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from google.protobuf import descriptor_pool, message_factory  # type: ignore[import-untyped]
from google.protobuf.descriptor_pb2 import FileDescriptorSet  # type: ignore[import-untyped]
from mcap.reader import make_reader

APPLICATIONS = ("rule_learning", "pointing", "relocate_by_pointing")
SEEDS = range(3)
EVALUATIONS = {
    "chapter2": "python -m studies chapter2 --seed 0 --out {out} --json {out}/numbers.json",
    "chapter4": "python -m studies chapter4 --quick --out {out} --json {out}/numbers.json",
    "imitation": "python -m studies imitation --repetitions 10 --no-grid --report {out}",
    "real": "python -m studies real --task pointing --method quadratic --out {out} --json {out}/numbers.json",
    "real_images": "python -m studies real-images --out {out} --json {out}/numbers.json",
}
NOT_MET = 3
"""Exit code of an evaluation that measured everything and missed a goal."""
FREE_TEXT = frozenset({"detail", "reason", "refusal", "rejection", "sentence", "text"})
LEFT_OUT = ("status/", "clock")
LAST_MESSAGES = 50
RENAMED: dict[str, str] = {"camera/light": "camera/image_raw"}
"""Topics: name before the change -> name after it."""
TIMES = re.compile(r"(?<![a-z])(seconds?|minutes?|times?|ms|took|date|commit|versions?|fit|classify)(?![a-z])|, s$")
"""Words in the names of numbers that differ from run to run."""


def payload_hashes(recording: Path) -> dict[str, dict[str, str]]:
    """By topic: the hashes of all payloads in order up to each of the last messages, by how many these are.

    Messages are decoded by the schemas in the file. A launcher ends a run by the wall clock, so how many ticks are
    recorded after the application has come to its end differs: two runs are the same if one begins as the other.
    """
    hashes: dict[str, Any] = {}
    last: dict[str, deque[tuple[int, str]]] = {}
    classes: dict[int, Any] = {}
    with recording.open("rb") as file:
        for schema, channel, message in make_reader(file).iter_messages():
            if schema is None or channel.topic.startswith(LEFT_OUT) or schema.name.endswith("Image"):
                continue
            if schema.id not in classes:
                classes[schema.id] = _message_class(schema.name, schema.data)
            one = classes[schema.id].FromString(message.data)
            _clear_text(one)
            digest = hashes.setdefault(channel.topic, hashlib.sha256())
            payload = one.SerializeToString(deterministic=True)
            digest.update(len(payload).to_bytes(4, "little") + payload)
            ends = last.setdefault(channel.topic, deque([(0, "")], LAST_MESSAGES))
            ends.append((ends[-1][0] + 1, digest.hexdigest()))
    return {topic: {str(count): digest for count, digest in ends} for topic, ends in sorted(last.items())}


def same(before: Any, after: Any) -> bool:
    """Whether two numbers are equal, NaN too, or two topics up to the end of the shorter one."""
    if isinstance(before, dict) and isinstance(after, dict):
        ends = [max(one, key=int) for one in (before, after)]
        end = min(ends, key=int)
        return end in before and before[end] == after.get(end)
    return bool(before == after or (before != before and after != after))


def _message_class(name: str, descriptors: bytes) -> Any:
    pool = descriptor_pool.DescriptorPool()
    for file in FileDescriptorSet.FromString(descriptors).file:
        pool.Add(file)
    return message_factory.GetMessageClass(pool.FindMessageTypeByName(name))


def _clear_text(message: Any) -> None:
    for field, value in message.ListFields():
        if field.name in FREE_TEXT:
            message.ClearField(field.name)
        elif field.message_type is not None and not field.message_type.GetOptions().map_entry:
            for one in [value] if hasattr(value, "ListFields") else value:
                _clear_text(one)


def numbers_in(value: Any, path: str = "") -> Iterator[tuple[str, Any]]:
    """Numbers, words and truth values of a JSON document by their paths, without times."""
    if isinstance(value, dict):
        for key, one in value.items():
            if not TIMES.search(key):
                yield from numbers_in(one, f"{path}.{key}")
    elif isinstance(value, list):
        for number, one in enumerate(value):
            yield from numbers_in(one, f"{path}[{number}]")
    elif not isinstance(value, str):
        yield path, value


def measure(out: Path, seeds: list[int], applications: list[str], evaluations: list[str]) -> int:
    """Runs everything and writes the file; the exit code."""
    found: dict[str, Any] = {"hashes": {}, "numbers": {}}
    failed = 0
    with tempfile.TemporaryDirectory(prefix="payloads-") as folder:
        for application in applications:
            for seed in seeds:
                runs = Path(folder, application, str(seed))
                command = f"paramove launch {application} --headless --seed {seed} --runs {runs}"
                failed += _run(command, (0,))
                found["hashes"][f"{application} {seed}"] = {
                    topic: one
                    for name in ("recording.mcap", "truth.mcap")
                    if (recording := runs / "latest" / name).exists()
                    for topic, one in payload_hashes(recording).items()
                }
        for name in evaluations:
            results = Path(folder, name)
            failed += _run(EVALUATIONS[name].format(out=results), (0, NOT_MET))
            found["numbers"][name] = {
                f"{file.name}{path}": value
                for file in sorted(results.rglob("*.json"))
                for path, value in numbers_in(json.loads(file.read_text(encoding="utf-8")))
            }
        out.write_text(json.dumps(found, indent=1) + "\n", encoding="utf-8")
    return int(failed > 0)


def _run(command: str, good: tuple[int, ...]) -> bool:
    sys.stdout.write(f"$ {command}\n")
    sys.stdout.flush()
    environment = os.environ | {"PATH": f"{Path(sys.executable).parent}:{os.environ['PATH']}"}
    answer = subprocess.run(shlex.split(command), env=environment, capture_output=True, text=True, check=False)
    if answer.returncode not in good:
        sys.stdout.write(f"exit code {answer.returncode}\n{answer.stdout[-2000:]}{answer.stderr[-2000:]}\n")
    return answer.returncode not in good


def differences(before: dict[str, Any], after: dict[str, Any]) -> Iterator[str]:
    """One line for each topic or number that is not the same."""
    for kind in ("hashes", "numbers"):
        for name in sorted({*before[kind], *after[kind]}):
            old, new = before[kind].get(name, {}), after[kind].get(name, {})
            if kind == "hashes":
                old = {RENAMED.get(topic, topic): one for topic, one in old.items()}
            for key in sorted({*old, *new}):
                if not same(old.get(key), new.get(key)):
                    told = [list(one)[-1:] if isinstance(one, dict) else one for one in (old.get(key), new.get(key))]
                    yield f"{name}: {key}: {told[0]} before, {told[1]} after"


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    commands = parser.add_subparsers(dest="command", required=True)
    measuring = commands.add_parser("measure", help="run everything and write FILE")
    measuring.add_argument("file", type=Path)
    measuring.add_argument("--seeds", type=int, nargs="*", default=list(SEEDS))
    measuring.add_argument("--applications", nargs="*", default=list(APPLICATIONS), choices=APPLICATIONS)
    measuring.add_argument("--evaluations", nargs="*", default=list(EVALUATIONS), choices=list(EVALUATIONS))
    comparing = commands.add_parser("compare", help="exit code 1 if anything differs")
    comparing.add_argument("before", type=Path)
    comparing.add_argument("after", type=Path)
    chosen = parser.parse_args()
    if chosen.command == "measure":
        sys.exit(measure(chosen.file, chosen.seeds, chosen.applications, chosen.evaluations))
    before, after = (json.loads(file.read_text(encoding="utf-8")) for file in (chosen.before, chosen.after))
    found = list(differences(before, after))
    same = sum(len(one) for kind in ("hashes", "numbers") for one in before[kind].values()) - len(found)
    sys.stdout.write("".join(f"{line}\n" for line in found) + f"{same} equal, {len(found)} different\n")
    sys.exit(bool(found))


if __name__ == "__main__":
    main()
