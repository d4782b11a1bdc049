"""The cache folder: listed, cleared, kept below a limit, strangers' files untouched."""

import os

import numpy as np
import pytest

from borecheck.cli import main
from borecheck.core import cache
from borecheck.core.kept import entries, limit, trim
from borecheck.core.units import parse_size
from borecheck.errors import UsageError


@pytest.fixture
def folder(tmp_path, monkeypatch):
    made = tmp_path / "kept"
    monkeypatch.setenv("BORECHECK_CACHE", str(made))
    cache._trim_once.cache_clear()
    return made


def fill(folder):
    for k in range(4):
        cache.store("tree-1", f"{k}abc", {"a": np.zeros(1000 * (k + 1))})
        os.utime(folder / f"tree-1-{k}abc.npz", (1000 + k, 1000 + k))
    meshes = folder / "meshes" / "arm-fine-0123"
    meshes.mkdir(parents=True)
    (meshes / "a.stl").write_bytes(b"x" * 500)
    (folder / "letter.txt").write_text("mine")


def test_what_is_kept_is_listed_by_kind(folder, capsys):
    fill(folder)
    assert [e.kind for e in entries(folder)] == ["tree"] * 4 + ["meshes"]
    assert main(["cache", "info"]) == 0
    printed = capsys.readouterr().out
    assert "tree: 4" in printed
    assert "meshes: 1" in printed
    assert "letter" not in printed


def test_clear_takes_ours_and_leaves_others(folder, capsys):
    fill(folder)
    assert main(["cache", "clear"]) == 0
    assert entries(folder) == []
    assert (folder / "letter.txt").read_text() == "mine"
    assert cache.load("tree-1", "0abc") is None


def test_the_oldest_goes_first_when_it_is_too_much(folder):
    fill(folder)
    sizes = [e.size for e in entries(folder)]
    gone = trim(folder, sum(sizes) - sizes[0] - 1)
    assert [e.path.name for e in gone] == ["tree-1-0abc.npz", "tree-1-1abc.npz"]
    assert trim(folder, sum(sizes)) == []


def test_a_store_keeps_the_limit(folder, monkeypatch):
    fill(folder)
    monkeypatch.setenv("BORECHECK_CACHE_LIMIT", "20kB")
    cache._trim_once.cache_clear()
    cache.store("tree-1", "new", {"a": np.zeros(10)})
    assert sum(e.size for e in entries(folder)) <= 20_000
    assert cache.load("tree-1", "new") is not None


def test_a_link_is_not_followed(folder, tmp_path):
    fill(folder)
    precious = tmp_path / "precious.npz"
    precious.write_bytes(b"keep")
    (folder / "tree-1-link.npz").symlink_to(precious)
    main(["cache", "clear"])
    assert precious.read_bytes() == b"keep"


@pytest.mark.parametrize("text", ["", "2", "MB", "-1MB", "1.5MB", "2 XB", "\u0662MB"])
def test_no_size(text, monkeypatch):
    with pytest.raises(UsageError):
        parse_size(text)
    monkeypatch.setenv("BORECHECK_CACHE_LIMIT", text)
    with pytest.raises(UsageError, match="BORECHECK_CACHE_LIMIT"):
        limit()


def test_sizes():
    assert parse_size("20kB") == 20_000
    assert parse_size(" 2 GB ") == 2_000_000_000
