"""Every element of Collada that carries or moves a surface: read, or refused by name.

Beside a plain far cube a near one is given in each way that the standard knows. A
reader that passes over it says clear where the arm stands in the near cube.
"""

import numpy as np
import pytest

import borecheck as bc
from borecheck.errors import MeshError
from borecheck.geometry.mesh_files.collada import collada_conventions, parse_collada
from borecheck.geometry.mesh_files.reading import read_mesh, read_mesh_file
from tests.geometry.mesh_files.collada_text import (
    ACCESSOR,
    ASSET,
    FACES,
    FAR,
    NAMESPACE,
    NEAR,
    QUADS,
    TRIANGLES,
    cube,
    cube_points,
    document,
    source,
)
from tests.places import DATA

CASES = DATA / "cases"
VERTEX = '<input semantic="VERTEX" source="#{id}-v" offset="0"/>'
INSTANCE = '<instance_geometry url="#near"/>'
SKIN = (
    '<library_controllers><controller id="c"><skin source="#near"/></controller>'
    "</library_controllers>"
)


def shape(primitives: str) -> bytes:
    """The near cube made of these primitives."""
    return document(f"<node>{INSTANCE}</node>", cube("near", NEAR, primitives))


def moved(moves: str, inner: str = INSTANCE) -> bytes:
    """A cube about the origin that these moves bring near."""
    return document(f"<node>{moves}{inner}</node>", cube("near"))


def near_with(accessor: str, words: str) -> bytes:
    """The near cube through another accessor and other numbers."""
    given = source("near", NEAR, accessor)
    start, end = given.index(">", given.index("float_array")), given.index("</float_a")
    numbers = f' id="near-a" count="{len(words.split())}">{words}'
    given = (
        given[: given.index("<float_array") + len("<float_array")]
        + numbers
        + given[end:]
    )
    assert start < end
    inner = given + TRIANGLES.format(id="near")
    geometry = f'<geometry id="near"><mesh>{inner}</mesh></geometry>'
    return document(f"<node>{INSTANCE}</node>", geometry)


def strip_of(face: str) -> str:
    a, b, c, d = face.split()
    return f"<p>{a} {b} {d} {c}</p>"


def half(first: int) -> str:
    words = " ".join(FACES.split()[first : first + 18])
    return f'<triangles count="6">{VERTEX}<p>{words}</p></triangles>'


def faces() -> list[str]:
    words = QUADS.split()
    return [" ".join(words[k : k + 4]) for k in range(0, 24, 4)]


