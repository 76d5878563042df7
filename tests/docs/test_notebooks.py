"""The notebooks of the documentation run from top to bottom, and what they draw is no empty picture."""

from __future__ import annotations

import json
import runpy
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
import pytest
from matplotlib import pyplot
from matplotlib.backends.backend_agg import FigureCanvasAgg

FOLDER = Path(__file__).parents[2] / "docs" / "notebooks"
NOTEBOOKS = sorted(FOLDER.glob("*.ipynb"))


def code_of(path: Path) -> list[str]:
    cells = json.loads(path.read_text())["cells"]
    return ["".join(cell["source"]) for cell in cells if cell["cell_type"] == "code"]


def drawn(path: Path, folder: Path) -> tuple[dict[str, Any], list[np.ndarray]]:
    """Names and pictures after all cells, run as one program."""
    matplotlib.use("agg")
    pyplot.close("all")
    program = folder / f"{path.stem}.py"
    program.write_text("\n\n".join(code_of(path)))
    names = runpy.run_path(str(program))
    pictures = []
    for number in pyplot.get_fignums():
        canvas = FigureCanvasAgg(pyplot.figure(number))
        canvas.draw()
        pictures.append(np.asarray(canvas.buffer_rgba())[..., :3])
    pyplot.close("all")
    return names, pictures


def test_both_notebooks_are_there_without_output() -> None:
    assert [path.stem for path in NOTEBOOKS] == ["is_my_model_honest", "your_first_parametric_model"]
    for path in NOTEBOOKS:
        assert all(not cell.get("outputs") for cell in json.loads(path.read_text())["cells"])


def test_the_first_model_recognises_and_rejects(tmp_path: Path) -> None:
    names, pictures = drawn(FOLDER / "your_first_parametric_model.ipynb", tmp_path)
    assert len(pictures) == 2
    assert all((picture < 250).any(axis=2).mean() > 0.02 for picture in pictures)
    assert names["genuine"] > 0.01 > names["other"]


@pytest.mark.long
def test_the_honest_model_is_honest(tmp_path: Path) -> None:
    names, pictures = drawn(FOLDER / "is_my_model_honest.ipynb", tmp_path)
    assert len(pictures) == 3
    assert all((picture < 250).any(axis=2).mean() > 0.02 for picture in pictures)
    assert 85.0 <= np.mean(names["held"][5]) <= 100.0
    assert np.mean(names["errors"][5]) < np.mean(names["errors"][1])


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_links_lead_somewhere(path: Path) -> None:
    text = "".join("".join(cell["source"]) for cell in json.loads(path.read_text())["cells"])
    for target in (part.split(")")[0] for part in text.split("](")[1:]):
        assert (FOLDER / target.split("#")[0]).exists(), target
