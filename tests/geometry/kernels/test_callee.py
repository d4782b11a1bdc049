"""A kernel compiled for another kernel has no door; the answers are the same."""

import importlib.util
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from borecheck.geometry.kernels.callee import KernelDispatcher, is_callee

SOURCE = """
from borecheck.geometry.kernels.compile import INLINE, kernel

@kernel(**INLINE)
def tenth(x):
    return 0.1 * x

@kernel
def inner(x):
    return tenth(x) * x + 1.0

@kernel
def outer(values):
    total = 0.0
    for i in range(len(values)):
        total += inner(values[i])
    return total
"""


@pytest.fixture
def made(tmp_path):
    file = tmp_path / "some_kernels.py"
    file.write_text(SOURCE)
    spec = importlib.util.spec_from_file_location("some_kernels", file)
    module = importlib.util.module_from_spec(spec)
    sys.modules["some_kernels"] = module
    spec.loader.exec_module(module)
    yield module
    del sys.modules["some_kernels"]


def plain(values):
    return sum(0.1 * x * x + 1.0 for x in values)


def kept(folder: Path) -> set[str]:
    """Kernels that have a cache file, by name."""
    return {file.name.split("-")[0].split(".")[1] for file in folder.rglob("*.nbi")}


def test_only_what_python_calls_has_a_door_and_a_file(made, tmp_path):
    values = np.linspace(-1.0, 1.0, 7)
    assert made.outer(values) == pytest.approx(plain(values), rel=1e-15)
    for helper in (made.inner, made.tenth):
        (compiled,) = helper.overloads.values()
        assert is_callee(compiled)
    (compiled,) = made.outer.overloads.values()
    assert not is_callee(compiled)
    assert kept(tmp_path) == {"outer"}


def test_a_callee_that_python_calls_is_compiled_whole(made, tmp_path):
    values = np.linspace(-1.0, 1.0, 7)
    before = made.outer(values)
    assert made.inner(3.0) == pytest.approx(1.9, rel=1e-15)
    (compiled,) = made.inner.overloads.values()
    assert not is_callee(compiled)
    assert made.outer(values) == before
    assert kept(tmp_path) == {"outer", "inner"}


def test_one_that_was_whole_already_is_taken(made):
    assert made.inner(2.0) == pytest.approx(1.4, rel=1e-15)
    (whole,) = made.inner.overloads.values()
    values = np.array([2.0, 2.0])
    assert made.outer(values) == 2.0 * made.inner(2.0)
    assert list(made.inner.overloads.values()) == [whole]


def test_another_type_is_compiled_beside(made):
    made.outer(np.array([1.0, 2.0]))
    assert made.outer(np.array([1, 2])) == pytest.approx(plain([1, 2]), rel=1e-15)
    assert len(made.outer.overloads) == 2
    assert KernelDispatcher.depth == 0


def test_a_kernel_that_cannot_be_compiled_leaves_no_trace(made):
    with pytest.raises(Exception, match="nopython"):
        made.outer(object())
    assert KernelDispatcher.depth == 0
    assert made.outer(np.array([1.0])) == pytest.approx(1.1, rel=1e-15)


def test_kernels_of_others_are_compiled_as_ever(made):
    from numba import njit

    @njit
    def helper(x):
        return 2.0 * x

    @njit
    def caller(x):
        return helper(x) + 1.0

    assert caller(1.0) == 3.0
    (compiled,) = helper.overloads.values()
    assert not is_callee(compiled)


def test_without_numba_it_is_the_function(tmp_path):
    (tmp_path / "some_kernels.py").write_text(SOURCE)
    code = "import some_kernels as s; print(type(s.inner).__name__, s.inner(2.0))"
    found = subprocess.run(
        [sys.executable, "-c", code],
        capture_output=True,
        text=True,
        check=True,
        env=_environment(tmp_path, NUMBA_DISABLE_JIT="1"),
    )
    assert found.stdout.strip() == "function 1.4"


def test_without_optimisation_it_is_the_same(tmp_path):
    """numba keeps such kernels nowhere, and crashed on saying so."""
    code = (
        "import numpy as np;"
        "from borecheck.geometry.triangles.placing import place_vertices as place;"
        "print(place(np.diag([2.0, 3.0, 4.0, 1.0]), np.ones((2, 3)))[1].tolist())"
    )
    found = subprocess.run(
        [sys.executable, "-W", "ignore", "-c", code],
        capture_output=True,
        text=True,
        check=True,
        env=_environment(tmp_path, NUMBA_OPT="0", NUMBA_CACHE_DIR=str(tmp_path)),
    )
    assert found.stdout.strip() == "[2.0, 3.0, 4.0]"


def _environment(folder: Path, **more: str) -> dict[str, str]:
    import os

    path = os.pathsep.join([str(folder), os.environ.get("PYTHONPATH", "")])
    return {**os.environ, "PYTHONPATH": path, **more}
