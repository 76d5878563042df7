"""The check between every reader and a set: times, missing frames, lost points, whose points, which way is up."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from paramove.demonstrations.demonstration_set import DemonstrationSet
from paramove.demonstrations.importing import ImportOptions, import_file
from paramove.demonstrations.importing.checking import MAX_FRAMES, frozen, placeholders
from paramove.demonstrations.movement import DemonstrationError
from paramove.demonstrations.writing import Label, write_set

REACH = Label(0, 0, "reaching")
RATE_HZ = 60.0
TIME = np.arange(61) / RATE_HZ


def path(offset=(0.0, 0.0, 0.0)):
    """A finger that moves 0.4 m along x in 1 s, with minimum jerk, at 60 Hz."""
    phase = 10 * TIME**3 - 15 * TIME**4 + 6 * TIME**5
    return np.array([0.2, -0.1, 0.9]) + np.outer(phase, [0.4, 0.0, 0.0]) + np.asarray(offset)


def write(folder, columns, text=None, rows=None, name="take.csv"):
    """A CSV file of columns by their names; `rows`: which are written."""
    lines = [",".join(columns)]
    for row in range(61) if rows is None else rows:
        lines.append(",".join(f"{values[row]:.12g}" if np.isfinite(values[row]) else "" for values in columns.values()))
    file = folder / name
    file.write_text("\n".join(lines) + (text or "") + "\n")
    return file


def points(**paths):
    return {f"{name}_{axis}": values[:, n] for name, values in paths.items() for n, axis in enumerate("xyz")}


def loaded(folder, found, max_gap=0.1):
    write_set(folder / "set", found.takes, found.parameter_names, max_gap=max_gap)
    return DemonstrationSet.load(folder / "set")


def said(found, *words):
    return any(all(word in remark for word in words) for remark in found.remarks)


# Time -------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("name", "factor", "unit"),
    [
        ("time", 1.0, ""),
        ("timestamp", 1e3, "milliseconds"),
        ("t", 1e6, "microseconds"),
        ("Time", 1e9, "nanoseconds"),
        ("time_ms", 1e3, ""),
        ("Timestamp (us)", 1e6, ""),
        ("time_ns", 1e9, ""),
    ],
)
def test_the_unit_of_times_is_the_one_with_a_plausible_rate(tmp_path, name, factor, unit):
    file = write(tmp_path, {name: 1e6 + TIME * factor} | points(index=path()))
    found = import_file(file, ImportOptions(unit="m"), REACH)
    assert found.takes[0].time[-1] == pytest.approx(1.0, abs=1e-3)
    assert said(found, "times are taken as", unit) == bool(unit)


@pytest.mark.parametrize(("name", "factor"), [("time_ms", 1.0), ("time_s", 1e3), ("time", 60.0), ("time", 1e-4)])
def test_times_that_contradict_their_unit_are_rejected(tmp_path, name, factor):
    file = write(tmp_path, {name: TIME * factor} | points(index=path()))
    with pytest.raises(DemonstrationError, match=r"(expected 5 to 1000|count 0, 1, 2).*--rate"):
        import_file(file, ImportOptions(unit="m"), REACH)


@pytest.mark.parametrize("late", [1, 17, 30, 59])
@pytest.mark.parametrize("by_s", [1e-8, 1e-5, 1e-4])
def test_a_late_time_does_not_make_the_interpolation_overshoot(tmp_path, late, by_s):
    time = TIME.copy()
    time[late] = time[late + 1] - by_s
    found = import_file(write(tmp_path, {"time": time} | points(index=path())), ImportOptions(unit="m"), REACH)
    assert said(found, "doubtful", str(late + 1))
    assert not said(found, "moves")
    assert len(found.takes[0].time) == 61
    for rate_hz in (60.0, 100.0):
        (movement,) = loaded(tmp_path / str(rate_hz), found).resampled(rate_hz)
        assert movement.positions[:, 0, 0].min() > 0.19
        assert movement.positions[:, 0, 0].max() < 0.61


def test_frames_that_come_in_pairs_have_their_mean_rate(tmp_path):
    time = np.repeat(TIME[::2], 2)[:61]
    time[1::2] += 1e-5
    file = write(tmp_path, {"time": time} | points(index=path()), rows=range(60))
    found = import_file(file, ImportOptions(unit="m"), REACH)
    assert said(found, "doubtful")
    assert len(found.takes[0].time) == 60


HOLES = [(20, 40), (3, 12), (50, 59)]


@pytest.mark.parametrize(("first", "end"), HOLES)
@pytest.mark.parametrize("kind", ["empty", "absent", "zero", "by number"])
def test_a_loss_is_a_loss_however_the_file_has_it(tmp_path, first, end, kind):
    columns = {"frame": np.arange(61.0) + 7, "time": TIME} | points(index=path())
    rate_hz = None
    if kind in ("empty", "zero"):
        for name in ("index_x", "index_y", "index_z"):
            columns[name][first:end] = np.nan if kind == "empty" else 0.0
    if kind == "by number":
        del columns["time"]
        rate_hz = RATE_HZ
    rows = [n for n in range(61) if kind in ("empty", "zero") or not first <= n < end]
    file = write(tmp_path, columns, rows=rows)
    found = import_file(file, ImportOptions(unit="m", rate_hz=rate_hz), REACH)
    assert f"index in frames {first}-{end - 1}" in found.rejected[0]
    found = import_file(file, ImportOptions(unit="m", rate_hz=rate_hz), REACH, max_gap=0.4)
    (movement,) = loaded(tmp_path, found, max_gap=0.4)
    assert len(movement.time) == 61
    assert_allclose(movement.time, TIME, rtol=0.0, atol=1e-6)
    assert (np.diff(movement.positions[:, 0, 0]) > -1e-12).all()


def test_row_numbers_of_a_table_count_frames_only_if_they_can(tmp_path):
    rows = [n for n in range(61) if not 20 <= n < 23]
    file = write(tmp_path, {"": np.arange(61.0)} | points(index=path()), rows=rows)
    (take,) = import_file(file, ImportOptions(unit="m", rate_hz=RATE_HZ), REACH).takes
    assert len(take.time) == 61
    file = write(tmp_path, {"": np.arange(61.0) % 30} | points(index=path()))
    (take,) = import_file(file, ImportOptions(unit="m", rate_hz=RATE_HZ), REACH).takes
    assert len(take.time) == 61
    file = write(tmp_path, {"frame": np.arange(61.0) % 30} | points(index=path()))
    with pytest.raises(DemonstrationError, match="frame number 0 follows 29"):
        import_file(file, ImportOptions(unit="m", rate_hz=RATE_HZ), REACH)


@pytest.mark.parametrize(
    "name", ["Frame", "fnum", "frame_idx", "Frame No.", "frameNumber", "Frame #", "FrameID", "row"]
)
def test_frame_numbers_have_many_names(tmp_path, name):
    file = write(tmp_path, {name: np.arange(61.0)} | points(index=path()), rows=[*range(20), *range(40, 61)])
    assert len(import_file(file, ImportOptions(unit="m", rate_hz=RATE_HZ), REACH).takes[0].time) == 61


def test_a_rate_that_hides_a_hole_in_the_times_or_contradicts_them_is_said(tmp_path):
    columns = {"time": TIME} | points(index=path())
    holes = write(tmp_path, columns, rows=[*range(20), *range(40, 61)])
    assert said(import_file(holes, ImportOptions(unit="m", rate_hz=RATE_HZ), REACH), "20 frames are missing", "row 20")
    whole = write(tmp_path, columns, name="whole.csv")
    found = import_file(whole, ImportOptions(unit="m", rate_hz=120.0), REACH)
    assert said(found, "its times mean 60 frames a second; the given 120 are used")
    assert not said(import_file(whole, ImportOptions(unit="m", rate_hz=RATE_HZ), REACH), "its times mean")


def test_frame_numbers_may_count_in_larger_steps(tmp_path):
    file = write(tmp_path, {"frame": 2 * np.arange(61.0)} | points(index=path()))
    found = import_file(file, ImportOptions(unit="m", rate_hz=RATE_HZ), REACH)
    assert found.takes[0].time[-1] == pytest.approx(1.0)
    assert said(found, "steps of 2")


def test_more_missing_than_present_is_no_recording(tmp_path):
    file = write(
        tmp_path, {"frame": np.concatenate([np.arange(31.0), 31.0 + 4 * np.arange(30.0)])} | points(index=path())
    )
    with pytest.raises(DemonstrationError, match="more frames are missing"):
        import_file(file, ImportOptions(unit="m", rate_hz=RATE_HZ), REACH)


def test_a_take_that_is_too_long_is_rejected_before_it_is_read(tmp_path):
    file = tmp_path / "take.csv"
    file.write_text("time,index_x,index_y,index_z\n" + "0\n" * (MAX_FRAMES + 2))
    with pytest.raises(DemonstrationError, match=f"at most {MAX_FRAMES}"):
        import_file(file, ImportOptions(unit="m"))


# Loss -------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("first", "end"), [(26, 45), (10, 14), (30, 33), (1, 20), (41, 61)])
@pytest.mark.parametrize("digits", [3, 6, 17])
def test_a_point_that_repeats_its_position_while_others_move_is_lost(first, end, digits):
    index, wrist = path(), path((-0.2, 0.0, 0.0))
    index[first:end] = index[first - 1]
    marked = frozen(np.round(np.stack([index, wrist, wrist + np.array([0.0, 0.05, 0.0])], axis=1), digits))
    assert np.flatnonzero(marked[:, 0]).tolist() == list(range(first, end))
    assert not marked[:, 1:].any()


@pytest.mark.parametrize("digits", [2, 3, 4, 6, 17])
def test_a_point_that_rests_is_not_lost(digits):
    """Before, between and after movements, exactly, and rounded to cm and mm, while another one moves all the time."""
    rest = np.repeat(path()[:1], 50, axis=0)
    there = np.repeat(path()[-1:], 50, axis=0)
    finger = np.concatenate([rest, path(), there, path()[::-1], rest])
    steady = np.repeat(path()[:1], len(finger), axis=0)
    other = np.cumsum(np.random.default_rng(0).normal(0.0, 0.01, finger.shape), axis=0)
    assert not frozen(np.round(np.stack([finger, steady, other], axis=1), digits)).any()


def test_one_point_alone_and_points_that_stop_together_are_not_frozen():
    index = path()
    index[20:30] = index[19]
    assert not frozen(index[:, None]).any()
    assert not frozen(np.stack([index, index + 0.1], axis=1)).any()


@pytest.mark.parametrize("position", [(-1.0, -1.0, -1.0), (9999999.0,) * 3, (0.0, 0.0, 30.0)])
@pytest.mark.parametrize("frames", [[30, 31, 32], [0, 1], [59, 60], [10, 40, 41], list(range(0, 61, 3))], ids=str)
def test_a_position_that_stands_for_none_is_a_loss(tmp_path, position, frames):
    index = path()
    index[frames] = position
    file = write(tmp_path, {"time": TIME, **points(index=index)})
    take = import_file(file, ImportOptions("m", "z_up"), REACH, max_gap=1.0).takes[0]
    assert np.isnan(take.positions[frames]).all()
    assert np.isfinite(np.delete(take.positions, frames, axis=0)).all()


def test_rest_a_second_take_and_one_outlier_are_places():
    resting = np.round(
        np.concatenate([np.repeat(path()[:1], 20, axis=0), path(), np.repeat(path()[-1:], 20, axis=0)]), 4
    )
    joined = np.concatenate([resting, resting + np.array([2.0, 0.0, 0.0])])
    outlier = path()
    outlier[30] += 5.0
    still = np.repeat(path()[:1], 50, axis=0)
    for places in (resting, joined, outlier, still, np.concatenate([still, still + 1.0])):
        assert not placeholders(places).any()


@pytest.mark.parametrize("value", [0.0, -1.0, 9999.0])
def test_one_axis_that_stands_for_none_is_a_loss(tmp_path, value):
    lost = path()
    lost[20:40, 2] = value
    found = import_file(write(tmp_path, {"time": TIME} | points(index=lost)), ImportOptions(unit="m"), REACH)
    assert said(found, "z of index is at one position far from all others in frames 20-39")
    assert np.isnan(found.takes[0].positions[20:40]).all()
    assert np.isfinite(found.takes[0].positions[:20]).all()


def test_a_step_that_no_hand_makes_is_named(tmp_path):
    leap = path()
    leap[30] = -1.0
    found = import_file(write(tmp_path, {"time": TIME} | points(index=leap)), ImportOptions(unit="m"), REACH)
    assert said(found, "index moves", "from frame 30 to frame 31", "2 such steps")
    assert not said(import_file(write(tmp_path, {"time": TIME} | points(index=path())), ImportOptions(unit="m"), REACH),
                    "moves")  # fmt: skip


def test_coordinates_from_the_first_position_on_are_places(tmp_path):
    start = path() - path()[0]
    found = import_file(write(tmp_path, {"time": TIME} | points(index=start)), ImportOptions(unit="m"), REACH)
    assert_allclose(found.takes[0].positions[:, 0], start, atol=1e-12)
    through = path() - path()[30]
    found = import_file(write(tmp_path, {"time": TIME} | points(index=through)), ImportOptions(unit="m"), REACH)
    assert np.isfinite(found.takes[0].positions).all()


@pytest.mark.parametrize("names", [("index",), ("index", "wrist")])
def test_a_capture_that_stands_still_is_named(tmp_path, names):
    still = path()
    still[21:40] = still[20]
    file = write(tmp_path, {"time": TIME} | points(**dict.fromkeys(names, still)))
    assert said(import_file(file, ImportOptions(unit="m"), REACH), "all points repeat", "frames 21-39")


def test_people_who_rest_before_they_move_are_no_capture_that_stands_still(tmp_path):
    rest = np.concatenate([np.repeat(path()[:1], 10, axis=0), np.round(path(), 3)[:-10]])
    file = write(tmp_path, {"time": TIME} | points(index=rest))
    assert not said(import_file(file, ImportOptions(unit="m"), REACH), "all points repeat")


def test_frozen_points_are_named_and_may_be_places(tmp_path):
    index = path()
    index[26:45] = index[25]
    file = write(tmp_path, {"time": TIME} | points(index=index, wrist=path((-0.2, 0.0, 0.0))))
    found = import_file(file, ImportOptions(unit="m", points={"index": ("index",)}), REACH)
    assert "index in frames 26-44" in found.rejected[0]
    assert said(found, "index repeats its position", "26-44")
    found = import_file(file, ImportOptions(unit="m", repeats_are_lost=False), REACH)
    assert not found.rejected


def test_losses_of_several_kinds_are_one(tmp_path):
    """Frozen, then empty, then zero, then absent: 20 frames, one loss."""
    index = path()
    index[20:25] = index[19]
    index[25:30] = np.nan
    index[30:35] = 0.0
    rows = [n for n in range(61) if not 35 <= n < 40]
    file = write(tmp_path, {"time": TIME} | points(index=index, wrist=path((-0.2, 0.0, 0.0))), rows=rows)
    found = import_file(file, ImportOptions(unit="m"), REACH)
    assert "index in frames 20-39" in found.rejected[0]


# Names ------------------------------------------------------------------------------------------------------------


def people(folder, *names):
    columns = {"time": TIME}
    for number, name in enumerate(names):
        columns |= points(**{name: path((0.0, float(number), 0.0))})
    return write(folder, columns)


@pytest.mark.parametrize("people_there", [("Ann", "Ben"), ("Ben", "Ann"), ("Ben", "Ann", "Cho")])
def test_a_name_that_several_persons_have_is_the_subjects_or_rejected(tmp_path, people_there):
    file = people(tmp_path, *(f"{name}:index" for name in people_there))
    wanted = {"index": ("index",)}
    with pytest.raises(DemonstrationError) as error:
        import_file(file, ImportOptions(unit="m", points=wanted))
    assert all(f"{name}:index" in str(error.value) for name in people_there)
    (take,) = import_file(file, ImportOptions(unit="m", points=wanted, subject="Ann")).takes
    assert_allclose(take.positions[0, 0], path((0.0, float(people_there.index("Ann")), 0.0))[0], rtol=0.0, atol=1e-9)
    whole = {"index": ("Ben:index",)}
    (take,) = import_file(file, ImportOptions(unit="m", points=whole, subject="Ann")).takes
    assert_allclose(take.positions[0, 0, 1], -0.1 + people_there.index("Ben"), rtol=0.0, atol=1e-9)


@pytest.mark.parametrize("subject", ["", "Ann"])
def test_points_of_two_persons_are_not_mixed(tmp_path, subject):
    file = people(tmp_path, "Ann:index", "Ben:wrist")
    options = ImportOptions(unit="m", points={"index": ("index",), "wrist": ("wrist",)}, subject=subject)
    with pytest.raises(DemonstrationError, match=r"Ben:wrist"):
        import_file(file, options)


def test_the_subjects_points_come_before_those_without_a_person(tmp_path):
    columns = {"time": TIME} | points(**{"Ann:index": path(), "Ben:index": path((1, 0, 0)), "index": path((2, 0, 0))})
    file = write(tmp_path, columns)
    for chosen in ({"index": ("index",)}, None):
        (take,) = import_file(file, ImportOptions(unit="m", subject="Ann", points=chosen), REACH).takes
        assert take.positions.shape[1] == 1
        assert_allclose(take.positions[:, 0], path())


def test_only_requested_points_decide(tmp_path):
    columns = {"time": TIME, "index_likelihood": TIME, "quality": TIME, "nose_x": TIME, "nose_y": TIME}
    columns |= points(index=path(), elbow=path()) | {"elbow x": TIME}
    file = write(tmp_path, columns)
    file.write_text(file.read_text().replace("\n0,0,0,0,0,", "\n0,0.9,good,0,x,"))
    found = import_file(file, ImportOptions(unit="m", points={"index": ("index",)}))
    assert found.takes[0].point_names == ("index",)
    for point, why in (("nose", "nose_z is missing"), ("elbow", r"ambiguous: 'elbow_x' \(column 9\), 'elbow x'")):
        with pytest.raises(DemonstrationError, match=why):
            import_file(file, ImportOptions(unit="m", points={point: (point,)}))
    with pytest.raises(DemonstrationError, match="nose_z is missing"):
        import_file(file, ImportOptions(unit="m"))


# Frame ------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("axes", [None, "y_up"])
def test_what_is_assumed_of_the_axes_is_said_with_the_extent(tmp_path, axes):
    found = import_file(write(tmp_path, {"time": TIME} | points(index=path())), ImportOptions(unit="m", axes=axes))
    assert said(found, "taken as up", "x 0.2 to 0.6", "z 0.9 to 0.9") == (axes is None)
