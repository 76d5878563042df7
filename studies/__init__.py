"""The experiments of the thesis and ours, and methods of others; `python -m studies` lists them."""

from paramove.linear_algebra_threads import use_one_thread
from paramove.terminal_size import drop_unusable_sizes

use_one_thread()
drop_unusable_sizes()
