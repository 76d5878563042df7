"""paramove: parametric human movements, learned from few demonstrations."""

__version__: str


def __getattr__(name: str) -> str:
    if name != "__version__":
        raise AttributeError(f"module 'paramove' has no attribute {name!r}")
    from importlib.metadata import version  # takes longer than all that a help page needs

    return version("paramove")
