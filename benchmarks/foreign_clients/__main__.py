"""Programs that others wrote, unchanged, at the emulated servos: do they work as on a real bus?

    python benchmarks/foreign_clients [--link /tmp/paramove_servos]

Installs them into build/foreign_clients (once), starts three emulated servos in a process of their own for each, and
prints what each has done, and which packets the servos reject. They wait about 34 ms for an answer and do not repeat,
which on a busy machine is too little, so each has three tries. The exit code is 1 if one was never satisfied.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import venv
from pathlib import Path

from rich.console import Console
from rich.table import Table

HERE = Path(__file__).parent
ENVIRONMENT = HERE.parents[1] / "build" / "foreign_clients"
PYTHON = ENVIRONMENT / "bin" / "python"
# Of dynamixel-sdk the release that LeRobot needs; 4.1.0 empties its input before each question, and dynamixel_api
# reads late on purpose.
ALONE = ("lerobot==0.4.4",)  # installed without its dependency, a deep learning framework
PACKAGES = (
    "rustypot==1.13.1",
    "pypot==5.0.2",
    "dynamixel_api==1.0.3",
    "dynamixel-python==0.0.8",
    "dynamixel-controller==0.9.2",
    "setuptools<81",  # dynamixel-controller imports its pkg_resources
    "dynamixel-sdk==3.8.4",
    "numpy<2",
    "deepdiff",
    "tqdm",
)
CLIENTS = {
    "rustypot 1.13.1": "with_rustypot.py",
    "LeRobot 0.4.4": "with_lerobot.py",
    "pypot 5.0.2": "with_pypot.py",
    "dynamixel_api 1.0.3": "with_dynamixel_api.py",
    "dynamixel-python 0.0.8": "with_dxl2.py",
    "dynio 0.9.2": "with_dynio.py",
}
SERVOS = ("xl430_w250:1", "xl330_m288:2", "xl330_m288:3")
TIMEOUT_S = 60.0
TRIES = 3


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--link", type=Path, default=Path("/tmp/paramove_servos"), help="name of the emulated port")
    link: Path = parser.parse_args().link
    console = Console()
    install(console)
    table = Table("program", "what it has done", "satisfied", "tries", "rejected")
    satisfied = True
    for name, script in CLIENTS.items():
        with console.status(name):
            done, output, rejected, n_tries = False, "", "", 0
            while not done and n_tries < TRIES:
                done, output, rejected = tried(script, link)
                n_tries += 1
        table.add_row(name, output, "yes" if done else "[red]no[/]", str(n_tries), rejected)
        satisfied &= done
    console.print(table)
    return 0 if satisfied else 1


def install(console: Console) -> None:
    stamp = ENVIRONMENT / "installed"
    requirements = " ".join((*PACKAGES, *ALONE))
    if stamp.exists() and stamp.read_text() == requirements:
        return
    with console.status("installing third-party programs into build/foreign_clients"):
        venv.create(ENVIRONMENT, clear=True, with_pip=True)
        for packages in (PACKAGES, ("--no-deps", *ALONE)):
            subprocess.run([PYTHON, "-m", "pip", "install", "--quiet", *packages], check=True)
    stamp.write_text(requirements)


def tried(script: str, link: Path) -> tuple[bool, str, str]:
    """Whether a client is satisfied with fresh servos, its last line, and what the servos reject."""
    emulator = [sys.executable, "-m", "dynamixel_emulator"]
    port = ["--port", str(link)]
    rejected = ""
    servos = subprocess.Popen([*emulator, *SERVOS, *port, "--servo-rules-only"], stdout=subprocess.PIPE, text=True)
    try:
        assert servos.stdout is not None
        servos.stdout.readline()
        ran = subprocess.run(
            [PYTHON, HERE / script, link], capture_output=True, text=True, timeout=TIMEOUT_S, check=False
        )
    except subprocess.TimeoutExpired:
        return False, f"was not ready after {TIMEOUT_S:g} s", ""
    else:
        status = subprocess.run([*emulator, "status", *port, "--json"], capture_output=True, text=True, check=True)
        findings = json.loads(status.stdout)["judge"]["findings"]
        rejected = ", ".join(f"{count} {kind}" for kind, count in sorted(findings.items()))
    finally:
        servos.terminate()
        servos.communicate()
    output = ran.stdout if ran.returncode == 0 else ran.stderr
    return ran.returncode == 0, (output.strip() or "nothing").splitlines()[-1], rejected


if __name__ == "__main__":
    sys.exit(main())
