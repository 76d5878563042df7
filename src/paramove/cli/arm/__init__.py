"""`paramove arm`: a servo arm's bus, its calibration, and its stop."""

from __future__ import annotations

import typer

from paramove.cli.arm import bench, calibrate, enable, estop, jog, reboot, scan, setup, teach, verify

app = typer.Typer(
    name="arm", no_args_is_help=True, help="Find, set up, calibrate, check, teach, move and stop an arm of servos."
)
for command in (
    scan.scan,
    setup.setup,
    calibrate.calibrate,
    verify.verify,
    reboot.reboot,
    bench.bench,
    enable.enable,
    enable.disable,
    teach.teach,
    jog.jog,
    estop.estop,
):
    app.command()(command)
