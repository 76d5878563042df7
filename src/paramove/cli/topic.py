"""`paramove topic`: topics, messages and rates on the bus."""

from __future__ import annotations

import json
import math
from typing import Annotated, Any

import typer

from paramove.bus import inspection, is_map, topics
from paramove.cli import completions
from paramove.cli.bus_options import DomainOption, bus_folder, show, topic_named, with_old_keys
from paramove.cli.output import JsonOption, ended
from paramove.documents import exit_codes

app = typer.Typer(name="topic", help="Look at topics, messages and rates on the bus.", no_args_is_help=True)

NameArgument = Annotated[
    str, typer.Argument(help="name of the topic, such as camera/image", autocompletion=completions.topics)
]
LONGEST_BYTES = 32
"""Longer byte fields are shown by their length."""


@app.command("list")
def list_topics(domain: DomainOption = None, as_json: JsonOption = False) -> None:
    """List every topic, its type and its publisher."""
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


@app.command()
def echo(
    name: NameArgument,
    domain: DomainOption = None,
    as_json: JsonOption = False,
    count: Annotated[int, typer.Option(min=1, help="end after so many messages")] = 10,
    seconds: Annotated[float, typer.Option(min=0.1, help="end after so long")] = 10.0,
) -> None:
    """Print messages as they arrive: one per block, or with --json one JSON object per line."""
    folder, topic = bus_folder(domain), topic_named(name)
    messages = 0
    for received in inspection.listen(folder, [topic], seconds):
        messages += 1
        content = readable(received.message)
        head = {
            "sequence": received.sequence,
            "captured_ns": received.captured_ns,
            "published_ns": received.published_ns,
        }
        if as_json:
            typer.echo(json.dumps(head | {"message": content}))
        else:
            typer.echo(f"--- {topic.name} {received.sequence}, captured at {received.captured_ns * 1e-9:.3f} s")
            typer.echo(json.dumps(content, indent=2, ensure_ascii=True))
        if messages == count:
            return
    if messages == 0:
        state = inspection.publisher_of(folder, topic)
        reason = f"{state.holder} published nothing" if state.alive else "no publisher"
        raise ended(f"{topic.name}: {reason} within {seconds:g} s", exit_codes.FAILURE)


@app.command()
def hz(
    names: Annotated[
        list[str] | None,
        typer.Argument(help="topics; default: all with a publisher", autocompletion=completions.topics),
    ] = None,
    domain: DomainOption = None,
    as_json: JsonOption = False,
    seconds: Annotated[float, typer.Option(min=0.1, help="how long to listen")] = 3.0,
) -> None:
    """Measure rates, losses, the longest gap and sizes. Reads envelopes only."""
    folder = bus_folder(domain)
    alive = {item.topic.name for item in inspection.publishers(folder) if item.alive}
    requested = [topic_named(name) for name in names] if names else [topics.by_name(name) for name in sorted(alive)]
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
            "state": _state(item.topic.name in alive, item.counter.epoch is not None),
        }
        for item in inspection.measure(folder, requested, seconds)
    ]
    show(rows, as_json)


def readable(message: Any) -> dict[str, Any]:
    """A message as JSON values; long byte fields only by their length."""
    return {field.name: _json_value(field, value) for field, value in message.ListFields()}


def _json_value(field: Any, value: Any) -> Any:
    if hasattr(value, "ListFields"):
        return readable(value)
    if isinstance(value, bytes):
        return f"<{len(value)} bytes>" if len(value) > LONGEST_BYTES else value.hex()
    if is_map(field):
        kind = field.message_type.fields_by_name["value"]
        return {str(key): _json_value(kind, item) for key, item in value.items()}
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
