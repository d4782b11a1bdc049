"""Outputs: whole or not at all, and what stands under a name stays what it is."""

import os
import socket
import subprocess
import sys
import threading
from pathlib import Path

import pytest

from borecheck.cli import main
from borecheck.core.whole_files import check_writable, same_file, write_all, write_whole
from borecheck.errors import InputError
from borecheck.geometry.mesh.primitives import box
from borecheck.geometry.mesh_files.reading import write_stl
from tests.places import ROBOTS

NULL = Path("/dev/null")
OLD, NEW = "what was there\n" * 20, "what is new\n"


def names(folder):
    return sorted(path.name for path in folder.iterdir())


def refused(path, *, stream=True):
    """Both the check before the work and the writing itself say no, in one line."""
    with pytest.raises(InputError) as error:
        check_writable(path, stream=stream)
    if stream:
        with pytest.raises(InputError):
            write_whole(path, NEW)
    assert "\n" not in str(error.value)
    return error.value.problem


def test_a_new_file_gets_the_permissions_of_any_new_file(tmp_path):
    before = os.umask(0o027)
    try:
        write_whole(tmp_path / "new", NEW)
    finally:
        os.umask(before)
    assert (tmp_path / "new").stat().st_mode & 0o777 == 0o640
    assert names(tmp_path) == ["new"]


@pytest.mark.parametrize("mode", [0o600, 0o755, 0o622])
def test_a_file_keeps_its_permissions(tmp_path, mode):
    file = tmp_path / "file"
    file.write_text(OLD)
    file.chmod(mode)
    write_whole(file, NEW)
    assert file.read_text() == NEW
    assert file.stat().st_mode & 0o777 == mode


def test_links_are_followed_and_stay(tmp_path):
    (tmp_path / "there").mkdir()
    file = tmp_path / "there" / "file"
    file.write_text(OLD)
    (tmp_path / "link").symlink_to("there/file")
    (tmp_path / "link_to_link").symlink_to(tmp_path / "link")
    write_whole(tmp_path / "link_to_link", NEW)
    assert (tmp_path / "link").is_symlink()
    assert (tmp_path / "link_to_link").is_symlink()
    assert file.read_text() == NEW
    assert same_file(tmp_path / "link", file)


def test_a_link_to_nothing_yet_makes_its_file(tmp_path):
    (tmp_path / "link").symlink_to("new")
    write_whole(tmp_path / "link", NEW)
    assert (tmp_path / "link").is_symlink()
    assert (tmp_path / "new").read_text() == NEW
    (tmp_path / "lost").symlink_to("no/folder")
    assert refused(tmp_path / "lost").startswith("cannot be written: no folder")


def test_other_names_of_a_file_hold_the_same(tmp_path):
    (tmp_path / "one").write_text(OLD)
    (tmp_path / "two").hardlink_to(tmp_path / "one")
    write_whole(tmp_path / "one", NEW)
    assert (tmp_path / "two").read_text() == NEW


def test_what_is_no_file_to_write_is_refused(tmp_path):
    (tmp_path / "folder").mkdir()
    (tmp_path / "to_folder").symlink_to("folder")
    (tmp_path / "circle").symlink_to("circle")
    (tmp_path / "locked").write_text(OLD)
    (tmp_path / "locked").chmod(0o444)
    with socket.socket(socket.AF_UNIX) as server:
        server.bind(str(tmp_path / "socket"))
        assert "a socket" in refused(tmp_path / "socket")
    assert "Is a directory" in refused(tmp_path / "folder")
    assert "Is a directory" in refused(tmp_path / "to_folder")
    assert "Permission denied" in refused(tmp_path / "locked")
    assert "links" in refused(tmp_path / "circle")
    assert "no folder" in refused(tmp_path / "locked" / "below")
    assert (tmp_path / "locked").read_text() == OLD


