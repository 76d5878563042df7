"""`paramove arm`: a servo arm's bus, its calibration, and its stop."""

from __future__ import annotations

import typer

from paramove.cli.arm_bench import bench
from paramove.cli.arm_calibrate import calibrate
from paramove.cli.arm_enable import disable, enable
from paramove.cli.arm_estop import estop
from paramove.cli.arm_jog import jog
from paramove.cli.arm_reboot import reboot
from paramove.cli.arm_scan import scan
from paramove.cli.arm_setup import setup
from paramove.cli.arm_teach import teach
from paramove.cli.arm_verify import verify

app = typer.Typer(
    name="arm", no_args_is_help=True, help="Find, set up, calibrate, check, teach, move and stop an arm of servos."
)
for command in (scan, setup, calibrate, verify, reboot, bench, enable, disable, teach, jog, estop):
    app.command()(command)
