"""The options of the applications as their launch files give them to HOAP-3."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from paramove.applications.options import RelocatorOptions, RuleLearnerOptions
from paramove.documents import read_document

LAUNCH = Path(__file__).parents[2] / "launch"


def parameters(launch: str, node: str) -> dict[str, Any]:
    nodes: dict[str, Any] = read_document(LAUNCH / f"{launch}.yaml", "launch file").data["nodes"]
    return dict(nodes[node]["parameters"])


def rule_learner(**changes: Any) -> RuleLearnerOptions:
    return RuleLearnerOptions.model_validate(parameters("rule_learning", "rule_learner") | changes)


def relocator(**changes: Any) -> RelocatorOptions:
    return RelocatorOptions.model_validate(parameters("relocate_by_pointing", "relocator") | changes)
