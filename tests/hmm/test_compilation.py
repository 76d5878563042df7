"""Machine code on disk: whole when several processes compile at once, never from other code, and not for ever."""

import subprocess
import sys

import pytest

KERNEL = """
from paramove.hmm.compilation import compiled

@compiled
def kernel(x):
    return 10 * x
"""
PROGRAM = """
import sys
from kernel_file import kernel
for text in sys.argv[1:]:
    print(kernel(float(text) if "." in text else int(text)), end=" ")
"""


@pytest.fixture
def folder(tmp_path):
    """A folder with a kernel."""
    (tmp_path / "kernel_file.py").write_text(KERNEL)
    return tmp_path


def started(folder, *numbers, program=PROGRAM):
    """A process that calls the kernel for numbers."""
    return subprocess.Popen(
        [sys.executable, "-c", program, *numbers],
        cwd=folder,
        env={
            "PATH": "/usr/bin:/bin",
            "HOME": str(folder),
            "XDG_CACHE_HOME": str(folder / "cache"),
            "PYTHONDONTWRITEBYTECODE": "1",  # Python takes a file of the same size and second for unchanged
        },
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )


def ended(process):
    """What it printed, and how often it said that it compiles."""
    output, said = process.communicate(timeout=300)
    assert process.returncode == 0, said
    return output.split(), said.count("compiling")


def test_processes_that_compile_at_once_lose_nothing(folder):
    together = [started(folder, numbers) for numbers in ("1", "1.5", "2", "2.5")]
    found = [ended(process) for process in together]
    assert [values for values, _ in found] == [["10"], ["15.0"], ["20"], ["25.0"]]
    assert all(compiled <= 1 for _, compiled in found)  # 0: another one was so much sooner that its code was there
    assert ended(started(folder, "3", "3.5")) == (["30", "35.0"], 0)


def test_numba_is_imported_when_the_first_kernel_is_called(folder):
    imported = "print('numba' in sys.modules, end=' ')\n"
    program = PROGRAM.replace("kernel\n", f"kernel\n{imported}", 1) + imported
    assert ended(started(folder, "1", program=program))[0] == ["False", "10", "True"]


def test_old_machine_code_is_not_used_and_not_stored_for_ever(folder):
    assert ended(started(folder, "1")) == (["10"], 1)
    (old,) = folder.rglob("*.nbc")
    (folder / "kernel_file.py").write_text(KERNEL.replace("10", "11"))
    assert ended(started(folder, "1")) == (["11"], 1)
    (new,) = folder.rglob("*.nbc")
    assert new != old


NESTED = """
from paramove.hmm.compilation import {decorator}

@{decorator}
def inner(x, y):
    total = 0.0
    for i in range(x.size):
{statements}
    return total

@{decorator}
def outer(x, y):
    return inner(x, y) + inner(y, x)
"""
SYMBOLS = """
import numpy as np
from kernel_file import outer
outer(np.ones(3), np.ones(3))
(assembly,) = outer.dispatcher.inspect_asm().values()
print(any("movabs" in line and "5inner" in line and "NumbaEnv" not in line for line in assembly.splitlines()))
"""


@pytest.mark.parametrize(
    ("decorator", "separate"), [("compiled", "True"), ("compiled_sums", "False"), ("compiled_arithmetic", "False")]
)
def test_a_kernel_that_may_round_in_several_ways_is_one_with_the_kernel_that_calls_it(folder, decorator, separate):
    """Else the process that compiles uses another rounding of it than those that load the machine code."""
    statements = "\n".join(
        f"        total += y[i] * {number}.5 + total * x[i] / {number + 2}.0" for number in range(25)
    )
    (folder / "kernel_file.py").write_text(NESTED.format(decorator=decorator, statements=statements))
    assert ended(started(folder, program=SYMBOLS))[0] == [separate]


@pytest.mark.long
def test_a_file_that_was_cut_off_is_compiled_again(folder):
    ended(started(folder, "1"))
    (stored,) = folder.rglob("*.nbc")
    stored.write_bytes(stored.read_bytes()[:-100])
    assert ended(started(folder, "1")) == (["10"], 1)
    assert ended(started(folder, "1")) == (["10"], 0)


@pytest.mark.long
def test_where_the_code_lies_read_only_the_users_cache_has_the_machine_code(folder):
    (folder / "__pycache__").write_text("no folder can be made here")
    assert ended(started(folder, "1")) == (["10"], 1)
    assert ended(started(folder, "1")) == (["10"], 0)
    assert list((folder / "cache").rglob("kernel_file.*.nbc"))


@pytest.mark.long
def test_where_nothing_can_be_written_kernels_are_compiled_without_being_stored(folder):
    """A user without home in a container; root may write everywhere, so that files stand where folders would be."""
    (folder / "__pycache__").write_text("no folder can be made here")
    (folder / "cache").write_text("nor here")
    (folder / "kernel_file.py").write_text(KERNEL + KERNEL.partition("compiled\n\n")[2].replace("kernel", "another"))
    both = "from kernel_file import another\nanother(1)\n"
    for _ in range(2):
        process = started(folder, "1", "1.5", program=both + PROGRAM)
        output, said = process.communicate(timeout=300)
        assert process.returncode == 0, said
        assert output.split() == ["10", "15.0"]
        assert said.count("NUMBA_CACHE_DIR") == 1
    assert not list(folder.rglob("*.nbc"))


@pytest.mark.long
def test_a_process_whose_code_was_edited_meanwhile_leaves_nothing_to_others(folder):
    """It may have imported either."""
    edited = "import paramove.source_code, pathlib; file = pathlib.Path('kernel_file.py'); "
    assert ended(started(folder, "1", program=edited + "file.write_text(file.read_text())\n" + PROGRAM)) == (["10"], 1)
    assert ended(started(folder, "1")) == (["10"], 1)
