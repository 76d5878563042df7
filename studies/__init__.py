"""Experiments of the thesis and ours: `python -m studies NAME`."""

import os

from paramove.linear_algebra_threads import ONE_THREAD

for _name, _number in ONE_THREAD.items():  # numpy looks when it is imported, which is after this
    os.environ.setdefault(_name, _number)
