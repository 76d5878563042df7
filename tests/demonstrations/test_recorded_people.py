from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose

from paramove.demonstrations.recorded_people import (
    REFERENCE_ARM_M,
    Recordings,
    RecordingsError,
    data_folder,
    load_recordings,
    onset_of,
)
from tests.demonstrations.synthetic_recordings import RIGHT_SHOULDER, table_places, write_pointing, write_table


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("recordings")
    write_table(path)
    write_pointing(path)
    return path


@pytest.fixture(scope="module")
def table(folder: Path) -> Recordings:
    return load_recordings("table_reach", folder)


@pytest.fixture(scope="module")
def pointing(folder: Path) -> Recordings:
    return load_recordings("pointing27", folder)


def test_everybody_reaches_forward_in_the_body_frame(table: Recordings) -> None:
    """Also the one who sits the other way round, and the left hands."""
    assert table.subjects == (1, 2, 3)
    for one in table.of(action="forward"):
        wanted = REFERENCE_ARM_M / 0.6 * (table_places("forward") - RIGHT_SHOULDER)
        assert_allclose(one.target, wanted, rtol=0, atol=0.13)  # the places themselves scatter by 4 cm
        index = one.movement.reshape(-1, 7, 3)[-1, table.fingertip]
        assert_allclose(index, one.target, rtol=0, atol=1e-3)


def test_arms_are_equally_long(table: Recordings) -> None:
    for one in table.movements:
        points = one.points.reshape(-1, 7, 3)
        links = np.linalg.norm(points[:, 1] - points[:, 2], axis=1) + np.linalg.norm(
            points[:, 2] - points[:, 3], axis=1
        )
        assert_allclose(np.median(links), REFERENCE_ARM_M, rtol=0.03)


def test_the_shoulder_is_the_origin(table: Recordings, pointing: Recordings) -> None:
    for recordings, shoulder in ((table, 1), (pointing, 4)):
        for one in recordings.movements:
            assert_allclose(one.movement.reshape(-1, 7, 3)[0, shoulder], 0.0, rtol=0, atol=1e-6)


def test_direction_of_a_target(pointing: Recordings) -> None:
    """Target 4 is straight ahead of the middle of the body, target 0 left and low."""
    ahead = next(one for one in pointing.of(subject=1) if one.target_id == 4)
    assert_allclose(ahead.direction, [np.arctan2(0.2, 2.0), 0.0], rtol=0, atol=1e-6)
    low_left = next(one for one in pointing.of(subject=1) if one.target_id == 0)
    assert low_left.direction[0] > 0.4
    assert low_left.direction[1] < -0.3


def test_unusable_movements_are_left_out(pointing: Recordings) -> None:
    assert len(pointing.movements) == 2 * 9 * 2 - 1


def test_an_action_without_target_keeps_none(table: Recordings) -> None:
    assert not np.isfinite([one.target for one in table.of(action="comb")]).any()


def test_movements_begin_where_the_source_says(table: Recordings) -> None:
    for one in table.movements:
        assert one.segment[0] == 10  # 0.2 s of rest at 50 Hz
        assert 10 <= one.onset <= 20


def test_the_origin_of_beginnings_does_not_tell_where_the_segment_begins(table: Recordings) -> None:
    for one in table.movements:
        assert_allclose(one.from_onset.reshape(-1, 7, 3)[0, 1], 0.0, rtol=0, atol=1e-12)


def test_onset_by_absolute_speeds() -> None:
    """Still, then 5 cm/s for 0.2 s, then 30 cm/s: the slow part belongs to the movement."""
    steps = np.concatenate([np.zeros(30), np.full(10, 0.05), np.full(20, 0.3)]) / 50.0
    path = np.stack([np.cumsum(steps), np.zeros(60), np.zeros(60)], axis=1)
    assert onset_of(path, 60, 50.0) == pytest.approx(30, abs=2)


def test_onset_ignores_an_earlier_fidget() -> None:
    steps = np.concatenate([np.full(5, 0.08), np.zeros(30), np.full(20, 0.3)]) / 50.0
    path = np.stack([np.cumsum(steps), np.zeros(55), np.zeros(55)], axis=1)
    assert onset_of(path, 55, 50.0) == pytest.approx(35, abs=2)


def test_folder_from_the_environment(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PARAMOVE_DATA", str(folder))
    assert data_folder() == folder


def test_missing_folder(tmp_path: Path) -> None:
    with pytest.raises(RecordingsError, match="--data"):
        data_folder(tmp_path / "nowhere")


def test_missing_file_and_missing_array(tmp_path: Path) -> None:
    with pytest.raises(RecordingsError, match=r"data\.npz"):
        load_recordings("table_reach", tmp_path)
    (tmp_path / "table_reach").mkdir()
    np.savez(tmp_path / "table_reach" / "data.npz", flat=np.zeros((3, 21)))
    with pytest.raises(RecordingsError, match="missing"):
        load_recordings("table_reach", tmp_path)


def test_the_real_recordings() -> None:
    """Where they are at hand: every person's index finger ends within reach, before and below the head."""
    try:
        folder = data_folder()
    except RecordingsError as error:
        pytest.skip(str(error))
    table = load_recordings("table_reach", folder)
    for subject in table.subjects:
        reach = [
            one.movement.reshape(-1, 7, 3)[-1, table.fingertip]
            for one in table.of(subject=subject, action="reach_forward")
        ]
        assert_allclose(np.mean(reach, axis=0), [0.63, 0.02, -0.27], rtol=0, atol=0.1)
