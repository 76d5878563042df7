"""Runs the project's own launch files as a person does."""

import json
import os
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
WATCHING = str(Path(__file__).parent / "overlays" / "watching.yaml")


class Launcher:
    """`paramove launch` in a domain and with run folders of its own; `within` is what each command begins with."""

    def __init__(self, folder, runtime):
        self.folder = folder
        self.environment = os.environ | {"XDG_RUNTIME_DIR": runtime, "PARAMOVE_DOMAIN": "test"}
        self.started = []
        self.within = ()

    def start(self, *arguments, **options):
        command = [
            *self.within,
            sys.executable,
            "-m",
            "paramove.cli.main",
            "launch",
            *arguments,
            "--runs",
            str(self.folder),
        ]
        options = {"stdout": subprocess.PIPE, "stderr": subprocess.STDOUT, "text": True, **options}
        self.started.append(subprocess.Popen(command, cwd=ROOT, env=self.environment, **options))
        return self.started[-1]

    def run(self, *arguments, timeout_s=300):
        process = self.start(*arguments)
        shown = process.communicate(timeout=timeout_s)[0]
        return process.returncode, shown

    @property
    def latest(self):
        return self.folder / "latest"

    def truth(self):
        return json.loads((self.latest / "truth.json").read_text())


@pytest.fixture(scope="session")
def installed(tmp_path_factory):
    """A folder with what the wheel installs."""
    folder = tmp_path_factory.mktemp("wheel")
    offline = ["--quiet", "--no-deps", "--disable-pip-version-check"]
    pip = [sys.executable, "-m", "pip"]
    subprocess.run([*pip, "wheel", str(ROOT), "--no-build-isolation", *offline, "-w", str(folder)], check=True)
    (wheel,) = folder.glob("*.whl")
    subprocess.run(
        [*pip, "install", str(wheel), *offline, "--no-compile", "--target", str(folder / "site")], check=True
    )
    return folder / "site"


@pytest.fixture
def launcher(tmp_path):
    runtime = tempfile.mkdtemp(prefix="pm-", dir="/tmp")
    made = Launcher(tmp_path, runtime)
    yield made
    for process in made.started:
        if process.poll() is None:
            process.terminate()
        process.communicate()
    shutil.rmtree(runtime)