WIDE = " ".join(f"9 {x!r} {y!r} 9 {z!r}" for x, y, z in cube_points(NEAR))
SKIPPED = (
    '<accessor source="#{id}-a" count="8" stride="5" offset="1">'
    '<param name="X" type="float"/><param name="Y" type="float"/>'
    '<param type="float"/><param name="Z" type="float"/></accessor>'
)
QUARTER = "<rotate>0 0 1 90</rotate>"
READ = {
    "triangles": shape(TRIANGLES),
    "polylist": shape(
        f'<polylist count="6">{VERTEX}<vcount>4 4 4 4 4 4</vcount><p>{QUADS}</p>'
        "</polylist>"
    ),
    "polygons": shape(
        f'<polygons count="6">{VERTEX}'
        + "".join(f"<p>{face}</p>" for face in faces())
        + "</polygons>"
    ),
    "trifans": shape(
        f'<trifans count="6">{VERTEX}'
        + "".join(f"<p>{face}</p>" for face in faces())
        + "</trifans>"
    ),
    "tristrips": shape(
        f'<tristrips count="6">{VERTEX}'
        + "".join(strip_of(face) for face in faces())
        + "</tristrips>"
    ),
    "two_primitives": shape(half(0) + half(18)),
    "lines_beside": shape(
        TRIANGLES + f'<lines count="1">{VERTEX}<p>0 1</p></lines>'
        f'<linestrips count="1">{VERTEX}<p>0 1</p></linestrips>'
    ),
    "input_offset": shape(
        '<triangles count="12"><input semantic="NORMAL" source="#none" offset="0"/>'
        '<input semantic="VERTEX" source="#{id}-v" offset="1"/><p>'
        + " ".join(f"0 {k}" for k in FACES.split())
        + "</p></triangles>"
    ),
    "accessor": near_with(SKIPPED, WIDE),
    "translate": moved("<translate>0.4 0 0</translate>"),
    "matrix": moved("<matrix>1 0 0 0.4 0 1 0 0 0 0 1 0 0 0 0 1</matrix>"),
    "rotate_then_translate": moved(f"{QUARTER}<translate>0 -0.4 0</translate>"),
    "translate_then_rotate": moved(f"<translate>0.4 0 0</translate>{QUARTER}"),
    "scale_then_translate": moved(
        "<scale>2 2 2</scale><translate>0.2 0 0</translate><scale>.5 .5 .5</scale>"
    ),
    "mirror": moved("<scale>-1 1 1</scale><translate>-0.4 0 0</translate>"),
    "nested_nodes": moved(
        "<translate>0.2 0 0</translate>",
        f"<node><translate>0.2 0 0</translate>{INSTANCE}</node>",
    ),
    "instance_node": document(
        '<node><translate>0.4 0 0</translate><instance_node url="#kept"/></node>',
        cube("near"),
        f'<library_nodes><node><node id="kept">{INSTANCE}</node></node>'
        "</library_nodes>",
    ),
    "twice": moved(
        "",
        f"<node><translate>7 0 0</translate>{INSTANCE}</node>"
        f"<node><translate>0.4 0 0</translate>{INSTANCE}</node>",
    ),
    "camera": moved(
        '<translate>0.4 0 0</translate><instance_camera url="#none"/>'
        '<instance_light url="#none"/><node><lookat>0 0 0 1 0 0 0 0 1</lookat></node>'
    ),
    "comment": shape(TRIANGLES.replace("<p>", "<p><!-- 7 7 7 -->")),
}
REFUSED = {
    "ph": shape(
        f'<polygons count="1">{VERTEX}<ph><p>0 1 3 2</p><h>0 1 3</h></ph></polygons>'
    ),
    "instance_controller": document(
        '<node><instance_controller url="#c"/></node>', cube("near", NEAR), SKIN
    ),
    "morph": document(
        '<node><instance_controller url="#c"/></node>',
        cube("near", NEAR),
        SKIN.replace("skin", "morph"),
    ),
    "lookat": moved("<lookat>0.4 0 0 1 0 0 0 0 1</lookat>"),
    "skew": moved("<skew>45 0 1 0 1 0 0</skew><translate>0.4 0 0</translate>"),
    "lookat above": moved(
        "<lookat>0.4 0 0 1 0 0 0 0 1</lookat>", f"<node>{INSTANCE}</node>"
    ),
    "last row": moved("<matrix>1 0 0 0 0 1 0 0 0 0 1 0 0.4 0 0 1</matrix>"),
    "no axis": moved("<rotate>0 0 0 90</rotate><translate>0.4 0 0</translate>"),
    "convex_mesh": document(
        f"<node>{INSTANCE}</node>",
        '<geometry id="near"><convex_mesh convex_hull_of="#hull"/></geometry>'
        + cube("hull", NEAR),
    ),
    "spline": document(
        f"<node>{INSTANCE}</node>", '<geometry id="near"><spline/></geometry>'
    ),
    "brep": document(
        f"<node>{INSTANCE}</node>", '<geometry id="near"><brep/></geometry>'
    ),
    "patches": shape(f'<patches count="1">{VERTEX}<p>0 1 3</p></patches>'),
    "instance_physics_scene": document(
        "",
        cube("near", NEAR),
        '<library_physics_scenes><physics_scene id="f"/></library_physics_scenes>',
        '<instance_visual_scene url="#s"/><instance_physics_scene url="#f"/>',
    ),
    "instance_kinematics_scene": document(
        scene='<instance_visual_scene url="#s"/><instance_kinematics_scene url="#k"/>'
    ),
    "visual_scene": document(
        "",
        cube("near", NEAR),
        '<library_visual_scenes><visual_scene id="other"><node>'
        f"{INSTANCE}</node></visual_scene></library_visual_scenes>",
    ),
    "no <scene>": document(scene=""),
    "shows no <visual_scene>": document(scene="<extra/>"),
    "other.dae": document('<node><instance_geometry url="other.dae#near"/></node>'),
    "#none": document('<node><instance_geometry url="#none"/></node>'),
    "#lost": document('<node><instance_node url="#lost"/></node>'),
    "2 of that id": document(
        f"<node>{INSTANCE}</node>", cube("near", FAR) + cube("near", NEAR)
    ),
    "holds itself": document('<node id="ring"><instance_node url="#ring"/></node>'),
    "instance_geometry> within <extra": document(
        '<node><extra><technique profile="X"><instance_geometry url="#near"/>'
        "</technique></extra></node>",
        cube("near", NEAR),
    ),
    "translate> within <extra": moved(
        '<extra><technique profile="X"><translate>0.4 0 0</translate></technique>'
        "</extra>"
    ),
    "polylist> within <extra": document(
        "",
        '<geometry id="x"><mesh><extra><technique profile="X"><polylist/></technique>'
        "</extra></mesh></geometry>",
    ),
    "channel": document(
        f'<node id="near-node"><translate sid="t">9 0 0</translate>{INSTANCE}</node>',
        cube("near"),
        '<library_animations><animation><channel source="#m" target="near-node/t.X"/>'
        "</animation></library_animations>",
    ),
    "not there": document(
        more='<library_animations><animation><channel source="#m" target="x/t"/>'
        "</animation></library_animations>"
    ),
    "foreign:instance_geometry": document(
        '<node><f:instance_geometry xmlns:f="foreign" url="#near"/></node>',
        cube("near", NEAR),
    ),
    "states another unit": document(
        '<node><asset><unit meter="0.01"/></asset><translate>40 0 0</translate>'
        f"{INSTANCE}</node>",
        cube("near"),
    ),
    "another up axis": document(
        f"<node><asset><up_axis>Y_UP</up_axis></asset>{INSTANCE}</node>", cube("near")
    ),
    "second <asset>": document(asset=ASSET + ASSET.replace('"1"', '"0.01"')),
    "says 12 and holds 11": shape(TRIANGLES.replace(" 1 7 3</p>", "</p>")),
    "vertex that is none": shape(TRIANGLES.replace("1 7 3</p>", "1 7 8</p>")),
    "whole numbers": shape(TRIANGLES.replace("1 7 3</p>", "1 7 3.0</p>")),
    "not X, Y, Z": near_with(ACCESSOR.replace('"X"', '"Q"'), " ".join(["0"] * 24)),
    "beyond the end": near_with(SKIPPED.replace('"8"', '"9"'), WIDE),
    "list of numbers": near_with(ACCESSOR, "0,4 " * 24),
}


