"""`paramove topic`: topics, messages and rates on the bus."""

from __future__ import annotations

import contextlib
import itertools
import json
import math
import re
from statistics import median
from typing import Annotated, Any

import typer

from paramove.bus import Received, TopicTakenError, inspection, is_map, topics, value_of
from paramove.cli import completions
from paramove.cli.bus_options import DomainOption, bus_folder, show, topic_named, with_old_keys
from paramove.cli.output import JsonOption, ended, one_line
from paramove.client import NoMessageError, connect, message_of
from paramove.documents import exit_codes, nearest

app = typer.Typer(name="topic", help="Look at topics, messages and rates on the bus.", no_args_is_help=True)

NameArgument = Annotated[
    str, typer.Argument(help="name of the topic, such as camera/image", autocompletion=completions.topics)
]
NamesArgument = Annotated[
    list[str] | None,
    typer.Argument(help="topics; default: all with a publisher", autocompletion=completions.topics),
]
SecondsOption = Annotated[float, typer.Option(min=0.1, help="how long to listen")]
PATH_PART = re.compile(r"(?:^|\.)([A-Za-z_]\w*)|\[([^\]]*)\]")
LONGEST_BYTES = 32
"""Longer byte fields are shown by their length."""


@app.command("list")
def list_topics(
    domain: DomainOption = None,
    as_json: JsonOption = False,
    every: Annotated[bool, typer.Option("--all", help="those that nobody publishes, too")] = False,
) -> None:
    """List the topics that are published, their types and their publishers."""
    rows = [
        {
            "topic": item.topic.name,
            "type": item.topic.type_name,
            "rate_hz": item.topic.rate_hz,
            "profile": item.topic.profile.value,
            "recorded": item.topic.recorded,
            "publisher": item.holder if item.alive else "none",
        }
        for item in inspection.publishers(bus_folder(domain))
        if item.alive or every
    ]
    show(rows, as_json)


@app.command()
def info(name: NameArgument, domain: DomainOption = None, as_json: JsonOption = False, wait_s: float = 1.0) -> None:
    """Show one topic: its row of the table, its publisher and the number of its messages."""
    folder, topic = bus_folder(domain), topic_named(name)
    publisher = inspection.publisher_of(folder, topic)
    row: dict[str, Any] = {
        "topic": topic.name,
        "type": topic.type_name,
        "rate_hz": topic.rate_hz,
        "profile": topic.profile.value,
        "frame": topic.frame,
        "recorded": topic.recorded,
        "alive": publisher.alive,
        "publisher": publisher.holder if publisher.alive else "none",
    }
    if publisher.alive:
        (measured,) = inspection.measure(folder, [topic], wait_s)
        counter = measured.counter
        row |= {"answers": counter.epoch is not None, "epoch": counter.epoch or 0, "published": counter.sequence}
    if as_json:
        typer.echo(json.dumps(with_old_keys(row), indent=2))
    else:
        show([{"": key, " ": value} for key, value in row.items()], as_json=False)


@app.command("type")
def type_of(name: NameArgument) -> None:
    """Print the type of a topic's messages; `paramove interface show TYPE` prints their fields."""
    typer.echo(topic_named(name).type_name)


@app.command()
def echo(
    name: NameArgument,
    domain: DomainOption = None,
    as_json: JsonOption = False,
    count: Annotated[int | None, typer.Option(min=1, help="end after so many messages; default: never")] = None,
    once: Annotated[bool, typer.Option("--once", help="end after one message")] = False,
    field: Annotated[
        str, typer.Option(metavar="PATH", help="only a part of each message, such as joints[0].position")
    ] = "",
    seconds: Annotated[float | None, typer.Option(min=0.1, help="end after so long; default: never")] = None,
) -> None:
    """Print messages as they arrive, until Ctrl-C: one per block, or with --json one JSON object per line.

    Exit codes: 0 done; 1 nothing arrived within --seconds, or nothing runs; 2 there is no such topic or part.
    """
    folder, topic = bus_folder(domain), topic_named(name)
    most = 1 if once else count
    messages = 0
    if not inspection.publisher_of(folder, topic).alive:
        typer.echo(f"{topic.name} has no publisher yet in the domain {folder.name}; waits for one", err=True)
    with contextlib.suppress(KeyboardInterrupt):
        for received in inspection.listen(folder, [topic], math.inf if seconds is None else seconds):
            messages += 1
            content = _part(received.message, field) if field else readable(received.message)
            _print_message(received, content, as_json, is_part=bool(field))
            if messages == most:
                return
        if messages == 0:
            raise ended(inspection.why_nothing_came(folder, topic, seconds or math.inf), exit_codes.FAILURE)


