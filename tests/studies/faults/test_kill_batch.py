"""Cases are made run by run, kept, and made again where their moment never came."""

from collections.abc import Sequence
from pathlib import Path

import pytest

from studies.faults import kill_batch
from studies.faults.kill_batch import ATTEMPTS, KillOptions, finished, run_cases
from studies.faults.kill_cases import Expected, KillCase
from studies.faults.kill_run import KillResult

CAMERA, RECORDER = (KillCase(node, "KILL", "rest", Expected.GOES_ON) for node in ("camera", "recorder"))
DRIVER = KillCase("arm_driver", "KILL", "rest", Expected.ENDS_BACK)


class FakeRuns:
    """Stands for KillRun: the recorder's moment comes only in its run number `comes_in`."""

    def __init__(self, comes_in: int) -> None:
        self.comes_in = comes_in
        self.made: list[list[str]] = []
        self.domains: set[str] = set()

    def __call__(self, workspace: Path, folder: Path, domain: str, *_: object) -> "FakeRuns":
        assert len(domain) <= 40
        self.domains.add(domain)
        return self

    def perform(self, cases: Sequence[KillCase]) -> list[KillResult]:
        self.made.append([case.node for case in cases])
        late = sum("recorder" in made for made in self.made) < self.comes_in
        return [KillResult(case, not_sent="ended" if case is RECORDER and late else "") for case in cases]


@pytest.mark.parametrize(("comes_in", "passed"), [(1, True), (ATTEMPTS, True), (ATTEMPTS + 1, False)])
def test_a_case_whose_moment_never_came_is_made_again(
    comes_in: int, passed: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    runs = FakeRuns(comes_in)
    monkeypatch.setattr(kill_batch, "KillRun", runs)
    ended: list[KillResult] = []
    cases = [CAMERA, RECORDER, DRIVER]
    run_cases(cases, KillOptions(tmp_path, tmp_path / "kept"), lambda _: None, ended.append)
    assert runs.made[:2] == [["camera", "recorder"], ["arm_driver"]]
    assert runs.made[2:] == [["recorder"]] * (min(comes_in, ATTEMPTS) - 1)
    assert len(runs.domains) == len(runs.made)
    results = {result.case.node: result.passed for result in ended}
    assert results == {"camera": True, "arm_driver": True, "recorder": passed}
    kept = finished(tmp_path / "kept", cases)
    assert {name: result["passed"] for name, result in kept.items()} == {
        case.name: results[case.node] for case in cases
    }