def has_near_cube(data: bytes) -> bool:
    raw = parse_collada(data, "test.dae")
    corners = raw.vertices[raw.triangles].reshape(-1, 3)
    near = corners[corners[:, 0] < 1.0]
    assert len(raw.triangles) >= 24
    distances = np.linalg.norm(near[:, None] - cube_points(NEAR), axis=2)
    return bool((distances.min(axis=0) < 1e-12).all())


@pytest.mark.parametrize("element", READ)
def test_a_surface_is_where_the_file_puts_it(element: str) -> None:
    assert has_near_cube(READ[element])


@pytest.mark.parametrize("element", REFUSED)
def test_what_is_not_read_is_refused_by_its_name(element: str) -> None:
    with pytest.raises(MeshError) as caught:
        parse_collada(REFUSED[element], "test.dae")
    assert element.split(" above")[0] in str(caught.value)
    assert "\n" not in str(caught.value)


def test_the_far_cube_alone_is_read() -> None:
    """So that a refusal above is not one of the document around it."""
    raw = parse_collada(document(), "test.dae")
    assert len(raw.triangles) == 12
    assert raw.vertices[:, 0].min() > 2.0
    assert raw.warnings == ()


# assimp knows no accessor with columns to skip, no node that a library's node holds,
# and asks after normals that nobody uses.
NOT_BY_ASSIMP = {"accessor", "instance_node", "input_offset"}


