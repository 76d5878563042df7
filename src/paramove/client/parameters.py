"""Parameters of the nodes of a run, read and changed from outside."""

from __future__ import annotations

import json
import time
from collections.abc import Iterator
from typing import Any

from paramove.bus import topics
from paramove.client.run import NoMessageError, Run
from paramove.documents import InputError, nearest
from paramove.msgs.node_status_pb2 import NodeParameter, NodeStatus
from paramove.msgs.parameters_pb2 import ParameterRequest

MARGINS_S = (0.2, 1.0, 5.0)
"""So much later in simulated time a change is to land: the request has to arrive before. If it is late, the next."""


class RejectedParameterError(InputError):
    """A node does not take a value; the text is its reason."""


def parameters_of(run: Run, node: str, timeout_s: float = 5.0) -> dict[str, NodeParameter]:
    """Parameters of a node that may change while it runs, by their names.

    Raises NoMessageError if the node does not report in time, InputError for what is no name of a node.
    """
    status: NodeStatus = run.latest(f"status/{node}", timeout_s)
    return {parameter.name: parameter for parameter in status.parameters}


def parameter_of(run: Run, node: str, name: str, timeout_s: float = 5.0) -> NodeParameter:
    """One of them; raises as `parameters_of`, and InputError that names the others if the node has no such one."""
    known = parameters_of(run, node, timeout_s)
    if name not in known:
        what = nearest(name, known) if known else "it declares none: CHANGEABLE in its Config"
        raise InputError(f"'{name}' is no parameter that changes while {node} runs; {what}")
    return known[name]


def set_parameter(
    run: Run, node: str, name: str, value: Any, at_s: float | None = None, timeout_s: float = 5.0
) -> NodeParameter:
    """Changes a parameter of a node, and waits until it is accepted; in simulated time until it is changed.

    In a run on several hosts that is done on the launcher's host, for nodes of all hosts.

    Args:
        run: The application.
        node, name: Of the parameter.
        value: The new one; a text is YAML.
        at_s: Time of the run from which on it counts; None: at once, which in simulated time is 0.2 s later, so that
            the recorded request has the exact time.
        timeout_s: For the node's answer.

    Returns:
        What the node reports of it.

    Raises:
        RejectedParameterError: The node does not take it.
        NoMessageError: The node does not answer in time.
        TopicTakenError: Another program is changing parameters just now, or this is not the launcher's host.
        InputError: The node has no such parameter that changes while it runs.
    """
    parameter_of(run, node, name, timeout_s)
    text = value if isinstance(value, str) else json.dumps(value)
    request = ParameterRequest(node=node, name=name, value=text, source=run.name)
    if at_s is not None:
        request.at.FromNanoseconds(round(1e9 * at_s))
    if at_s is not None or not run.is_simulated:
        return _accepted(_answer(run, request, timeout_s))
    for margin_s in MARGINS_S:
        request.at.FromNanoseconds(run.now_ns + round(1e9 * margin_s))
        answer = _answer(run, request, timeout_s)
        if not answer.late:
            break
    _accepted(answer)
    return _landed(run, request, timeout_s)


def _accepted(answer: NodeParameter) -> NodeParameter:
    """An answer that is no rejection; raises RejectedParameterError."""
    if answer.rejection:
        raise RejectedParameterError(f"{answer.name}: {answer.rejection}")
    return answer


def _answer(run: Run, request: ParameterRequest, timeout_s: float) -> NodeParameter:
    """Publishes a request; what the node reports as soon as it has it."""
    request.id = f"{run.name} {time.monotonic_ns()}"
    request.captured.FromNanoseconds(max(0, run.now_ns))
    if not run.publish(topics.PARAMETERS_SET, request, wait_s=timeout_s):
        raise NoMessageError(
            f"nobody subscribes to {topics.PARAMETERS_SET.name} here: {request.node} has ended, or its host is not "
            "connected"
        )
    return next(_reports(run, request, timeout_s))


def _landed(run: Run, request: ParameterRequest, timeout_s: float) -> NodeParameter:
    """What the node reports once the change has been made."""
    for parameter in _reports(run, request, timeout_s):
        if parameter.changed.ToNanoseconds() >= request.at.ToNanoseconds():
            return _accepted(parameter)
    raise NoMessageError(f"{request.node} has not changed {request.name} within {timeout_s:g} s")


def _reports(run: Run, request: ParameterRequest, timeout_s: float) -> Iterator[NodeParameter]:
    """What the node reports of a request, the latest first; raises NoMessageError if there is nothing in time."""
    status = topics.status(request.node)
    yield from (one for one in parameters_of(run, request.node).values() if _is_about(one, request))
    for received in run.listen(status, seconds=timeout_s):
        yield from (one for one in received.message.parameters if _is_about(one, request))
    raise NoMessageError(f"{request.node} has not answered within {timeout_s:g} s")


def _is_about(parameter: NodeParameter, request: ParameterRequest) -> bool:
    return (parameter.name, parameter.request_id) == (request.name, request.id)
