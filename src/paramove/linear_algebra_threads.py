"""How many threads libraries of linear algebra are to use, told by their environment variables."""

import os

ONE_THREAD = dict.fromkeys(("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"), "1")
"""For all of them. With matrices as small as ours a thread for each core mostly waits for the others, and keeps its
core busy with it; ten processes with a thread per core would only hinder one another."""


def use_one_thread() -> None:
    """Sets them for this process where they are not set; of use before numpy is imported, which looks then."""
    for name, number in ONE_THREAD.items():
        os.environ.setdefault(name, number)
