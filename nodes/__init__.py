"""The nodes: one process per file, plumbing around one library object."""

from pkgutil import extend_path

__path__ = extend_path([], __name__)  # `nodes/` of the working directory first, then that of the installed workspace
