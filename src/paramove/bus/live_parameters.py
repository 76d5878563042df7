"""Parameters of a node that may change while it runs."""

from __future__ import annotations

import json
import logging
from bisect import insort
from operator import attrgetter
from typing import Any, NamedTuple

from pydantic import BaseModel, ValidationError
from pydantic_core import to_jsonable_python

from paramove.documents import DocumentError, findings, nearest, printable, read_value
from paramove.msgs.node_status_pb2 import NodeParameter
from paramove.msgs.parameters_pb2 import ParameterRequest

_log = logging.getLogger(__name__)

MOST_WAITING = 100
"""Changes that wait for their time."""


class _Change(NamedTuple):
    """What becomes of a parameter at a time of the run, ns."""

    at_ns: int
    request_id: str
    name: str
    value: Any


class LiveParameters:
    """The parameters of a node, of which it declares some to be changeable.

    A change replaces the value in the node's own configuration, which it reads again and again; it happens between
    two events of the node's loop, so that all of one event is done with the same values.

    Args:
        node: Name of the node.
        config: Its parameters.
        changeable: Names of those that may change.

    Raises ValueError for a name that is no parameter.
    """

    def __init__(self, node: str, config: BaseModel, changeable: tuple[str, ...]) -> None:
        missing = [name for name in changeable if name not in type(config).model_fields]
        if missing:
            raise ValueError(
                f"CHANGEABLE: '{missing[0]}' is no parameter; {nearest(missing[0], type(config).model_fields)}"
            )
        self._node, self._config = node, config
        self._parameters = {name: NodeParameter(name=name) for name in changeable}
        self._waiting: list[_Change] = []
        self._describe()

    @property
    def parameters(self) -> list[NodeParameter]:
        """Values, and what has become of requests, for the node's status; kept up to date."""
        return list(self._parameters.values())

    def receive(self, request: ParameterRequest, now_ns: int) -> bool:
        """Takes a request, or rejects it; returns whether it was for a parameter of this node.

        One that is to land at a time that is over is rejected, so that a recorded request that was not rejected has
        landed exactly at its time.
        """
        if request.node != self._node:
            return False
        parameter = self._parameters.get(request.name)
        if parameter is None:  # whoever looks at the status before a request knows the names
            name = printable(request.name)
            _log.warning("'%s' does not change while the node runs; %s", name, nearest(name, self._parameters))
            return False
        parameter.request_id, parameter.late = request.id, False
        at_ns = request.at.ToNanoseconds() if request.HasField("at") else now_ns
        try:
            value = self._checked(request)
        except ValueError as error:
            parameter.rejection = str(error)
            return True
        if at_ns < now_ns:
            parameter.rejection = f"it was to land at {1e-9 * at_ns:.3f} s; it is {1e-9 * now_ns:.3f} s already"
            parameter.late = True
            return True
        if len(self._waiting) >= MOST_WAITING:
            parameter.rejection = f"{MOST_WAITING} changes wait for their time already"
            return True
        parameter.rejection = ""
        insort(self._waiting, _Change(at_ns, request.id, request.name, value), key=attrgetter("at_ns"))
        return True

    def land(self, now_ns: int) -> bool:
        """Makes the changes whose time has come; returns whether there was one."""
        has_changed = False
        while self._waiting and self._waiting[0].at_ns <= now_ns:
            change = self._waiting.pop(0)
            parameter = self._parameters[change.name]
            try:
                changed = self._with(change.name, change.value)
            except ValidationError as error:  # it does not fit what has changed since
                parameter.request_id, parameter.rejection = change.request_id, findings(error)
                continue
            vars(self._config).update(vars(changed))
            parameter.changed.FromNanoseconds(now_ns)
            has_changed = True
        if has_changed:
            self._describe()
        return has_changed

    def _checked(self, request: ParameterRequest) -> Any:
        """The value of a request; raises ValueError with what is wrong with it."""
        try:
            value = read_value(request.value, request.name)
            self._with(request.name, value)
        except DocumentError as error:
            raise ValueError(str(error)) from error
        except ValidationError as error:
            raise ValueError(findings(error)) from error
        return value

    def _with(self, name: str, value: Any) -> BaseModel:
        """The configuration with another value; raises ValidationError."""
        values = {key: getattr(self._config, key) for key in type(self._config).model_fields}
        return type(self._config).model_validate({**values, name: value})

    def _describe(self) -> None:
        for name, parameter in self._parameters.items():
            value = to_jsonable_python(getattr(self._config, name), fallback=str)
            parameter.value = json.dumps(value, ensure_ascii=False)
