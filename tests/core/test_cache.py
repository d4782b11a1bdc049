"""The cache never decides anything: what is there and sound is used, nothing else."""

import logging
import os
import tempfile
from pathlib import Path

import numpy as np
import pytest

from borecheck.core import cache, private_folder


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.setenv("BORECHECK_CACHE", str(tmp_path / "cache"))
    return tmp_path / "cache"


@pytest.fixture(autouse=True)
def _nothing_remembered():
    _forget()
    yield
    _forget()


def _forget():
    cache.process_folder.cache_clear()
    cache._warn_of_folder.cache_clear()


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


def test_the_folder_is_for_us_alone(folder):
    cache.store("tree-1", "key", ARRAYS)
    assert folder.stat().st_mode & 0o777 == 0o700


def test_a_folder_that_others_read_is_closed(folder):
    folder.mkdir(mode=0o755)
    assert cache.cache_folder() == folder
    assert folder.stat().st_mode & 0o777 == 0o700


@pytest.mark.parametrize("below", ["", "x/y"])
def test_a_folder_that_others_write_is_not_used(folder, monkeypatch, caplog, below):
    cache.store("tree-1", "key", ARRAYS)
    monkeypatch.setenv("BORECHECK_CACHE", str(folder / below))
    folder.chmod(0o777)
    assert cache.cache_folder() == cache.process_folder()
    assert cache.load("tree-1", "key") is None
    cache.store("tree-1", "other", ARRAYS)
    assert len(list(folder.iterdir())) == 1
    assert "can be written by others" in caplog.text
    assert folder.stat().st_mode & 0o777 == 0o777


def test_a_folder_of_somebody_else_is_not_used(folder, monkeypatch, caplog):
    cache.store("tree-1", "key", ARRAYS)
    monkeypatch.setattr(os, "geteuid", lambda: 54_321)  # as with sudo, the other way
    private_folder._believed.cache_clear()
    assert cache.cache_folder() == cache.process_folder()
    assert "belongs to" in caplog.text
    private_folder._believed.cache_clear()


@pytest.mark.skipif(os.getuid() != 0, reason="only root gives folders away")
def test_root_believes_no_folder_of_a_user(folder):
    folder.parent.chmod(0o755)
    for place in (folder, folder.parent):
        folder.mkdir(exist_ok=True)
        os.chown(place, 54_321, 54_321)
        assert cache.cache_folder() == cache.process_folder()
        os.chown(place, 0, 0)
        assert cache.cache_folder() == folder
    (folder.parent / "link").symlink_to(folder)
    os.lchown(folder.parent / "link", 54_321, 54_321)
    assert private_folder.distrust(folder.parent / "link") is not None


def test_without_a_home_the_name_in_the_shared_folder_must_be_ours(
    tmp_path, monkeypatch
):
    """Whoever makes it first, with room for us to write, would feed us."""
    monkeypatch.setattr(Path, "expanduser", _no_home)
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path / "shared"))
    for name in ("BORECHECK_CACHE", "XDG_CACHE_HOME"):
        monkeypatch.delenv(name, raising=False)
    (tmp_path / "shared").mkdir()
    (tmp_path / "shared").chmod(0o1777)
    planted = tmp_path / "shared" / f"borecheck-{os.getuid()}"
    assert cache.cache_folder() == planted
    planted.mkdir()
    planted.chmod(0o777)
    assert cache.cache_folder() == cache.process_folder()
    planted.rmdir()
    (tmp_path / "theirs").mkdir()
    (tmp_path / "theirs").chmod(0o777)
    planted.symlink_to(tmp_path / "theirs")
    assert cache.cache_folder() == cache.process_folder()


def _no_home(path):
    raise RuntimeError("no home")
