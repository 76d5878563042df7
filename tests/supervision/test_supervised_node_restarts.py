"""The restart rule, on a clock of the test's own."""

import pytest

from paramove.supervision.launch_schema import NodeSettings, RestartBudget
from paramove.supervision.supervised_node import RestartPolicy


def policy(restart="on-failure", backoff_s=1.0, restarts=5, window_s=300.0):
    budget = RestartBudget(restarts=restarts, window_s=window_s)
    return RestartPolicy(NodeSettings(module="m", restart=restart, backoff_s=backoff_s, budget=budget))


def test_backoff_doubles_up_to_thirty_seconds():
    rule = policy(restarts=8)
    waits = [rule.after_exit(1, now_s=float(at)).restart_after_s for at in range(8)]
    assert waits == [1, 2, 4, 8, 16, 30, 30, 30]


def test_budget_gives_up_and_says_so():
    rule = policy(restarts=2, window_s=60)
    assert rule.after_exit(1, 0.0).restart_after_s == 1
    assert rule.after_exit(1, 10.0).restart_after_s == 2
    verdict = rule.after_exit(-11, 20.0)
    assert verdict.restart_after_s is None
    assert verdict.failed
    assert verdict.consequence == "given up after 2 restarts in 60 s"


def test_window_slides():
    rule = policy(restarts=2, window_s=60)
    waits = [rule.after_exit(1, at).restart_after_s for at in (0.0, 50.0, 70.0, 200.0)]
    assert waits == [1, 2, 2, 1]


@pytest.mark.parametrize("code", [2, 77, 78])
@pytest.mark.parametrize("restart", ["on-failure", "always"])
def test_hopeless_exit_codes_are_final(restart, code):
    verdict = policy(restart).after_exit(code, 0.0)
    assert verdict.restart_after_s is None
    assert verdict.failed
    assert "a restart would end the same way" in verdict.consequence


@pytest.mark.parametrize(
    ("restart", "code", "restarted", "failed"),
    [
        ("never", 0, False, False),
        ("never", 1, False, True),
        ("on-failure", 0, False, False),
        ("on-failure", -9, True, True),
        ("always", 0, True, False),
    ],
)
def test_what_each_policy_does(restart, code, restarted, failed):
    verdict = policy(restart).after_exit(code, 0.0)
    assert (verdict.restart_after_s is not None) == restarted
    assert verdict.failed == failed