@pytest.mark.parametrize("element", sorted(set(READ) - NOT_BY_ASSIMP))
def test_assimp_places_the_same_points(element, tmp_path) -> None:
    """Another reader, through Coal (whose triangles of nested nodes are mixed up)."""
    import coal

    path = tmp_path / "scene.dae"
    path.write_bytes(READ[element])
    mine = read_mesh(path)
    theirs = coal.MeshLoader().load(str(path), np.ones(3))
    assert theirs.num_tris == len(mine.triangles)
    points = np.array(theirs.vertices())
    apart = np.linalg.norm(mine.vertices[:, None] - points, axis=2)
    assert apart.min(axis=0).max() < 1e-6  # assimp holds float32
    assert apart.min(axis=1).max() < 1e-6


def test_an_arm_in_the_near_cube_is_never_clear(tmp_path):
    """The whole way: file, scene, verdict."""
    arm = bc.load_robot(CASES / "dae_scenes" / "arm.urdf")
    path = tmp_path / "scene.dae"
    for element in ("polygons", "instance_node"):
        path.write_bytes(READ[element])
        assert bc.check(arm, bc.load_scene(f"{path}:m"), [0.0]).verdict == "contact"
    path.write_bytes(document())
    assert bc.check(arm, bc.load_scene(f"{path}:m"), [0.0]).verdict == "clear"


def test_a_mirrored_instance_keeps_its_outside_outside():
    raw = parse_collada(READ["mirror"], "test.dae")
    corners = raw.vertices[raw.triangles]
    volume = np.einsum(
        "ij,ij->i", corners[:, 0], np.cross(corners[:, 1], corners[:, 2])
    )
    plain = parse_collada(READ["translate"], "test.dae")
    given = plain.vertices[plain.triangles]
    expected = np.einsum("ij,ij->i", given[:, 0], np.cross(given[:, 1], given[:, 2]))
    assert volume.sum() == pytest.approx(expected.sum(), rel=1e-12)


def test_numbers_keep_every_digit():
    """float64, as of every other format."""
    digits = "0.1234567890123456"
    data = near_with(ACCESSOR, " ".join([digits] * 24))
    raw = parse_collada(data, "test.dae")
    assert raw.vertices.min() == pytest.approx(-0.1)
    assert float(digits) in raw.vertices


@pytest.mark.parametrize(
    ("asset", "unit", "axis"),
    [
        (ASSET, 1.0, "Z_UP"),
        (ASSET.replace("<unit", '<!-- <unit meter="0.001"/> --><unit'), 1.0, "Z_UP"),
        (
            '<f:asset xmlns:f="foreign"><f:unit meter="0.001"/></f:asset>'.join(
                ["", ""]
            )
            + ASSET.replace("<unit", '<f:unit xmlns:f="foreign" meter="9"/><unit'),
            1.0,
            "Z_UP",
        ),
        (ASSET.replace('"1"', '"0.0254"').replace("Z_UP", " X_UP "), 0.0254, "X_UP"),
        ("<asset/>", 1.0, "Y_UP"),
        ("", 1.0, "Y_UP"),
    ],
)
def test_unit_and_up_axis_are_those_of_the_documents_own_asset(asset, unit, axis):
    assert collada_conventions(document(asset=asset), "f") == (unit, axis)


def test_the_asset_may_come_last():
    data = document(asset="").replace(b"</COLLADA>", ASSET.encode() + b"</COLLADA>")
    assert collada_conventions(data, "f") == (1.0, "Z_UP")


@pytest.mark.parametrize(
    ("given", "told"),
    [
        (('meter="1"', 'meter="-1"'), "positive"),
        (('meter="1"', 'meter="nan"'), "positive"),
        (('name="meter" meter="1"', 'name="inch"'), "names a unit"),
        (("Z_UP", "W_UP"), "none of X_UP"),
        (("Z_UP</up_axis>", "Z_UP</up_axis><up_axis>Y_UP</up_axis>"), "second"),
    ],
)
def test_a_unit_or_an_axis_that_is_none_is_refused(given, told):
    with pytest.raises(MeshError, match=told):
        parse_collada(document(asset=ASSET.replace(*given)), "f")


