"""The calibration's file: read as written, edited on purpose, damaged, or of another arm."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from paramove.documents.input_error import InputError
from paramove.robots.dynamixel.calibration.arm_calibration import (
    ArmCalibration,
    CalibratedBus,
    CalibrationError,
    JointCalibration,
    sign_again,
)
from paramove.robots.dynamixel.calibration.path import DATA_VARIABLE, calibration_path

SERIAL = "FT6Z5NCH"
ELBOW = JointCalibration(
    id=2, model="xl330_m288", firmware=45, sign=-1, operating_mode=4, homing_offset=0, zero_counts=4300,
    min_counts=3500, max_counts=5400,
)  # fmt: skip
PAN = JointCalibration(
    id=1, model="xl430_w250", firmware=45, sign=1, operating_mode=3, homing_offset=0, zero_counts=2048,
    min_counts=1000, max_counts=3000,
)  # fmt: skip
ARM = ArmCalibration(
    created="2026-11-23T02:00:00+00:00",
    tool="paramove 0.1.0",
    robot="small_arm",
    bus=CalibratedBus(serial=SERIAL, baud_rate=1_000_000),
    joints={"pan": PAN, "elbow": ELBOW},
)


@pytest.fixture
def path(tmp_path):
    path = calibration_path(SERIAL, tmp_path)
    ARM.save(path)
    return path


def edited(path, old, new):
    text = path.read_text()
    assert old in text
    path.write_text(text.replace(old, new, 1))
    return path


def test_it_is_read_as_it_was_written(path):
    found = ArmCalibration.load(path, SERIAL)
    assert found.joints == ARM.joints
    assert (found.robot, found.bus, found.created) == (ARM.robot, ARM.bus, ARM.created)
    assert not list(path.parent.glob("*.part"))


def test_places(tmp_path, monkeypatch):
    assert calibration_path("A/../b c", tmp_path) == tmp_path / "calibration" / "arm_A_.._b_c.yaml"
    monkeypatch.setenv(DATA_VARIABLE, str(tmp_path / "mine"))
    assert calibration_path("A1") == tmp_path / "mine" / "calibration" / "arm_A1.yaml"
    monkeypatch.delenv(DATA_VARIABLE)
    monkeypatch.setenv("XDG_DATA_HOME", str(tmp_path))
    assert calibration_path("A1") == tmp_path / "paramove" / "calibration" / "arm_A1.yaml"


def test_an_edit_is_told_until_it_is_signed(path):
    edited(path, "sign: -1", "sign: 1  # the servo was turned round")
    with pytest.raises(CalibrationError, match=r"sha256 differs.*verify --sign.*damaged.*calibrate"):
        ArmCalibration.load(path, SERIAL)
    signed = sign_again(path)
    assert ArmCalibration.load(path, SERIAL) == signed
    assert signed.joints["elbow"].sign == 1
    assert "# the servo was turned round" in path.read_text()


def test_comments_and_layout_may_be_edited_freely(path):
    path.write_text("# my arm\n" + path.read_text().replace("  pan:", "  pan:   # at the base"))
    assert ArmCalibration.load(path, SERIAL).joints == ARM.joints


def test_another_arms_file_is_refused(path):
    with pytest.raises(
        CalibrationError, match=r"behind adapter FT6Z5NCH, this one is B7: run `paramove arm calibrate`"
    ):
        ArmCalibration.load(path, "B7")


def test_a_missing_file_is_told_with_the_remedy(tmp_path):
    with pytest.raises(CalibrationError, match=r"no calibration of an arm .*run `paramove arm calibrate`") as told:
        ArmCalibration.load(tmp_path / "none.yaml", SERIAL)
    assert told.value.missing


@pytest.mark.parametrize(
    ("old", "new", "told"),
    [
        (
            "min_counts: 1000",
            "min_counts: 3000",
            "joint pan: expected min_counts below max_counts, found 3000 and 3000",
        ),
        ("min_counts: 1000", "min_counts: .nan", r"'.nan' is rejected"),
        ("min_counts: 1000", "min_counts: 1000.0", r"joints.pan.min_counts: input should be a valid integer"),
        ("zero_counts: 2048", "zero_counts: .inf", r"'.inf' is rejected"),
        ("sign: 1", "sign: 0", r"joints.pan.sign: input should be 1 or -1, found 0"),
        ("max_counts: 3000", "max_counts: 4500", "joint pan: max_counts 4500 is beyond the one turn"),
        ("max_counts: 5400", "max_counts: 7500", "joint elbow: expected at most 3968 counts"),
        ("id: 2", "id: 1", "ID 1 is given twice"),
        ("homing_offset: 0", "homing_offset: 3", "joints.pan.homing_offset: input should be 0, found 3"),
        ("model: xl330_m288", "model: xl330", "servo model 'xl330' is not known"),
        ("version: 1", "version: 2", "version: input should be 1, found 2"),
        ("  pan:", "  pan: [", "yaml:14:10: .*in YAML"),
        ("robot: small_arm", "", "robot is missing"),
        ("firmware: 45", "firmware: 45\n    firmware: 46", "duplicate key"),
        ("baud_rate: 1000000", "baud_rate: 1000000\n  parity: 1", "bus.parity: extra inputs are not permitted"),
    ],
)
def test_a_file_that_contradicts_itself_is_refused(path, old, new, told):
    """Also by signing: what contradicts itself cannot be meant."""
    edited(path, old, new)
    for use in (lambda: ArmCalibration.load(path, SERIAL), lambda: sign_again(path)):
        with pytest.raises(ValueError, match=told):
            use()


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("- pan\n- elbow\n", "expected a mapping at the top level, found a list"),
        ("word\n", "found a single value"),
        ("# nothing but this\n", "the file is empty"),
        ("joints: [pan]\nbus:\n", "bus: expected lines of `name: value`, found nothing; joints: expected lines of"),
        ("version: 1\n", "created is missing; tool is missing"),
        ("created: 2026-13-45\n", "would be a timestamp"),
        ("[" * 3000, "levels of nesting"),
    ],
)
def test_a_file_of_something_else_is_told_in_plain_words(path, text, told):
    path.write_text(text)
    with pytest.raises(CalibrationError, match=told) as rejected:
        ArmCalibration.load(path, SERIAL)
    assert str(rejected.value).startswith(str(path))
    assert "run `paramove arm calibrate`" in str(rejected.value)


def test_a_cut_file_is_never_taken_for_a_whole_one(path):
    text = path.read_bytes()
    for length in range(0, len(text) - 1, 7):
        path.write_bytes(text[:length])
        with pytest.raises(CalibrationError):
            ArmCalibration.load(path, SERIAL)


def test_any_damaged_byte_of_the_content_is_told(path):
    """Each (here every third) is another number or name, or no file of ours any more; comments may be anything."""
    text = path.read_bytes()
    begin = text.index(b"version:")
    for place in range(begin, len(text), 3):
        if text[place : place + 1] in b" \n'\"":
            continue
        path.write_bytes(text[:place] + bytes([text[place] ^ 1]) + text[place + 1 :])
        with pytest.raises(InputError):
            ArmCalibration.load(path, SERIAL)


def test_units_are_those_of_the_file_within_the_described_range():
    units = ARM.units(["elbow", "pan"], np.deg2rad([-80.0, -100.0]), np.deg2rad([90.0, 80.0]))
    assert units.names == ("elbow", "pan")
    np.testing.assert_allclose(np.rad2deg(units.lower), [-80.0, -1048 * 360 / 4096], rtol=0, atol=1e-9)
    np.testing.assert_allclose(np.rad2deg(units.upper), [800 * 360 / 4096, 80.0], rtol=0, atol=1e-9)
    counts = units.to_counts([0.5, 0.5])
    assert counts.tolist() == [round(4300 - 0.5 * 4096 / (2 * np.pi)), round(2048 + 0.5 * 4096 / (2 * np.pi))]
    assert PAN.angle(int(counts[1])) == pytest.approx(0.5, abs=1e-3)
    assert ELBOW.angle(int(counts[0]) - 4096) == pytest.approx(0.5, abs=1e-3)


def test_units_without_a_joint_or_a_range_are_refused():
    with pytest.raises(CalibrationError, match="joint wrist is not calibrated, found pan, elbow"):
        ARM.units(["wrist"], [-1.0], [1.0])
    with pytest.raises(CalibrationError, match="joint pan: its calibrated travel lies outside of its range"):
        ARM.units(["pan"], [2.0], [3.0])


@given(st.integers(-(2**31), 2**31 - 1))
def test_a_position_is_told_in_one_turn(position):
    counts, turns = ELBOW.counts(position), ELBOW.turns(position)
    assert position == counts + 4096 * turns
    assert abs(counts - (ELBOW.min_counts + ELBOW.max_counts) / 2) <= 2048
