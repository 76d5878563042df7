"""The experiments of the thesis and ours, and methods of others; `python -m studies` lists them."""

from paramove.linear_algebra_threads import use_one_thread

use_one_thread()