def _print_message(received: Received, content: Any, as_json: bool, is_part: bool) -> None:
    if as_json:
        head = {
            "sequence": received.sequence,
            "captured_ns": received.captured_ns,
            "published_ns": received.published_ns,
        }
        typer.echo(json.dumps(head | {"message": content}))
        return
    if not is_part:
        captured_s = 1e-9 * received.captured_ns
        typer.echo(f"--- {received.topic.name} {received.sequence}, captured at {captured_s:.3f} s")
    typer.echo(json.dumps(content, indent=2, ensure_ascii=True))


def _part(message: Any, path: str) -> Any:
    """The part of a message at a path such as `joints[0].position`; None where a list or map has no such item."""
    value: Any = message
    field: Any = None
    for name, index in PATH_PART.findall(path):
        if name:
            field = value.DESCRIPTOR.fields_by_name.get(name) if hasattr(value, "DESCRIPTOR") else None
            if field is None:
                known = value.DESCRIPTOR.fields_by_name if hasattr(value, "DESCRIPTOR") else ()
                raise ended(f"there is no part '{name}' in '{path}'; {nearest(name, known)}", exit_codes.USAGE)
            value = getattr(value, name)
        elif index.isdecimal() and int(index) < len(value) and not is_map(field):
            value = value[int(index)]
        elif is_map(field) and index in {str(key) for key in value}:
            value = next(item for key, item in value.items() if str(key) == index)
            field = value_of(field)
        else:
            return None
    return _json_value(field, value)


@app.command()
def pub(
    name: NameArgument,
    content: Annotated[str, typer.Argument(help="the message in YAML, such as '{position_m: 0.5}'")] = "{}",
    domain: DomainOption = None,
    rate_hz: Annotated[
        float | None, typer.Option("--rate", min=0.01, max=1000.0, help="again and again, until Ctrl-C")
    ] = None,
    count: Annotated[int | None, typer.Option(min=1, help="with --rate: end after so many")] = None,
    once: Annotated[bool, typer.Option("--once", help="one message, as without --rate")] = False,
    wait_s: Annotated[float, typer.Option("--wait", min=0.0, metavar="SECONDS", help="for a first subscriber")] = 2.0,
) -> None:
    """Publish a message, once or at a rate, on a topic that nobody else publishes.

    The time of the message is that of the run. Nobody arms an arm so: `paramove arm enable` asks a person.

    Exit codes: 0 published; 1 nobody subscribes, or the simulated time is not known; 2 there is no such topic;
    66 nothing runs; 75 a node publishes it; 78 that is no message of the topic, or too large a one, or the topic is for
    nodes or persons.
    """
    topic = topic_named(name)
    most = 1 if once else count
    number, subscribers = 0, False
    try:
        with one_line(), connect(domain, "paramove topic pub") as run:
            message = message_of(topic.type, content)
            for number in itertools.count(1):
                subscribers = run.publish(topic.name, message, wait_s if number == 1 else 0.0)
                if rate_hz is None or number == most:
                    break
                run.idle(1 / rate_hz)
    except KeyboardInterrupt:
        pass
    except TopicTakenError as error:
        remedy = "leave the node that publishes it out, by an overlay with `external` (docs/how-to/ros2_verbs.md)"
        raise ended(f"{error}: {remedy}", exit_codes.TEMPORARY) from error
    except NoMessageError as error:  # of the clock
        raise ended(str(error), exit_codes.FAILURE) from error
    except ValueError as error:  # too large
        raise ended(str(error), exit_codes.CONFIGURATION) from error
    if number and not subscribers:
        raise ended(f"{topic.name}: published, but nobody subscribed within {wait_s:g} s", exit_codes.FAILURE)
    typer.echo(f"{topic.name}: published {number} message{'' if number == 1 else 's'}")


