"""The numbers of `run.json`."""

import json

import numpy as np
import pytest

from paramove.runs.rule_learning.summary import as_json, rounded
from tests.runs.synthetic_run import END_S, PERIOD_NS


def test_counts_what_happened(evaluated):
    summary = evaluated().summary
    assert (summary["success"], summary["objects_placed"], summary["seed"], summary["done"]) == (True, 2, 42, True)
    assert (summary["grasps"], summary["grasps_first_try"], summary["retries"]) == (1, 1, 0)
    assert (summary["calibration_grasps"], summary["calibration_grasps_first_try"]) == (0, 0)
    assert summary["unwanted_contacts"] == 1
    (contact,) = summary["contact_list"]
    assert contact["in_contact"] == ["palm - box"]
    np.testing.assert_allclose(contact["time_s"], 51e-9 * PERIOD_NS, rtol=0, atol=1e-9)
    np.testing.assert_allclose(summary["deepest_penetration_mm"], 0.2, rtol=0, atol=1e-12)
    np.testing.assert_allclose(summary["simulated_s"], END_S, rtol=0, atol=1e-9)


def test_grasp_tells_how_it_went(evaluated):
    (grasp,) = evaluated().summary["grasp_list"]
    assert (grasp["object"], grasp["stage"], grasp["attempt"], grasp["result"]) == ("yellow", "apply", 1, "succeeded")
    assert grasp["held"]
    np.testing.assert_allclose([grasp["begun_s"], grasp["ended_s"]], [2.0, 7.0], rtol=0, atol=1e-9)
    np.testing.assert_allclose(grasp["elbow_turn_deg"], np.rad2deg(0.1), rtol=1e-6)
    np.testing.assert_allclose(grasp["to_error_mm"], 1e3 * np.hypot(0.015, 0.093), rtol=1e-6)


def test_grasp_tells_whether_the_model_extrapolated(evaluated):
    summary = evaluated().summary
    (grasp,) = summary["grasp_list"]
    assert (grasp["from_hull"], grasp["to_hull"]) == ("inside", "outside")
    none, one = {"tried": 0, "succeeded": 0, "refused": 0}, {"tried": 1, "succeeded": 1, "refused": 0}
    assert summary["training_hull"] == {
        "from": {"inside": one, "outside": none},
        "to": {"inside": none, "outside": one},
    }


def test_stages_follow_one_another(evaluated):
    stages = evaluated().summary["stages"]
    assert [stage["stage"] for stage in stages] == ["calibrate", "learn", "apply"]
    np.testing.assert_allclose([s["begin_s"] for s in stages], [0.0, 1.0, 1.9], rtol=0, atol=1e-9)
    np.testing.assert_allclose([s["end_s"] for s in stages], [1.0, 1.9, END_S], rtol=0, atol=1e-9)


def test_rules_stand_beside_the_truth(evaluated):
    rules = {rule["object"]: rule for rule in evaluated().summary["rules"]}
    assert rules["yellow"]["right"]
    assert rules["yellow"]["sentence"] == "yellow belongs there"
    np.testing.assert_allclose(rules["yellow"]["error_mm"], 2.0, rtol=1e-6)
    assert rules["green"] | {"true": None} == {
        "object": "green",
        "opening": "opening_1",
        "true": None,
        "believed": None,
        "error_mm": None,
        "nearest_opening": None,
        "right": False,
        "sentence": "",
    }


def test_same_run_recorded_longer_gives_the_same_bytes(evaluated):
    """How much is recorded after the end depends on how fast processes stop."""
    texts = []
    for name, after_end in (("short", 0), ("long", 20)):
        summary = evaluated(after_end, name).summary
        assert summary.pop("wall")["realtime_factor"] == 2.5 + after_end
        texts.append(as_json(summary))
    assert texts[0] == texts[1]
    assert "Thank you!" in texts[0]


def test_loss_is_counted_from_the_sequence_numbers(evaluated):
    summary = evaluated(lost=(5, 6, 20)).summary
    assert summary["loss"]["total"] == 3
    assert summary["loss"]["topics"]["objects/tracked"] == 3
    rate = summary["topic_rates"]["wire/hoap3/state"]
    assert rate["declared_hz"] == 15
    np.testing.assert_allclose(rate["measured_hz"], 15.0, rtol=1e-6)


def test_failed_verdict_says_why(evaluated):
    evaluation = evaluated()
    found = {"opening": "opening_0", "rests_in": "opening_1", "at_rest": True, "last_touched_by": "robot"}
    evaluation.run.verdict.update({"success": False, "objects": {"yellow": found | {"success": False}}})
    assert evaluation.summary["reason"] == "yellow rests in opening_1, last touched by robot"


def test_json_is_rounded_and_sorted():
    text = as_json({"b": 1 / 3, "a": [-1e-9, True, None]})
    assert json.loads(text) == {"a": [0.0, True, None], "b": 0.333333}
    assert text.index('"a"') < text.index('"b"')
    assert str(rounded(-1e-9)) == "0.0"
    with pytest.raises(ValueError, match="JSON"):
        as_json(float("nan"))
