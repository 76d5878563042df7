"""`paramove arm bench`: how fast the bus is."""

from __future__ import annotations

import json
import math
from dataclasses import asdict
from typing import TYPE_CHECKING, Annotated

import typer

from paramove.cli.arm.options import BaudOption, ByIdOption, DataOption, SerialOption, open_arm
from paramove.cli.output import JsonOption, ended
from paramove.documents import exit_codes

if TYPE_CHECKING:
    from paramove.robots.dynamixel import BusBench

MIN_COMPLETE = 0.99


def bench(
    rounds: Annotated[int, typer.Option(min=10, help="how often all servos are read")] = 500,
    rate: Annotated[int, typer.Option(min=0, metavar="HZ", help="that the bus must hold")] = 0,
    serial: SerialOption = "",
    baud_rate: BaudOption = 0,
    by_id: ByIdOption = None,
    data: DataOption = None,
    as_json: JsonOption = False,
) -> None:
    """Measure reading all servos at once: times, errors by kind, and the rates that the bus can hold. Reads only.

    Exit codes: 0 measured; 3 it cannot hold --rate, more than one read in 100 is not complete, or the adapter's latency
    timer is slow; 69 no adapter or servo.
    """
    from paramove.robots.dynamixel import bench_bus, latency_timer_ms, slow_timer

    with open_arm(by_id, serial, data, baud_rate) as arm:
        numbers = sorted({servo.number for servo in arm.chain.ping_all()})
        if not numbers:
            where = f"no servo answers at {arm.chain.port.baud_rate}; `paramove arm scan` tries other baud rates"
            raise ended(where, exit_codes.UNAVAILABLE)
        bench = bench_bus(arm.chain, numbers, rounds)
        device = arm.adapter.device
        timer_ms = latency_timer_ms(device)
    findings = [] if timer_ms is None else [slow_timer(device, timer_ms)]
    if as_json:
        values = {name: None if value != value else value for name, value in asdict(bench).items()}
        typer.echo(json.dumps(values | {"latency_timer_ms": timer_ms}, indent=2))
    else:
        _print(bench)
    if bench.complete < MIN_COMPLETE * bench.rounds:
        findings.append("answers are missing or damaged: `paramove arm scan` shows who answers, and how")
    if rate > max(bench.rates_hz, default=0):
        findings.append(f"the bus cannot hold {rate} Hz: at most {max(bench.rates_hz, default=0)} Hz of those tried")
    if any(findings):
        raise ended("\n".join(filter(None, findings)), exit_codes.JUDGED_A_FAILURE)


def _print(bench: BusBench) -> None:
    typer.echo(f"{bench.servos} servos at {bench.baud_rate}: {bench.complete} of {bench.rounds} reads complete")
    if not math.isnan(bench.p50_ms):
        times = f"p50 {bench.p50_ms:.2f} ms, p99 {bench.p99_ms:.2f} ms, longest {bench.longest_ms:.2f} ms"
        typer.echo(f"one read of all positions and velocities: {times}")
    typer.echo(", ".join(f"{name} {count}" for name, count in bench.errors.items()))
    rates = ", ".join(f"{rate} Hz" for rate in bench.rates_hz)
    typer.echo(f"can hold: {rates or 'none of the usual rates'}")
