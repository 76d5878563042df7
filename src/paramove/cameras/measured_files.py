"""What people measure before a run: in the folder of the run, where a simulator writes it, or in the workspace."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from paramove.cameras.calibrated import CalibratedCamera, read_cameras
from paramove.documents.input_error import InputError

MOST_CAMERAS = 4


def measured_file(run_folder: Path, path: Path) -> Path:
    """The file of the run's folder if there is one, else as given."""
    return run_folder / path if (run_folder / path).is_file() else path


def measured_cameras(run_folder: Path, path: Path) -> list[CalibratedCamera]:
    """The cameras of a calibration file, named camera_1, camera_2, ... in their order, as their topics are.

    Raises InputError for a file that is none, or more than `MOST_CAMERAS`.
    """
    found = read_cameras(measured_file(run_folder, path))
    if len(found) > MOST_CAMERAS:
        raise InputError(f"{path}: {len(found)} cameras found, at most {MOST_CAMERAS} are used")
    return [replace(one, name=f"camera_{number}") for number, one in enumerate(found, start=1)]
