"""The simulation: one MuJoCo world with cameras, a robot and a person."""

from pkgutil import extend_path

__path__ = extend_path([], __name__)  # `sim/` of the working directory first, then that of the installed workspace
