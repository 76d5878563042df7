"""Every cache key has the digest of the code: after an edit, kernels, models and clips are those of the new code."""

import ast
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from paramove.source_code import _imports, modules_behind

ROOT = Path(__file__).resolve().parents[1]
LIKELIHOOD = """
import numpy as np
from paramove.hmm.kernels import segments_log_likelihood
log_output = -np.linspace(0.5, 4.0, 18).reshape(2, 9)
print(segments_log_likelihood(log_output, np.log(np.full((2, 6), 1 / 6)), 2))
"""
REACHING = """
from pathlib import Path
from paramove.demonstrations.reaching import train_reaching_model
print(train_reaching_model(n_states=8, repetitions=1, cache=Path("reaching.npz")).means_.sum())
"""
CLIP = """
from pathlib import Path
import numpy as np
from sim.performances import Studio, kind_named, missing, read_clip, render
Studio.times_s = np.array([0.0, 0.1])
kind = kind_named("pointing")
if (kind, 0) in missing(Path(), [kind]):
    print("rendered")
    render(kind, 0, Path())
print([int(np.sum(image)) for image in read_clip(Path("pointing_00")).images(0)])
"""


@pytest.fixture
def copy(tmp_path):
    """A copy of the library and of the simulation, whose files a test edits."""
    for name in ("src", "sim"):
        shutil.copytree(ROOT / name, tmp_path / name, ignore=shutil.ignore_patterns("__pycache__"))
    return tmp_path


def edit(file, old, new):
    text = file.read_text()
    assert old in text
    file.write_text(text.replace(old, new))


def run(copy, program, *, interpreted=False):
    """A program with the code of the copy; its output, and what it says beside it."""
    done = subprocess.run(
        [sys.executable, "-c", program],
        cwd=copy,
        env=os.environ
        | {
            "PYTHONPATH": f"{copy / 'src'}:{copy}",
            "XDG_CACHE_HOME": str(copy / "cache"),
            "NUMBA_DISABLE_JIT": str(int(interpreted)),
        },
        capture_output=True,
        text=True,
        timeout=600,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return done.stdout, done.stderr


@pytest.mark.long
def test_a_kernel_has_no_old_machine_code_of_another_one(copy):
    old, said = run(copy, LIKELIHOOD)
    assert said.count("compiling") == 1
    edit(copy / "src/paramove/hmm/vector_functions.py", "+ k * LN2_LOW + k * LN2_HIGH", "+ k * LN2_HIGH + 1.0")
    new, said = run(copy, LIKELIHOOD)
    assert said.count("compiling") == 1
    truth, _ = run(copy, LIKELIHOOD, interpreted=True)
    assert float(new) == pytest.approx(float(truth), rel=1e-12)
    assert abs(float(new) - float(old)) > 0.5
    assert run(copy, LIKELIHOOD) == (new, "")
    stored = [file.name.split(".") for file in copy.rglob("*.nbc")]
    assert len({(name[0], name[3]) for name in stored}) == len({name[0] for name in stored}), "old machine code stays"


def test_a_model_of_older_code_is_trained_again(copy):
    old, _ = run(copy, REACHING, interpreted=True)
    stored = copy / "reaching.npz"
    written = stored.stat().st_mtime_ns
    edit(copy / "src/paramove/cli/main.py", '"Look at the nodes on the bus."', '"Nodes."')
    assert run(copy, REACHING, interpreted=True)[0] == old
    assert stored.stat().st_mtime_ns == written, "trained again for a change of the command line"
    edit(copy / "src/paramove/demonstrations/synthetic.py", "def leaning", "SAMPLES = 1\n\n\ndef leaning")
    assert run(copy, REACHING, interpreted=True)[0] == old
    assert stored.stat().st_mtime_ns > written


def test_a_clip_of_older_code_is_rendered_again(copy):
    old, _ = run(copy, CLIP)
    assert run(copy, CLIP)[0] == old.removeprefix("rendered\n")
    edit(copy / "sim/performances.py", "mujoco.mj_kinematics(self._model, self._data)", "pass")
    new, _ = run(copy, CLIP)
    assert new.startswith("rendered")
    assert new != old


def test_imports_are_found_wherever_they_stand():
    """The quick reading of imports against Python's own, in every file."""
    files = [*(ROOT / "src").rglob("*.py"), *(ROOT / "sim").rglob("*.py")]
    for file in files:
        base = ROOT / "src" if file.is_relative_to(ROOT / "src") else ROOT
        module = ".".join(file.relative_to(base).with_suffix("").parts).removesuffix(".__init__")
        found = {(source, name) for source, names in _imports(module) for name in names or ("",)}
        for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
            if isinstance(node, ast.ImportFrom):
                assert node.level == 0, f"{file}: a relative import"
                imported = {(str(node.module), alias.name) for alias in node.names}
            else:
                imported = {(alias.name, "") for alias in node.names} if isinstance(node, ast.Import) else set()
            ours = {one for one in imported if one[0].partition(".")[0] in ("paramove", "sim")}
            assert ours <= found, f"{file}:{node.lineno}"


def test_only_what_is_needed_is_behind_a_module():
    found = set(modules_behind("paramove.phmm.polynomial"))
    assert {"paramove.phmm.polynomial", "paramove.phmm.parametric", "paramove.hmm.vector_functions"} <= found
    assert "paramove.phmm.interpolative" not in found
    reaching = modules_behind("paramove.demonstrations.reaching")
    assert "paramove.demonstrations.synthetic" in reaching
    assert "paramove.phmm.interpolative" in reaching
    for module in ("reaching", "last_parts"):
        behind = modules_behind(f"paramove.demonstrations.{module}")
        assert {name.split(".")[1] for name in behind} <= {
            "demonstrations",
            "documents",
            "hmm",
            "phmm",
            "input_error",
            "source_code",
        }
