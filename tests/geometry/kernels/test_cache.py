"""Compiled kernels are never older than any source they were made from."""

import importlib
import subprocess
import sys
from pathlib import Path

import pytest
from numba.core.registry import CPUDispatcher

import borecheck
from borecheck.core import cache
from borecheck.geometry.kernels import cache as kernel_cache
from borecheck.geometry.kernels.cache import KernelLocator, sources, stamp

PACKAGE = Path(borecheck.__file__).parent
KERNEL_MODULES = sorted(
    ".".join(file.relative_to(PACKAGE.parent).with_suffix("").parts)
    for file in PACKAGE.rglob("*.py")
    if "\n@kernel" in file.read_text("utf-8")
)

INNER = """
import borecheck.constants_of
from numba import njit

@njit(cache=True)
def inner(x):
    return {factor} * x + borecheck.constants_of.OFFSET
"""
OUTER = """
from numba import njit
from borecheck.inner import inner

@njit(cache=True)
def outer(x):
    return inner(x)
"""


@pytest.fixture(autouse=True)
def _nothing_remembered():
    yield
    for remembered in (stamp, sources, kernel_cache._read):
        remembered.cache_clear()


@pytest.mark.parametrize("name", KERNEL_MODULES)
def test_every_cached_kernel_is_stamped_with_all_its_sources(name):
    module = importlib.import_module(name)
    kernels = [
        kernel
        for kernel in vars(module).values()
        if isinstance(kernel, CPUDispatcher)
        and kernel.py_func.__module__ == module.__name__
    ]
    assert kernels
    for kernel in kernels:
        if hasattr(kernel._cache, "_impl"):  # else it is not kept on disk at all
            assert isinstance(kernel._cache._impl.locator, KernelLocator), kernel


def test_there_are_kernels_to_look_at():
    expected = {"geometry.tree.query", "geometry.triangles.exact"}
    expected |= {"robots.kinematics.forward", "motion.halving"}
    assert {f"borecheck.{name}" for name in expected} <= set(KERNEL_MODULES)


def test_sources_of_the_walk_reach_down_to_the_predicates():
    found = sources(PACKAGE / "geometry" / "tree" / "query.py")
    names = {str(file.relative_to(PACKAGE).with_suffix("")) for file in found}
    tree, triangles = "geometry/tree/", "geometry/triangles/"
    assert {f"{tree}boxes", f"{tree}simd", "core/se3"} <= names
    assert {f"{triangles}exact", f"{triangles}exact_sign"} <= names
    assert "cli" not in names


def _package(folder: Path, factor: str = "2.0", offset: str = "1.0") -> Path:
    """A little package of that name, with the two modules under test."""
    package = folder / "borecheck"
    core = sorted(PACKAGE.joinpath("core").glob("*.py"))
    for file in (PACKAGE / "geometry/kernels/cache.py", PACKAGE / "errors.py", *core):
        copy = package / file.relative_to(PACKAGE)
        copy.parent.mkdir(parents=True, exist_ok=True)
        copy.write_text(file.read_text("utf-8"))
    (package / "__init__.py").write_text(
        "import borecheck.geometry.kernels.cache as k; k.use_for_this_package()\n"
    )
    (package / "constants_of.py").write_text(f"OFFSET = {offset}\n")
    (package / "inner.py").write_text(INNER.format(factor=factor))
    (package / "outer.py").write_text(OUTER)
    return package


def test_a_change_in_any_imported_file_changes_the_stamp(tmp_path):
    stamps = set()
    for turn, changed in enumerate(({}, {"factor": "3.0"}, {"offset": "4.0"})):
        package = _package(tmp_path / str(turn), **changed)
        stamps.add(stamp(package / "outer.py"))
    assert len(stamps) == 3
    again = _package(tmp_path / "again")
    assert stamp(again / "outer.py") in stamps


def test_a_changed_inner_kernel_or_constant_is_compiled_anew(tmp_path):
    def run() -> tuple[str, bool]:
        """What outer(10) gives, and whether its code came from the disk."""
        program = (
            "from borecheck.outer import outer; print(outer(10.0));"
            "print(bool(outer.stats.cache_hits))"
        )
        command = [sys.executable, "-c", program]
        done = subprocess.run(
            command, cwd=tmp_path, capture_output=True, text=True, check=True
        )
        value, loaded = done.stdout.split()
        return value, loaded == "True"

    _package(tmp_path)
    assert [run(), run()] == [("21.0", False), ("21.0", True)]
    _package(tmp_path, factor="3.0")  # outer.py has the same text as before
    assert run() == ("31.0", False)
    _package(tmp_path, factor="3.0", offset="4.0")
    assert run() == ("34.0", False)


def test_without_a_writable_folder_kernels_live_as_long_as_the_process(
    tmp_path, monkeypatch
):
    monkeypatch.setattr(kernel_cache, "_writable", lambda folder: False)
    folder = kernel_cache._folder.__wrapped__(tmp_path / "x.py")
    assert folder == cache.process_folder()
    assert folder.stat().st_mode & 0o777 == 0o700


@pytest.fixture
def kernel_folder(tmp_path, monkeypatch):
    """Where kernels of a source beside a `__pycache__` go, asked anew each time."""
    monkeypatch.setenv("BORECHECK_CACHE", str(tmp_path / "cache"))
    (tmp_path / "source" / "__pycache__").mkdir(parents=True)

    def asked():
        for remembered in (kernel_cache._writable, kernel_cache._is_ours):
            remembered.cache_clear()
        return kernel_cache._folder.__wrapped__(tmp_path / "source" / "x.py")

    yield asked
    for remembered in (kernel_cache._writable, kernel_cache._is_ours):
        remembered.cache_clear()


def test_kernels_are_not_read_where_others_can_write(tmp_path, kernel_folder):
    beside = tmp_path / "source" / "__pycache__"
    assert kernel_folder() == beside
    beside.chmod(0o777)
    assert (tmp_path / "cache") in kernel_folder().parents
    assert (tmp_path / "cache").stat().st_mode & 0o777 == 0o700
    beside.chmod(0o755)
    (tmp_path / "source").chmod(0o777)  # who can exchange it can fill it
    assert kernel_folder() != beside
    (tmp_path / "cache").chmod(0o777)
    assert cache.process_folder() in kernel_folder().parents


def test_a_kernel_that_others_can_change_is_not_run(tmp_path, kernel_folder):
    beside = tmp_path / "source" / "__pycache__"
    index = beside / "x.f-1.py311.nbi"
    index.write_bytes(b"")
    index.chmod(0o644)
    assert kernel_folder() == beside
    index.chmod(0o666)
    assert kernel_folder() != beside
    index.unlink()
    index.symlink_to(tmp_path / "elsewhere")
    assert kernel_folder() != beside


def test_other_packages_kernels_are_left_to_numba(tmp_path):
    assert KernelLocator.from_function(_package, __file__) is None
