"""Stands in for ssh: runs the command on "another host", another home folder, and copies its input and output.

Usage: python ssh_stand_in.py ENVIRONMENT_FILE HOST COMMAND. Killed, it is a cut connection; stopped, one that is
silent.
"""

import json
import os
import selectors
import subprocess
import sys
from pathlib import Path


def main(file, command):
    added = json.loads(Path(file).read_text())
    environment = {**os.environ, **added}
    there = subprocess.Popen(
        ["sh", "-c", command], stdin=subprocess.PIPE, stdout=subprocess.PIPE, env=environment, cwd=added.get("HOME")
    )
    into = there.stdin.fileno()
    ways = selectors.SelectSelector()
    ways.register(sys.stdin.fileno(), selectors.EVENT_READ, into)
    ways.register(there.stdout.fileno(), selectors.EVENT_READ, sys.stdout.fileno())
    while there.stdout.fileno() in ways.get_map():
        for key, _ in ways.select():
            part = os.read(key.fd, 65536)
            if part:
                try:
                    os.write(key.data, part)
                except BrokenPipeError:
                    part = b""
            if not part:
                ways.unregister(key.fd)
                if key.data == into:
                    there.stdin.close()
    return there.wait()


if __name__ == "__main__":
    sys.exit(main(sys.argv[1], sys.argv[3]))