@app.command()
def hz(
    names: NamesArgument = None, domain: DomainOption = None, as_json: JsonOption = False, seconds: SecondsOption = 3.0
) -> None:
    """Measure rates, losses, the longest gap and sizes. Reads envelopes only."""
    rows = [
        {
            "topic": item.topic.name,
            "rate_hz": round(item.rate_hz, 2),
            "nominal_hz": item.topic.rate_hz,
            "messages": item.counter.messages,
            "lost": item.counter.lost,
            "refused": item.counter.rejected.total(),
            "longest_gap_s": round(item.longest_gap_s, 4),
            "mean_bytes": round(item.mean_bytes),
            "state": _state(alive, item.counter.epoch is not None),
        }
        for item, alive in _measured(names, domain, seconds)
    ]
    show(rows, as_json)


@app.command()
def bw(
    names: NamesArgument = None, domain: DomainOption = None, as_json: JsonOption = False, seconds: SecondsOption = 3.0
) -> None:
    """Measure the bandwidth of topics: bytes a second, and sizes of messages. Reads envelopes only."""
    rows = [
        {
            "topic": item.topic.name,
            "bytes_per_s": round(item.bytes_per_s),
            "messages": len(item.sizes),
            "mean_bytes": round(item.mean_bytes),
            "least_bytes": min(item.sizes, default=0),
            "most_bytes": max(item.sizes, default=0),
        }
        for item, _ in _measured(names, domain, seconds)
    ]
    show(rows, as_json)


@app.command()
def delay(
    names: NamesArgument = None, domain: DomainOption = None, as_json: JsonOption = False, seconds: SecondsOption = 3.0
) -> None:
    """Measure how old messages are: from capture to publication, and from there to this command.

    In simulated time only the first is known.
    """
    rows = [
        {
            "topic": item.topic.name,
            "messages": len(item.arrivals_s),
            **_times("captured_to_published", item.waits_s),
            **_times("published_to_here", item.delays_s),
        }
        for item, _ in _measured(names, domain, seconds)
    ]
    show(rows, as_json)


def _times(what: str, times_s: list[float]) -> dict[str, float | None]:
    if not times_s:
        return {f"{what}_ms": None, f"{what}_max_ms": None}
    return {f"{what}_ms": round(1e3 * median(times_s), 2), f"{what}_max_ms": round(1e3 * max(times_s), 2)}


def _measured(names: list[str] | None, domain: str | None, seconds: float) -> list[tuple[inspection.Measurement, bool]]:
    """Measurements of topics, by default of all with a publisher, and whether each has one."""
    folder = bus_folder(domain)
    alive = {item.topic.name for item in inspection.publishers(folder) if item.alive}
    requested = [topic_named(name) for name in names] if names else [topics.by_name(name) for name in sorted(alive)]
    return [(item, item.topic.name in alive) for item in inspection.measure(folder, requested, seconds)]


def readable(message: Any) -> dict[str, Any]:
    """A message as JSON values, zeros as well; long byte fields only by their length."""
    fields = message.DESCRIPTOR.fields
    there = [field for field in fields if not field.has_presence or message.HasField(field.name)]
    return {field.name: _json_value(field, getattr(message, field.name)) for field in there}


def _json_value(field: Any, value: Any) -> Any:
    if hasattr(value, "ListFields"):
        return readable(value)
    if isinstance(value, bytes):
        return f"<{len(value)} bytes>" if len(value) > LONGEST_BYTES else value.hex()
    if is_map(field):
        return {str(key): _json_value(value_of(field), item) for key, item in value.items()}
    if hasattr(value, "__len__") and not isinstance(value, str):
        return [_json_value(field, item) for item in value]
    if field.enum_type:
        known = field.enum_type.values_by_number.get(value)
        return known.name if known else value
    return value if not isinstance(value, float) or math.isfinite(value) else str(value)


def _state(alive: bool, welcomed: bool) -> str:
    if not alive:
        return "no publisher"
    return "published" if welcomed else "not responding"
