"""`paramove demo`: short for `paramove launch rule_learning`, with the same options."""

import inspect
from typing import Any

import typer

from paramove.cli.launch import launch

app = typer.Typer(add_completion=False)


def demo(**options: Any) -> None:
    """See `launch`."""
    launch("rule_learning", **options)


_PARAMETERS = inspect.signature(launch, eval_str=True).parameters.values()
demo.__signature__ = inspect.Signature([one for one in _PARAMETERS if one.name != "name"])  # type: ignore[attr-defined]
demo.__annotations__ = {one.name: one.annotation for one in _PARAMETERS if one.name != "name"}
demo.__doc__ = (
    (launch.__doc__ or "").replace("an application", "the demonstration").replace("66 no such launch file; ", "")
)
app.command()(demo)
