import os
import struct
import subprocess
import sys
import tracemalloc
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from borecheck.errors import MeshError, UsageError
from borecheck.geometry.mesh.triangle_mesh import TriangleMesh
from borecheck.geometry.mesh_files.collada import collada_conventions
from borecheck.geometry.mesh_files.obj import parse_obj
from borecheck.geometry.mesh_files.ply import parse_ply
from borecheck.geometry.mesh_files.reading import (
    guess_unit,
    read_mesh,
    read_mesh_in_unit,
    unit_mistake,
    write_stl,
    zero_area_triangles,
)
from borecheck.geometry.mesh_files.stl import parse_stl
from tests.places import DATA

MESHES = DATA / "meshes"
GOOD = sorted(path for path in (MESHES / "good").iterdir())
BAD = sorted(path for path in (MESHES / "bad").iterdir() if path.suffix != ".txt")
LIGHT = [path for path in GOOD if path.suffix != ".dae"]
PARSERS = {".stl": parse_stl, ".obj": parse_obj, ".ply": parse_ply}

POINTS = np.array([[0, 0, 0], [0.5, 0, 0], [0, 0.25, 0], [0, 0, 1.5]])
TETRAHEDRON = POINTS[np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])]


def random_mesh(seed: int, n: int = 200) -> TriangleMesh:
    rng = np.random.default_rng(seed)
    return TriangleMesh("m", rng.normal(size=(60, 3)), rng.integers(0, 60, (n, 3)))


@pytest.mark.parametrize("path", GOOD, ids=lambda path: path.name)
def test_every_form_gives_the_same_triangles_in_the_same_order(path: Path) -> None:
    mesh = read_mesh(path)
    np.testing.assert_array_equal(mesh.corners, TETRAHEDRON)
    assert mesh.is_closed
    assert mesh.name == path.stem


@pytest.mark.parametrize("path", BAD, ids=lambda path: path.name)
def test_every_defect_is_told_in_its_line(path: Path) -> None:
    expected = path.with_name(path.name + ".error.txt").read_text().strip()
    with pytest.raises(MeshError) as caught:
        read_mesh(path)
    told = str(caught.value).replace(str(path), path.name)
    assert "\n" not in told
    if expected.endswith("..."):
        assert told.startswith(expected.removesuffix("..."))
    else:
        assert told == expected


def test_there_are_files_to_judge() -> None:
    assert len(GOOD) >= 13
    assert len(BAD) >= 50