ENTITIES = '<!DOCTYPE x [<!ENTITY a "aaaa"><!ENTITY b "&a;&a;">]>'


@pytest.mark.parametrize("encoding", ["utf-8", "utf-16", "utf-16-le", "utf-16-be"])
def test_entities_are_refused_in_every_encoding(encoding):
    text = document().decode().replace('encoding="utf-8"?>', f"?>{ENTITIES}")
    with pytest.raises(MeshError, match="entities"):
        parse_collada(text.encode(encoding), "f")


def test_an_encoding_in_which_a_doctype_could_hide_is_refused():
    for name in ("utf-7", "cp037"):
        data = document().replace(b"utf-8", name.encode(), 1)
        with pytest.raises(MeshError, match="save it as UTF-8"):
            parse_collada(data, "f")
    text = document().decode().replace("utf-8", "utf-16", 1)
    assert len(parse_collada(text.encode("utf-16"), "f").triangles) == 12


def test_what_stands_around_the_xml_is_left_out_with_a_warning():
    plain = document()
    for before, after, told in (
        (b"\r\n  ", b"", "white space"),
        (b"", b"\0\0\0", "3 zero bytes"),
        (b"\xef\xbb\xbf\n", b"\n", "white space"),
    ):
        raw = parse_collada(before + plain + after, "f")
        assert len(raw.triangles) == 12
        assert any(told in warning for warning in raw.warnings)
    assert parse_collada(b"\xef\xbb\xbf" + plain, "f").warnings == ()


def test_a_surface_in_no_node_is_told():
    raw = parse_collada(document("", cube("near", NEAR)), "f")
    assert "'near'" in raw.warnings[0]


def test_copies_of_copies_end():
    """Sixty nodes that each hold the next one twice would be 2^60 cubes."""
    nodes = "".join(
        f'<node id="n{k}"><instance_node url="#n{k + 1}"/>'
        f'<instance_node url="#n{k + 1}"/></node>'
        for k in range(60)
    )
    kept = f'<library_nodes>{nodes}<node id="n60">{INSTANCE}</node></library_nodes>'
    data = document('<node><instance_node url="#n0"/></node>', cube("near"), kept)
    with pytest.raises(MeshError, match="more nodes"):
        parse_collada(data, "f")
    with pytest.raises(MeshError, match=r"deep|cannot be read"):
        parse_collada(document("<node>" * 5000 + "</node>" * 5000), "f")


def test_the_text_of_an_array_may_be_long():
    """libxml2 stops at 10 MB unless it is told otherwise; real robots have more."""
    points = " ".join([f"0.5{'0' * 60} 0.25 0.125"] * 140_000)
    words = ACCESSOR.replace('"8"', '"140000"')
    raw = parse_collada(near_with(words, points), "f")
    assert len(points) > 10_000_000
    assert len(raw.triangles) == 24


def test_version_1_5_is_read_alike():
    data = document().replace(
        NAMESPACE.encode(), b"http://www.collada.org/2008/03/COLLADASchema"
    )
    assert len(parse_collada(data, "f").triangles) == 12
    with pytest.raises(MeshError, match="the root is"):
        parse_collada(document().replace(NAMESPACE.encode(), b"other"), "f")


def test_the_frame_of_a_file_is_told_and_not_applied(tmp_path):
    path = tmp_path / "up.dae"
    path.write_bytes(document(asset=ASSET.replace("Z_UP", "Y_UP")))
    found = read_mesh_file(path)
    assert (found.frame, found.frame_is_implied, found.unit_m) == ("y-up", False, 1.0)
    assert found.mesh.bounds[0, 0] == pytest.approx(FAR - 0.1)
    assert "Y_UP" in found.remarks[0]
    path.write_bytes(document(asset="<asset/>"))
    found = read_mesh_file(path)
    assert (found.frame, found.frame_is_implied, found.unit_m) == ("y-up", True, None)
