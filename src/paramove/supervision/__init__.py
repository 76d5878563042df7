"""Launch files, and the supervision of the processes that they name."""