def test_no_file_directory_pipe_and_no_permission(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with pytest.raises(MeshError, match="no such file"):
        read_mesh(tmp_path / "none.stl")
    with pytest.raises(MeshError, match="is a directory"):
        read_mesh(tmp_path)
    os.mkfifo(tmp_path / "pipe.stl")
    with pytest.raises(MeshError, match="not a regular file"):
        read_mesh(tmp_path / "pipe.stl")
    with pytest.raises(MeshError, match="cannot be read"):
        read_mesh(tmp_path / "nul\0.stl")

    def refuse(_: Path) -> bytes:
        raise PermissionError  # chmod does not stop a test that runs as root

    monkeypatch.setattr(Path, "read_bytes", refuse)
    with pytest.raises(MeshError, match="no permission"):
        read_mesh(GOOD[1])


def test_scale_and_unit() -> None:
    path = MESHES / "good" / "binary.stl"
    in_mm = read_mesh_in_unit(path, "mm")
    np.testing.assert_array_equal(in_mm.corners, TETRAHEDRON * 1e-3)
    np.testing.assert_array_equal(read_mesh_in_unit(path).corners, TETRAHEDRON)
    with pytest.raises(UsageError, match="parsec"):
        read_mesh_in_unit(path, "parsec")
    for scale in (0.0, -1.0, float("nan"), float("inf")):
        with pytest.raises(UsageError, match="positive"):
            read_mesh(path, scale)
    with pytest.raises(MeshError, match="beyond every room"):
        read_mesh(path, 1e300)


def test_collada_without_its_textures(tmp_path: Path) -> None:
    """A broken picture changes no shape; a broken geometry is an error."""
    text = (MESHES / "good" / "centimetres.dae").read_text()
    image = '<library_images><image id="i"><init_from>QQQ</init_from></image>'
    effect = (
        '</library_images><library_effects><effect id="e"><profile_COMMON>'
        '<newparam sid="s"><sampler2D><source>QQQ</source></sampler2D></newparam>'
        "</profile_COMMON></effect></library_effects><library_geometries>"
    )
    path = tmp_path / "textured.dae"
    path.write_text(text.replace("<library_geometries>", image + effect))
    np.testing.assert_array_equal(read_mesh(path).corners, TETRAHEDRON)
    path.write_text(text.replace('url="#g"', 'url="#QQQ"'))
    with pytest.raises(MeshError, match="QQQ"):
        read_mesh(path)


def test_collada_states_its_unit_and_up_axis() -> None:
    data = (MESHES / "good" / "centimetres.dae").read_bytes()
    assert collada_conventions(data, "f") == (0.01, "Z_UP")
    assert collada_conventions(b"<COLLADA/>", "f") == (1.0, "Y_UP")


def test_unit_is_told_from_size_with_a_warning() -> None:
    corners = TETRAHEDRON.reshape(-1, 3)
    order = np.arange(12).reshape(-1, 3)
    metres = TriangleMesh("torso", corners, order)
    millimetres = TriangleMesh("torso", corners * 1e3, order)
    centimetres = TriangleMesh("torso", corners * 10, order)
    assert guess_unit(metres, reference_size_m=2.0) == ("m", None)
    unit, warning = guess_unit(millimetres, reference_size_m=2.0)
    assert unit == "mm"
    assert warning is not None
    assert "500 x 250 x 1500" in warning
    with pytest.raises(MeshError, match="say the unit"):
        guess_unit(centimetres, reference_size_m=2.0)


def test_a_thousandfold_mistake_is_noticed_both_ways() -> None:
    corners = TETRAHEDRON.reshape(-1, 3)
    order = np.arange(12).reshape(-1, 3)
    told = [
        unit_mistake(TriangleMesh("t", corners * scale, order), reference_size_m=2.0)
        for scale in (1e-3, 1e-1, 1.0, 10.0, 1e3)
    ]
    assert [message is not None for message in told] == [
        True,
        False,
        False,
        False,
        True,
    ]
    assert "1000 times too small" in str(told[0])
    assert "1000 times too large" in str(told[-1])


def test_zero_area_triangles_are_kept_and_listed(tmp_path: Path) -> None:
    path = tmp_path / "needle.obj"
    path.write_text("v 0 0 0\nv 1 0 0\nv 2 0 0\nv 0 1 0\nf 1 2 3\nf 1 2 4\nf 1 1 4\n")
    mesh = read_mesh(path)
    assert len(mesh.triangles) == 3
    assert zero_area_triangles(mesh).tolist() == [0, 2]


def test_polygons_become_fans_in_file_order(tmp_path: Path) -> None:
    path = tmp_path / "house.obj"
    points = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv .5 2 0\nv 0 1 0\n"
    path.write_text(points + "f 1 2 3 4 5\nf 1 2 3\nf 1 2 3 5\n")
    expected = [[0, 1, 2], [0, 2, 3], [0, 3, 4], [0, 1, 2], [0, 1, 2], [0, 2, 4]]
    assert read_mesh(path).triangles.tolist() == expected


def test_text_keeps_every_digit_and_binary_every_float32(tmp_path: Path) -> None:
    mesh = random_mesh(1)
    lines = [f"v {x!r} {y!r} {z!r}" for x, y, z in mesh.vertices.tolist()]
    lines += [f"f {a + 1} {b + 1} {c + 1}" for a, b, c in mesh.triangles.tolist()]
    (tmp_path / "m.obj").write_text("\n".join(lines) + "\n")
    assert read_mesh(tmp_path / "m.obj").sha256 == mesh.sha256
    write_stl(tmp_path / "m.stl", mesh)
    expected = mesh.corners.astype(np.float32).astype(np.float64)
    np.testing.assert_array_equal(read_mesh(tmp_path / "m.stl").corners, expected)


def test_trimesh_reads_the_same(tmp_path: Path) -> None:
    """Another library on the files that it writes itself."""
    import trimesh

    given = random_mesh(2)
    other = trimesh.Trimesh(given.vertices, given.triangles, process=False)
    for kind, suffix in (
        ("stl", "stl"),
        ("stl_ascii", "stl"),
        ("ply", "ply"),
        ("obj", "obj"),
    ):
        path = tmp_path / f"{kind}.{suffix}"
        other.export(path, file_type=kind)
        theirs = trimesh.load_mesh(path, process=False)
        mine = read_mesh(path)
        assert len(mine.triangles) == len(given.triangles)
        np.testing.assert_array_equal(mine.corners, theirs.triangles, err_msg=kind)


def test_written_stl_is_whole_or_not_there(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "m.stl"
    write_stl(path, random_mesh(3))
    before = path.read_bytes()

    def fail(_self: Path, _target: Path) -> Path:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(Path, "replace", fail)
    with pytest.raises(MeshError, match="No space left"):
        write_stl(path, random_mesh(4))
    assert path.read_bytes() == before
    assert [entry.name for entry in tmp_path.iterdir()] == ["m.stl"]
    with pytest.raises(MeshError, match="cannot be written"):
        write_stl(tmp_path / "none" / "m.stl", random_mesh(4))
    far = TriangleMesh("far", np.full((3, 3), 1e300), [[0, 1, 2]])
    with pytest.raises(MeshError, match="float32"):
        write_stl(tmp_path / "far.stl", far)


def test_reading_does_not_import_trimesh() -> None:
    """`check` starts with it; trimesh alone would cost 1.6 s."""
    code = (
        "import sys; from pathlib import Path; "
        "from borecheck.geometry.mesh_files.reading import read_mesh; "
        "[read_mesh(Path(p)) for p in sys.argv[1:]]; "
        "assert not {'trimesh', 'scipy', 'numba', 'coal'} & set(sys.modules)"
    )
    command = [sys.executable, "-c", code, *map(str, LIGHT)]
    assert subprocess.run(command, check=False).returncode == 0


def test_a_lying_header_allocates_nothing() -> None:
    """4 billion elements promised in a file of a few hundred bytes."""
    names = [path for path in BAD if path.name.startswith("four_billion")]
    assert len(names) == 3
    for path in names:
        data = path.read_bytes()
        tracemalloc.start()
        with pytest.raises(MeshError):
            PARSERS[path.suffix](data, path)
        peak = tracemalloc.get_traced_memory()[1]
        tracemalloc.stop()
        assert peak < 1_000_000


def check_only_mesh_errors(data: bytes, path: Path, tmp_path: Path) -> bool:
    """Whether damaged bytes are refused; whatever is accepted is a usable mesh."""
    target = tmp_path / f"fuzzed{path.suffix}"
    target.write_bytes(data)
    try:
        mesh = read_mesh(target)
    except MeshError as error:
        line = str(error)
    else:
        assert np.isfinite(mesh.corners).all()
        return False
    assert line.isprintable()
    return True


def parse_is_closed(data: bytes, path: Path) -> bool:
    raw = parse_obj(data, path)
    return TriangleMesh("cut", raw.vertices, raw.triangles).is_closed


@pytest.mark.parametrize("path", LIGHT, ids=lambda path: path.name)
def test_cut_short_anywhere(path: Path, tmp_path: Path) -> None:
    whole = path.read_bytes()
    accepted = []
    for length in range(len(whole)):
        if not check_only_mesh_errors(whole[:length], path, tmp_path):
            accepted.append(whole[:length])
    for data in accepted:  # only where no reader could know that more was to come
        if path.suffix == ".obj":  # no end mark: any whole line may be the last
            whole_line = data.endswith((b"\n", b"\r"))
            assert whole_line or parse_is_closed(data, path)
        elif path.suffix == ".stl":  # within the name of a solid, or between solids
            assert b"endsolid" in data.lower()
        else:
            raise AssertionError(data)


@pytest.mark.parametrize("path", LIGHT, ids=lambda path: path.name)
def test_damaged_bytes(path: Path, tmp_path: Path) -> None:
    rng = np.random.default_rng(len(path.name))
    whole = np.frombuffer(path.read_bytes(), dtype=np.uint8)
    refused = 0
    for _ in range(300):
        data = whole.copy()
        places = rng.integers(0, len(data), rng.integers(1, 6))
        data[places] = rng.integers(0, 256, len(places))
        if rng.random() < 0.3:
            data = np.roll(data, int(rng.integers(1, len(data))))
        refused += check_only_mesh_errors(data.tobytes(), path, tmp_path)
    assert refused > 30  # most damage hits coordinates and stays a mesh


def test_damaged_collada(tmp_path: Path) -> None:
    path = MESHES / "good" / "centimetres.dae"
    rng = np.random.default_rng(5)
    whole = np.frombuffer(path.read_bytes(), dtype=np.uint8)
    refused = 0
    for _ in range(150):
        data = whole.copy()
        places = rng.integers(0, len(data), 2)
        data[places] = rng.integers(32, 127, len(places))
        refused += check_only_mesh_errors(data.tobytes(), path, tmp_path)
    assert refused > 30


@settings(max_examples=300, deadline=None)
@given(st.binary(max_size=400), st.sampled_from([".stl", ".obj", ".ply"]))
def test_any_bytes(data: bytes, suffix: str) -> None:
    head = {".stl": b"solid x\nfacet normal ", ".obj": b"v 0 0 0\n", ".ply": b"ply\n"}
    for text in (data, head[suffix] + data):
        try:
            raw = PARSERS[suffix](text, "fuzzed")
        except MeshError:
            continue
        assert raw.vertices.shape[1] == 3


def test_signalling_nan_is_refused_without_a_warning(tmp_path: Path) -> None:
    data = bytearray((MESHES / "good" / "binary.stl").read_bytes())
    data[84 + 12 : 84 + 16] = struct.pack("<I", 0x7F800001)
    (tmp_path / "nan.stl").write_bytes(bytes(data))
    with pytest.raises(MeshError, match=r"triangle 0.*not finite"):
        read_mesh(tmp_path / "nan.stl")
