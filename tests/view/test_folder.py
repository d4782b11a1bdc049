"""Nothing is read or written beyond the folder, and nothing lost that was there."""

import pytest

from borecheck.errors import BorecheckError
from borecheck.geometry.mesh.primitives import box
from borecheck.geometry.mesh_files.reading import write_stl
from borecheck.view.folder import Folder

PRECIOUS = "precious notes\n"


@pytest.fixture
def around(tmp_path):
    """A folder with files beside it, and links in it that lead there."""
    inside = tmp_path / "inside"
    (inside / "below").mkdir(parents=True)
    (tmp_path / "inside_too").mkdir()
    write_stl(tmp_path / "outside.stl", box("outside", (0.1, 0.1, 0.1)))
    write_stl(inside / "mesh.stl", box("mesh", (0.1, 0.1, 0.1)))
    (tmp_path / "plan.csv").write_text(PRECIOUS)
    (inside / "there.csv").write_text(PRECIOUS)
    (inside / "link.stl").symlink_to(tmp_path / "outside.stl")
    (inside / "link.csv").symlink_to(tmp_path / "plan.csv")
    (inside / "new.csv").symlink_to(tmp_path / "new.csv")
    (inside / "out").symlink_to(tmp_path / "inside_too")
    (inside / "in").symlink_to("below")
    (inside / "circle.csv").symlink_to("circle.csv")
    return inside


def test_meshes_below_the_folder_are_read(around):
    whole = str(around.resolve() / "mesh.stl")
    assert Folder(around).readable("mesh.stl") == whole
    assert (
        Folder(around).readable("./below/../mesh.stl:mm@0,0,1") == f"{whole}:mm@0,0,1"
    )
    assert Folder(around).readable(whole) == whole


@pytest.mark.parametrize(
    "text",
    [
        "../outside.stl",
        "link.stl:m",
        "below/../../outside.stl@0,0,0",
        "/etc/passwd",
        "there.csv",
        "robot.urdf",
        "",
        "a\0b.stl",
    ],
)
def test_nothing_else_is_read(around, text):
    with pytest.raises(BorecheckError):
        Folder(around).readable(text)


def test_absolute_and_relative_names_below_are_written(around):
    folder = Folder(around)
    assert folder.writable("p.csv", (".csv",)) == around.resolve() / "p.csv"
    assert folder.writable("in/p.JSON", (".csv", ".json")).name == "p.JSON"


@pytest.mark.parametrize(
    "name",
    [
        "../plan.csv",
        "../inside_too/p.csv",
        "link.csv",
        "new.csv",
        "out/p.csv",
        "circle.csv",
        "none/p.csv",
        ".bashrc",
        "p.csv.sh",
        "below",
        "",
        "a\0.csv",
    ],
)
@pytest.mark.parametrize("overwrite", [False, True])
def test_nothing_else_is_written(around, name, overwrite):
    with pytest.raises(BorecheckError):
        Folder(around).writable(name, (".csv",), overwrite=overwrite)


def test_what_is_there_is_not_overwritten_without_a_word(around):
    with pytest.raises(BorecheckError, match="tick Overwrite"):
        Folder(around).writable("there.csv", (".csv",))
    file = Folder(around).writable("there.csv", (".csv",), overwrite=True)
    assert file.read_text() == PRECIOUS


def test_the_view_keeps_to_it(small_view):
    folder = small_view.folder.path
    victim = folder.parent / "victim.csv"
    victim.write_text(PRECIOUS)
    (folder / "own.csv").write_text(PRECIOUS)
    for name in ("../victim.csv", str(victim), "own.csv", "\0", "block.stl"):
        small_view.save_plan(name)
        assert "Not done" in small_view.panel.note.content, name
    assert victim.read_text() == (folder / "own.csv").read_text() == PRECIOUS
    small_view.panel.overwrite.value = True
    small_view.save_plan("own.csv")
    assert "Saved" in small_view.panel.note.content
    assert (folder / "own.csv").read_text() != PRECIOUS
    assert small_view.panel.overwrite.value is False
    small_view.write_report("../page.html")
    assert "Not done" in small_view.panel.note.content
    small_view.load_patient("/etc/passwd")
    assert "Not done" in small_view.panel.note.content
    assert {p.name for p in folder.iterdir()} == {"block.stl", "own.csv"}


def test_a_file_that_is_dropped_is_a_mesh_and_goes_with_the_view(small_view):
    class Dropped:
        name = "../../robot.urdf"
        content = b"<robot/>"

    small_view.take(Dropped)
    assert "drop a mesh" in small_view.panel.note.content
