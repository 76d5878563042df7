"""Code run by a process of its own as an ordinary user, for what root may always do."""

import json
import os
import subprocess
import sys

import pytest

NOBODY = 65534
DROP = """
import json, os, sys
from pathlib import Path
from paramove.diagnosis.finding import Machine
from paramove.diagnosis.{module} import {function}
os.setgroups([])
os.setgid(65534)
os.setuid(65534)
def told(finding):
    return {{"level": finding.level, "sentence": finding.sentence, "remedy": finding.remedy, "fix": bool(finding.fix)}}
"""
"""Imports come first, as the ordinary user may not be allowed to read where the modules lie."""

needs_root = pytest.mark.skipif(os.geteuid() != 0, reason="only root can become an ordinary user")


def as_nobody(function, code, *arguments):
    """What the code prints as JSON; it may call the function, and `told` makes a finding printable."""
    begin = DROP.format(module=function.__module__.rpartition(".")[2], function=function.__name__)
    command = [sys.executable, "-c", begin + code, *map(str, arguments)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=60, check=False)
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)
