"""Files that are no models: refused in one line that says what was expected and what was found."""

from __future__ import annotations

import io
import json
import re
import zipfile
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from paramove.phmm import InterpolativePHMM, ModelFileError, MovementDescription, ParameterGrid, ParametricHMM, storage

Content = dict[str, np.ndarray]


def small_model() -> InterpolativePHMM:
    """Four local models of 5 states in 3 dimensions, with nothing else that training gives."""
    grid = ParameterGrid.from_lines([0.0, 1.0], [0.0, 2.0])
    corners = grid.points()
    description = MovementDescription("wave", ("hand",))
    model = InterpolativePHMM(5, 2, 3, residuals="independent", description=description)
    model.parameter_bounds_ = np.stack([corners.min(axis=0), corners.max(axis=0)])
    model._set_grid(grid)
    model.means_ = np.stack([np.outer(np.arange(5.0), [1.0, 0.5, corner[0]]) + corner[1] for corner in corners])
    model.covariances_ = np.tile(0.01 * np.eye(3), (4, 5, 1, 1))
    model.durations_ = np.tile([0.0, 0.6, 0.4], (4, 5, 1))
    return model


@pytest.fixture
def file(tmp_path: Path) -> Path:
    path = tmp_path / "wave.npz"
    small_model().save(path)
    return path


def rejected(path: Path) -> str:
    """The sentence with which a file is refused."""
    with pytest.raises(ModelFileError) as rejection:
        ParametricHMM.load(path)
    detail = str(rejection.value)
    assert str(path) in detail
    assert "\n" not in detail
    return detail


def same(one: ParametricHMM, other: ParametricHMM) -> bool:
    arrays, others = one._arrays(), other._arrays()
    equal = arrays.keys() == others.keys() and all(np.array_equal(arrays[name], others[name]) for name in arrays)
    return equal and one.get_params() == other.get_params()


def test_a_missing_file_is_missing(tmp_path: Path) -> None:
    with pytest.raises(ModelFileError, match=r"there is no model file .*none\.npz") as rejection:
        ParametricHMM.load(tmp_path / "none.npz")
    assert rejection.value.missing
    assert rejection.value.exit_code == 66


def test_a_folder_is_refused(tmp_path: Path) -> None:
    assert "found a folder" in rejected(tmp_path)


