"""The cache never decides anything: what is there and sound is used, nothing else."""

import logging
from pathlib import Path

import numpy as np
import pytest

from borecheck.core import cache


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.setenv("BORECHECK_CACHE", str(tmp_path / "cache"))
    return tmp_path / "cache"


ARRAYS = {"a": np.arange(6.0).reshape(2, 3), "b": np.arange(4, dtype=np.int32)}


def test_folder_follows_the_environment(monkeypatch, tmp_path):
    monkeypatch.setenv("BORECHECK_CACHE", str(tmp_path / "mine"))
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "xdg"))
    assert cache.cache_folder() == tmp_path / "mine"
    monkeypatch.delenv("BORECHECK_CACHE")
    assert cache.cache_folder() == tmp_path / "xdg" / "borecheck"
    monkeypatch.setenv("XDG_CACHE_HOME", "not/absolute")
    assert cache.cache_folder() == Path.home() / ".cache" / "borecheck"
    monkeypatch.delenv("XDG_CACHE_HOME")
    assert cache.cache_folder() == Path.home() / ".cache" / "borecheck"


def test_asking_creates_nothing(folder, caplog):
    assert cache.load("tree-1", "key") is None
    assert not folder.exists()
    assert not caplog.text


def test_arrays_come_back_as_they_were(folder):
    cache.store("tree-1", "key", ARRAYS)
    loaded = cache.load("tree-1", "key")
    assert loaded is not None
    assert loaded.keys() == ARRAYS.keys()
    for name, array in ARRAYS.items():
        np.testing.assert_array_equal(loaded[name], array)
        assert loaded[name].dtype == array.dtype
    assert cache.load("tree-1", "other") is None
    assert cache.load("tree-2", "key") is None


def test_nothing_but_the_file_is_left(folder):
    cache.store("tree-1", "key", ARRAYS)
    cache.store("tree-1", "key", ARRAYS)
    assert list(folder.iterdir()) == [cache.cache_file("tree-1", "key")]


def damages(content):
    """The ways a file goes wrong: cut off, empty, foreign, one byte changed."""
    yield content[: len(content) // 2]
    yield b""
    yield b"<html>not found</html>"
    for place in range(70, len(content), 40):
        yield content[:place] + bytes([content[place] ^ 1]) + content[place + 1 :]


def test_damaged_files_are_named_and_never_believed(folder, caplog):
    cache.store("tree-1", "key", ARRAYS)
    file = cache.cache_file("tree-1", "key")
    content = file.read_bytes()
    refused = 0
    for damaged in damages(content):
        file.write_bytes(damaged)
        with caplog.at_level(logging.WARNING):
            loaded = cache.load("tree-1", "key")
        if loaded is None:
            refused += 1
            (record,) = caplog.records
            assert str(file) in record.getMessage()
            assert "\n" not in record.getMessage()
        else:  # a byte of the archive that carries nothing
            assert all(np.array_equal(loaded[k], v) for k, v in ARRAYS.items())
        caplog.clear()
    assert refused > 8


def test_pickled_objects_are_not_loaded(folder, caplog):
    folder.mkdir()
    np.savez(cache.cache_file("tree-1", "key"), a=np.array([{}], dtype=object))
    assert cache.load("tree-1", "key") is None
    assert "damaged" in caplog.text


def test_a_folder_that_cannot_be_written_costs_a_warning_only(
    tmp_path, monkeypatch, caplog
):
    in_the_way = tmp_path / "file"
    in_the_way.write_text("")
    monkeypatch.setenv("BORECHECK_CACHE", str(in_the_way / "cache"))
    cache.store("tree-1", "key", ARRAYS)
    assert "not cached" in caplog.text


def test_an_interrupted_write_leaves_the_old_file(folder, monkeypatch):
    cache.store("tree-1", "key", ARRAYS)

    def interrupted(stream, **_):
        stream.write(b"half")
        raise KeyboardInterrupt

    monkeypatch.setattr(np, "savez", interrupted)
    with pytest.raises(KeyboardInterrupt):
        cache.store("tree-1", "key", {"a": np.zeros(3)})
    monkeypatch.undo()
    monkeypatch.setenv("BORECHECK_CACHE", str(folder))
    loaded = cache.load("tree-1", "key")
    assert loaded is not None
    np.testing.assert_array_equal(loaded["a"], ARRAYS["a"])
    assert len(list(folder.iterdir())) == 1
