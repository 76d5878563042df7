"""What was measured before a run is found in the run's folder first."""

from pathlib import Path

import numpy as np
import pytest

from paramove.cameras.calibrated import measured_cameras, measured_file, write_cameras
from paramove.documents.input_error import InputError
from tests.observation.views import four_cameras


def test_the_runs_own_file_comes_first(tmp_path, monkeypatch):
    run, workspace = tmp_path / "run", tmp_path / "workspace"
    run.mkdir()
    workspace.mkdir()
    monkeypatch.chdir(workspace)
    name = Path("cameras.yaml")
    assert measured_file(run, name) == name
    write_cameras(workspace / name, four_cameras()[:1])
    assert len(measured_cameras(run, name)) == 1
    write_cameras(run / name, four_cameras())
    assert measured_file(run, name) == run / name
    found = measured_cameras(run, name)
    assert [one.name for one in found] == ["camera_1", "camera_2", "camera_3", "camera_4"]
    np.testing.assert_allclose(found[2].matrix, four_cameras()[2].matrix, rtol=0.0, atol=1e-9)


def test_more_cameras_than_are_used_are_refused(tmp_path):
    file = tmp_path / "cameras.yaml"
    write_cameras(file, [*four_cameras(), four_cameras()[0]])
    with pytest.raises(InputError, match="5 cameras found, at most 4 are used"):
        measured_cameras(tmp_path, file)