def test_devices_are_written_to_or_refused(tmp_path):
    before = NULL.stat()
    (tmp_path / "null").symlink_to(NULL)
    write_whole(tmp_path / "null", NEW)
    assert os.path.samestat(NULL.stat(), before)
    assert "a device" in refused(NULL, stream=False)
    with pytest.raises(InputError, match="No space left"):
        write_whole(Path("/dev/full"), NEW)


def test_a_pipe_is_written_to_and_one_without_a_reader_is_no_hang(tmp_path):
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    with pytest.raises(InputError, match="nobody reads"):
        write_whole(pipe, NEW)
    much, got = NEW * 100_000, []  # more than a pipe holds
    reader = threading.Thread(target=lambda: got.append(pipe.read_text()))
    reader.start()
    while reader.is_alive():
        try:
            write_whole(pipe, much)
            break
        except InputError:  # not yet opened
            continue
    reader.join(timeout=10.0)
    assert got == [much]
    assert pipe.is_fifo()


def test_files_together_are_all_written_or_none(tmp_path):
    (tmp_path / "one").write_text(OLD)
    (tmp_path / "two").write_text(OLD)
    (tmp_path / "two").chmod(0o444)
    with pytest.raises(InputError, match="two"):
        write_all({tmp_path / "one": NEW, tmp_path / "two": NEW})
    assert (tmp_path / "one").read_text() == OLD
    (tmp_path / "two").chmod(0o644)
    write_all({tmp_path / "one": NEW, tmp_path / "two": b"bytes"})
    assert (tmp_path / "one").read_text() == NEW
    assert names(tmp_path) == ["one", "two"]


def test_our_own_output_is_not_written_from_its_beginning_again(tmp_path):
    code = (
        "from pathlib import Path; from borecheck.core.whole_files import write_whole;"
        "print('first'); write_whole(Path('/dev/stdout'), 'second\\n'); print('third')"
    )
    for name in ("file", "/dev/null"):
        with (tmp_path / name).open("w") as out:
            subprocess.run([sys.executable, "-c", code], stdout=out, check=True)
    assert (tmp_path / "file").read_text() == "first\nsecond\nthird\n"


def test_an_output_is_none_of_the_files_that_are_read(tmp_path, capsys):
    path = tmp_path / "way.csv"
    path.write_text("j\n0\n")
    (tmp_path / "link.json").symlink_to(path)
    words = ["check", str(ROBOTS / "two_link.urdf"), "ct_gantry", "--path", str(path)]
    for out in (path, tmp_path / "link.json"):
        assert main([*words, "--out", str(out)]) == 2
        assert "is read too" in capsys.readouterr().err
    both = ["--out", str(tmp_path / "x"), "--report", str(tmp_path / "." / "x")]
    assert main([*words, *both]) == 2
    assert "the same file" in capsys.readouterr().err
    assert path.read_text() == "j\n0\n"


@pytest.mark.parametrize("name", ["room.stl", "room.STL", "link.json"])
def test_no_result_replaces_a_mesh_or_a_robot(name, tmp_path, capsys):
    """Whether it is read under another name (`room.stl:m@0,0,1`), or by the robot."""
    room = tmp_path / ("room.stl" if name == "link.json" else name)
    write_stl(room, box("room", (1, 1, 1)))
    before = room.read_bytes()
    if name == "link.json":
        (tmp_path / name).symlink_to(room)
    words = ["check", str(ROBOTS / "two_link.urdf"), f"{room}:m@0,0,1", "--q", "home"]
    for option in ("--out", "--report"):
        assert main([*words, option, str(tmp_path / name)]) == 2
        assert "is there already and no result" in capsys.readouterr().err
    assert room.read_bytes() == before


def test_a_result_that_cannot_be_written_is_shown_all_the_same(tmp_path, capsys):
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    assert main(["fk", str(ROBOTS / "two_link.urdf"), "--q", "0", "--out", str(pipe)])
    out, err = capsys.readouterr()
    assert out.startswith("AGREE")
    assert err == f"borecheck: error: {pipe}: cannot be written: nobody reads from it\n"
