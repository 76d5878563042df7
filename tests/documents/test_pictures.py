"""Pixels of pictures are those of the sensor, as a lens is calibrated for them."""

import io
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from paramove.documents import InputError
from paramove.documents.pictures import read_picture

ORIENTATION = 0x112
UPSIDE_DOWN, LEFT_SIDE_DOWN = 3, 6


def marked() -> np.ndarray:
    """[40, 60, 3], white in the upper left corner."""
    pixels = np.zeros((40, 60, 3), np.uint8)
    pixels[:16, :16] = 255
    return pixels


def tagged(path: Path, orientation: int) -> Path:
    exif = Image.Exif()
    exif[ORIENTATION] = orientation
    data = io.BytesIO()
    Image.fromarray(marked()).save(data, path.suffix[1:], exif=exif)
    path.write_bytes(data.getvalue())
    return path


@pytest.mark.parametrize("orientation", [1, UPSIDE_DOWN, LEFT_SIDE_DOWN])
@pytest.mark.parametrize("suffix", [".jpeg", ".png", ".webp"])
def test_a_picture_is_not_turned_by_its_tag(tmp_path: Path, suffix: str, orientation: int) -> None:
    pixels = read_picture(tagged(tmp_path / f"phone{suffix}", orientation))
    assert pixels.shape == (40, 60, 3)
    assert np.abs(pixels.astype(int) - marked()).mean() < 5


@pytest.mark.parametrize("orientation", [UPSIDE_DOWN, LEFT_SIDE_DOWN])
def test_a_picture_that_would_be_turned_anyway_is_rejected(tmp_path: Path, orientation: int) -> None:
    assert read_picture(tagged(tmp_path / "upright.tiff", 1)).shape == (40, 60, 3)
    with pytest.raises(InputError, match=f"orientation {orientation}"):
        read_picture(tagged(tmp_path / "turned.tiff", orientation))
