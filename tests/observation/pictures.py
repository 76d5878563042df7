"""Pictures of real persons, and the pose network; tests that need what is not on this machine are skipped."""

import pytest

from paramove.demonstrations import RecordingsError, data_folder
from paramove.documents import InputError, read_picture
from paramove.observation import stored_network


def network():
    """The pose network of this machine."""
    try:
        return stored_network()
    except InputError as error:
        pytest.skip(str(error))


def seated_person(frame):
    """The picture of a seated person who points to the right, BGR, (480, 640, 3)."""
    try:
        folder = data_folder(None) / "rgbd_pointing" / "color"
    except RecordingsError as error:
        pytest.skip(str(error))
    path = folder / f"{frame:05d}.jpg"
    if not path.is_file():
        pytest.skip(f"no recording {path}")
    return read_picture(path)
