"""Harmless oddities are read with a warning; what is wrong is called what it is."""

from pathlib import Path

import numpy as np
import pytest

import borecheck as bc
from borecheck.errors import MeshError
from borecheck.geometry.mesh.primitives import box
from borecheck.geometry.mesh_files.reading import read_mesh, read_mesh_file, write_stl
from studies.damaged_meshes import count_wrong
from tests.places import DATA

ODD = DATA / "cases" / "stl_oddities"
GOOD = DATA / "meshes" / "good"
CUBE = DATA / "cases" / "obj_no_final_newline" / "cube.obj"
READ = {
    "solid_binary", "text_cr", "text_crlf", "text_long_header", "text_nan_normal",
    "text_tab_upper", "text_two_solids", "upper", "text_bom", "text_comment",
    "text_nul_tail",
}  # fmt: skip


@pytest.mark.parametrize(
    "path", sorted(ODD.glob("*.[sS][tT][lL]")), ids=lambda p: p.name
)
def test_an_odd_stl_is_the_cube_or_refused_for_its_own_reason(path: Path) -> None:
    if path.stem in READ:
        mesh = read_mesh(path)
        assert mesh.bounds[0] == pytest.approx([0.3, -0.1, -0.1], abs=1e-6)
        assert len(mesh.triangles) == (24 if path.stem == "text_two_solids" else 12)
        end = mesh.corners[:12].max(axis=(0, 1))
        assert end == pytest.approx([0.5, 0.1, 0.1], abs=1e-6)
        return
    with pytest.raises(MeshError) as caught:
        read_mesh(path)
    if path.stem.startswith("text"):  # no count of triangles read out of letters
        assert "the header says" not in str(caught.value)


@pytest.mark.parametrize(
    ("before", "told"),
    [
        (b"<html>", "an HTML page"),
        (b"off we go ", "begins with 'off', not with solid"),
        (b"\xef\xbb\xbfvertex ", "begins with 'vertex', not with solid"),
    ],
)
def test_text_that_is_no_stl_is_told_by_its_first_word(before, told, tmp_path):
    path = tmp_path / "x.stl"
    path.write_bytes(before + b"nothing that is a solid\n" * 10)
    with pytest.raises(MeshError, match=told):
        read_mesh(path)


@pytest.mark.parametrize("suffix", [".stl", ".obj", ".ply"])
@pytest.mark.parametrize("encoding", ["utf-16", "utf-16-le", "utf-16-be"])
def test_text_in_utf16_is_called_so(suffix, encoding, tmp_path):
    name = {".stl": "text.stl", ".obj": "plain.obj", ".ply": "text.ply"}[suffix]
    path = tmp_path / f"wide{suffix}"
    path.write_bytes((GOOD / name).read_text().encode(encoding))
    with pytest.raises(MeshError, match="text in UTF-16"):
        read_mesh(path)


@pytest.mark.parametrize("name", ["text.stl", "plain.obj", "text.ply"])
def test_mark_and_zero_bytes_around_text_change_nothing(name, tmp_path):
    path = tmp_path / name
    given = (GOOD / name).read_bytes()
    path.write_bytes(b"\xef\xbb\xbf" + given)
    assert read_mesh_file(path).warnings == ()
    path.write_bytes(given + b"\0\0")
    found = read_mesh_file(path)
    assert "2 zero bytes" in found.warnings[0]
    np.testing.assert_array_equal(found.mesh.corners, read_mesh(GOOD / name).corners)


@pytest.mark.parametrize("name", ["binary.stl", "little_endian.ply"])
def test_of_a_binary_file_every_byte_counts(name, tmp_path):
    path = tmp_path / name
    path.write_bytes((GOOD / name).read_bytes() + b"\0")
    with pytest.raises(MeshError, match="bytes"):
        read_mesh(path)


def test_an_obj_without_its_last_line_end_is_read_if_it_is_closed(tmp_path):
    found = read_mesh_file(CUBE)
    assert found.mesh.is_closed
    assert "last line has no end" in found.warnings[0]
    text = CUBE.read_text()
    path = tmp_path / "cut.obj"
    for cut in (
        text[:-1],  # short of a corner
        text.rsplit("\n", 1)[0],  # an open box
        text + "\nv 9 9 1",  # a vertex that a face to come would use
        text + "\nv 9 9 1\n#",
    ):
        path.write_text(cut)
        with pytest.raises(MeshError):
            read_mesh(path)
    path.write_bytes(text.rsplit("\n", 1)[0].encode() + b"\n\0\0\0")
    with pytest.raises(MeshError, match="cut short"):  # zeros: an interrupted copy
        read_mesh(path)


def test_the_warning_reaches_the_user():
    assert any("last line" in w for w in bc.load_scene(f"{CUBE}:m").warnings)


def test_an_obstacle_more_than_three_metres_across_is_a_warning(tmp_path):
    path = tmp_path / "gantry.stl"
    write_stl(path, box("gantry", (1700.0, 900.0, 400.0)))
    (said,) = bc.load_scene(f"{path}:cm").warnings
    assert "17 x 9 x 4 m, more than 3 m across" in said
    assert bc.load_scene(f"{path}:mm").warnings == ()
    write_stl(path, box("gantry", (2.9, 2.9, 2.9)))
    assert bc.load_scene(f"{path}:m").warnings == ()


def test_a_patient_far_from_the_isocentre_is_a_warning(tmp_path):
    path = tmp_path / "torso.stl"
    write_stl(path, box("torso", (0.6, 0.4, 0.2)))
    (said,) = bc.load_scene([], patients=[f"{path}:m@5.3,0,0"]).warnings
    assert "a patient 5 m from the isocentre" in said
    assert bc.load_scene([], patients=[f"{path}:m@1,0,0"]).warnings == ()
    assert bc.load_scene(f"{path}:m@5.3,0,0").warnings == ()


def test_many_faces_that_bend_inwards_end(tmp_path):
    """What each may cost is bounded, and so is what all may."""
    angles = np.linspace(0.0, 2.0 * np.pi, 256, endpoint=False)
    radii = 1.0 + 0.5 * (np.arange(256) % 2)
    points = np.column_stack([radii * np.cos(angles), radii * np.sin(angles)])
    lines = [f"v {x!r} {y!r} 0" for x, y in points.tolist()]
    face = "f " + " ".join(map(str, range(1, 257)))
    path = tmp_path / "stars.obj"
    path.write_text("\n".join([*lines, *[face] * 300, ""]))
    with pytest.raises(MeshError, match="bend inwards"):
        read_mesh(path)
    path.write_text("\n".join([*lines, face, ""]))
    assert len(read_mesh(path).triangles) == 254


def test_a_seeded_part_of_the_study_of_damaged_files(capsys):
    """python -m studies.damaged_meshes makes 2,000 of each kind."""
    assert count_wrong(each=60, seed=2) == 0, capsys.readouterr().out