def test_a_file_without_rights_is_refused_with_the_remedy(file: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def denied(*_: Any) -> None:
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr(zipfile, "ZipFile", denied)  # root may read everything
    assert "chmod u+r" in rejected(file)


@pytest.mark.parametrize("content", [b"", b"PK", b"not a model", b"\x80\x04]", b"\x93NUMPY\x01\x00", bytes(10_000)])
def test_something_else_is_refused(file: Path, content: bytes) -> None:
    file.write_bytes(content)
    assert f"expected a model file (.npz), found {len(content)} bytes" in rejected(file)


def test_a_cut_file_is_refused_wherever_it_is_cut(file: Path) -> None:
    whole = file.read_bytes()
    cuts = {len(whole) * k // 50 for k in range(50)} | set(range(128)) | set(range(len(whole) - 64, len(whole)))
    for cut in sorted(cuts):
        file.write_bytes(whole[:cut])
        assert "cut off or damaged" in rejected(file), cut


def test_a_flipped_bit_is_refused_or_changes_nothing(file: Path) -> None:
    """Some bits mean nothing, such as those of the date of an array in the zip file."""
    model, whole = ParametricHMM.load(file), file.read_bytes()
    places = [*range(128), *range(128, len(whole), 11), *range(len(whole) - 200, len(whole))]
    refusals = 0
    for place in places:
        damaged = bytearray(whole)
        damaged[place] ^= 1 << (place % 8)
        file.write_bytes(damaged)
        try:
            assert same(ParametricHMM.load(file), model), place
        except ModelFileError:
            refusals += 1
    assert refusals > 0.6 * len(places)


def _content(file: Path) -> Content:
    with np.load(file, allow_pickle=False) as stored:
        return {name: stored[name] for name in stored.files}


def _header(file: Path, **changes: Any) -> np.ndarray:
    return np.array(json.dumps({**json.loads(str(_content(file)["header"])), **changes}))


def _parameters(file: Path, **changes: Any) -> Content:
    known = json.loads(str(_content(file)["header"]))["parameters"]
    return {"header": _header(file, parameters={**known, **changes})}


def _description(file: Path, **changes: Any) -> Content:
    known = json.loads(str(_content(file)["header"]))["parameters"]["description"]
    return _parameters(file, description={**known, **changes})


def _with(name: str, change: Callable[[np.ndarray], object]) -> Callable[[Path], Content]:
    def changed(file: Path) -> Content:
        array = _content(file)[name].copy()
        change(array)
        return {name: array}

    return changed


def _set(index: Any, value: float) -> Callable[[np.ndarray], object]:
    return lambda array: array.__setitem__(index, value)


def _cut(name: str, shape: tuple[int, ...]) -> Callable[[Path], Content]:
    return lambda _: {name: np.zeros(shape)}


WRONG: Mapping[str, tuple[Callable[[Path], Content], str]] = {
    "older": (lambda _: {"format_version": np.array(1)}, "expected format version 3, found 1; train the model again"),
    "version in words": (lambda _: {"format_version": np.array("one")}, "expected a whole number as format version"),
    "versions": (lambda _: {"format_version": np.array([1, 1])}, "expected a whole number as format version"),
    "class": (lambda f: {"header": _header(f, **{"class": "Wave"})}, r"expected one of \[.*\], found a Wave"),
    "header": (lambda _: {"header": np.array("[]")}, "the header cannot be read"),
    "deep header": (lambda _: {"header": np.array("[" * 20_000)}, "the header cannot be read"),
    "argument": (lambda f: _parameters(f, colour="red"), "unexpected keyword argument 'colour'"),
    "count": (lambda f: _parameters(f, n_states="5"), "expected whole numbers with 1 <= d_min <= d_max"),
    "bool": (lambda f: _parameters(f, d_min=True), "expected whole numbers with 1 <= d_min <= d_max"),
    "states": (lambda f: _parameters(f, n_states=6), r"expected means of shape \(4, 6, 3\), found \(4, 5, 3\)"),
    "durations": (lambda f: _parameters(f, d_max=4), r"expected durations of shape \(4, 5, 4\), found \(4, 5, 3\)"),
    "unit": (lambda f: _description(f, unit=5), "unit of a description is like 'm', found 5"),
    "points": (lambda f: _description(f, point_names="hand"), "point_names of a description is like"),
    "no number": (lambda f: _description(f, duration=float("nan")), "expected finite numbers, found NaN"),
    "label": (lambda f: _description(f, colour="red"), r"found also \['colour'\]"),
    "dimension": (_cut("learned_means", (4, 5, 2)), r"expected covariances of shape \(4, 5, 2, 2\)"),
    "flat": (_cut("learned_means", ()), "wave.npz: "),
    "empty": (_cut("learned_means", (0, 5, 3)), r"expected means of shape \(4, 5, 3\)"),
    "grid": (_cut("learned_grid_edges", (2, 2)), "every edge of the grid has a length above 0"),
    "origin": (_cut("learned_grid_origin", (1,)), "wave.npz: "),
    "nan": (_with("learned_means", _set((1, 2, 0), np.nan)), "expected finite numbers in 'means'"),
    "inf": (_with("learned_covariances", _set((0, 0, 1, 1), -np.inf)), "expected finite numbers in 'covariances'"),
    "integers": (lambda _: {"learned_means": np.zeros((4, 5, 3), int)}, "infinity or int64"),
    "no distribution": (
        _with("learned_durations", _set((3, 4), 0.5)),
        r"expected durations that sum to 1 .*in state 4 of local model 3",
    ),
    "below 0": (_with("learned_durations", _set((0, 0), [0.0, 1.5, -0.5])), "with none below 0, found"),
    "too short": (_with("learned_durations", _set((0, 1), [1.0, 0.0, 0.0])), "expected no duration below 2 frames"),
    "lopsided": (_with("learned_covariances", _set((1, 2, 0, 1), 0.005)), "expected symmetric covariances"),
    "flat covariance": (_with("learned_covariances", _set((1, 2, 0, 0), 0.0)), "expected covariances that are pos"),
    "no spread": (_with("learned_covariances", _set((2, 2), 0.0)), "in state 2 of local model 2"),
}  # fmt: skip


@pytest.mark.parametrize("case", WRONG)
def test_content_that_does_not_fit_is_named(file: Path, case: str) -> None:
    change, words = WRONG[case]
    np.savez(file, allow_pickle=False, **{**_content(file), **change(file)})
    assert re.search(words, rejected(file))


@pytest.mark.parametrize(
    "name", ["format_version", "header", "learned_means", "learned_knots_1", "learned_parameter_bounds"]
)
def test_a_missing_array_is_named(file: Path, name: str) -> None:
    content = _content(file)
    del content[name]
    np.savez(file, allow_pickle=False, **content)
    assert name.removeprefix("learned_") in rejected(file)


def test_another_programs_arrays_are_no_model(file: Path) -> None:
    np.savez(file, images=np.zeros(3), labels=np.ones(3))
    assert "which has format_version and header; found images, labels" in rejected(file)


def _npy(header: str, data: bytes = b"", version: bytes = b"\x01\x00") -> bytes:
    text = header.ljust(117).encode() + b"\n"
    return b"\x93NUMPY" + version + len(text).to_bytes(2, "little") + text + data


def _replaced(file: Path, member: str, content: bytes, method: int = zipfile.ZIP_STORED) -> None:
    kept = io.BytesIO(file.read_bytes())
    with zipfile.ZipFile(kept) as old, zipfile.ZipFile(file, "w", method) as new:
        for name in old.namelist():
            new.writestr(name, content if name == member else old.read(name))


class Marker:
    """Makes a file when it is unpickled."""

    def __init__(self, path: Path) -> None:
        self.path = path

    def __reduce__(self) -> tuple[Any, ...]:
        return Path.touch, (self.path,)


def test_pickles_are_never_opened(file: Path, tmp_path: Path) -> None:
    marker = tmp_path / "opened"
    for name in ("learned_means", "header", "extra"):
        small_model().save(file)
        np.savez(file, **{**_content(file), name: np.array([Marker(marker)], dtype=object)})
        assert "found pickled objects" in rejected(file)
    file.write_bytes(Marker(marker).__reduce__.__name__.encode())
    rejected(file)
    assert not marker.exists()


def test_sizes_are_checked_before_memory_is_taken(file: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    huge = "{'descr': '<f8', 'fortran_order': False, 'shape': (1000000000, 1000), }"
    _replaced(file, "learned_means.npy", _npy(huge, bytes(1000)))
    assert "claims 8000000000000 bytes of numbers in 1128" in rejected(file)
    small_model().save(file)
    zeros = "{'descr': '<f8', 'fortran_order': False, 'shape': (400000,), }"
    _replaced(file, "learned_means.npy", _npy(zeros, bytes(3_200_000)), zipfile.ZIP_DEFLATED)
    assert file.stat().st_size < 20_000
    monkeypatch.setattr(storage, "MAX_BYTES", 2**20)
    assert "expected at most 500 arrays of 1 MB together, found 10 of 3 MB" in rejected(file)


@pytest.mark.parametrize(
    "member",
    [
        _npy("{'descr': '<f8', 'fortran_order': False, 'shape': (-4, 5, 3), }"),
        _npy("{'descr': '<f8', 'fortran_order': False}"),
        _npy("[" * 100),
        _npy("__import__('os')"),
        _npy("{'descr': '<f8', 'fortran_order': False, 'shape': (0,), }", version=b"\x09\x00"),
        b"",
    ],
)
def test_a_damaged_array_is_refused(file: Path, member: bytes) -> None:
    _replaced(file, "learned_means.npy", member)
    assert "cut off or damaged" in rejected(file)


def test_a_save_that_is_cut_short_leaves_the_old_file(file: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def cut_short(stream: Any, **_: Any) -> None:
        stream.write(b"half")
        raise KeyboardInterrupt

    whole = file.read_bytes()
    monkeypatch.setattr(np, "savez_compressed", cut_short)
    with pytest.raises(KeyboardInterrupt):
        small_model().save(file)
    assert file.read_bytes() == whole
