"""A frame or an up axis that a file states is heard, acknowledged or in doubt."""

import numpy as np
import pytest

import borecheck as bc
from borecheck.core.patient_frame import POSITIONS, scanner_from_patient
from borecheck.errors import MeshError, UsageError
from borecheck.geometry.mesh.primitives import box
from borecheck.geometry.mesh_files.frames import FRAMES, is_frame, rotation, stated_in
from borecheck.geometry.mesh_files.reading import (
    read_mesh_file,
    stated_frame,
    write_stl,
)
from borecheck.robots.file_text import split_file_text
from tests.geometry.mesh_files.collada_text import ASSET, document
from tests.places import DATA

CASES = DATA / "cases"
ROBOT = CASES / "dae_scenes" / "arm.urdf"
TORSO = CASES / "stl_slicer_space_lps" / "torso.stl"
POST = CASES / "dae_y_up" / "post.dae"
CORNERS = np.array([[1.0, 2.0, 3.0], [1.5, 2.0, 3.0], [1.0, 2.5, 3.0], [1.0, 2.0, 3.7]])
FACES = [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]]


@pytest.fixture(scope="module")
def arm():
    return bc.load_robot(ROBOT)


def text_stl(name, before=""):
    facets = "".join(
        "facet normal 0 0 0\nouter loop\n"
        + "".join("vertex {} {} {}\n".format(*CORNERS[k]) for k in face)
        + "endloop\nendfacet\n"
        for face in FACES
    )
    return f"{before}solid {name}\n{facets}endsolid {name}\n".encode()


def binary_stl(header):
    record = np.dtype([("n", "<f4", 3), ("c", "<f4", (3, 3)), ("x", "<u2")])
    rows = np.zeros(4, record)
    rows["c"] = CORNERS[FACES]
    return header.encode().ljust(80) + np.uint32(4).tobytes() + rows.tobytes()


def obj(comment):
    lines = ["v {} {} {}".format(*p) for p in CORNERS]
    lines += ["f {} {} {}".format(*(k + 1 for k in face)) for face in FACES]
    return "\n".join([*lines[:4], comment, *lines[4:], ""]).encode()


def ply(comment):
    head = f"ply\nformat ascii 1.0\n{comment}\nelement vertex 4\n"
    head += "property float x\nproperty float y\nproperty float z\n"
    head += "element face 4\nproperty list uchar int vertex_indices\nend_header\n"
    rows = ["{} {} {}".format(*p) for p in CORNERS]
    rows += ["3 {} {} {}".format(*face) for face in FACES]
    return (head + "\n".join(rows) + "\n").encode()


STATEMENTS = {
    "binary.stl": (binary_stl("3D Slicer output. SPACE=LPS"), "lps"),
    "binary_ras.stl": (binary_stl("3D Slicer output. SPACE=RAS"), "ras"),
    "plain.stl": (binary_stl("made somewhere in open space"), None),
    "colour.stl": (binary_stl("color space = sRGB"), None),
    "text.stl": (text_stl("3D Slicer output. SPACE=LPS"), "lps"),
    "comment.stl": (text_stl("part", "# SPACE=RAS\n"), "ras"),
    "silent.stl": (text_stl("part"), None),
    "slicer.obj": (obj("# 3D Slicer output. SPACE=LPS"), "lps"),
    "spelt.obj": (obj("# space: left-posterior-superior"), "lps"),
    "system.obj": (obj("# Coordinate system: RAS"), "ras"),
    "silent.obj": (obj("# Blender"), None),
    "slicer.ply": (ply("comment SPACE=RAS"), "ras"),
    "info.ply": (ply("obj_info 3D Slicer output. SPACE=LPS"), "lps"),
    "odd.ply": (ply("comment SPACE=LAS"), "las"),
    "y.dae": (document(asset=ASSET.replace("Z_UP", "Y_UP")), "y-up"),
    "x.dae": (document(asset=ASSET.replace("Z_UP", "X_UP")), "x-up"),
    "z.dae": (document(), "z-up"),
    "unsaid.dae": (document(asset=""), "y-up"),
}


@pytest.mark.parametrize("name", STATEMENTS)
def test_what_a_file_states_is_told_and_not_applied(name, tmp_path):
    data, frame = STATEMENTS[name]
    path = tmp_path / name
    path.write_bytes(data)
    assert stated_frame(path) == frame
    if path.suffix != ".dae":
        found = read_mesh_file(path).mesh.corners
        assert found == pytest.approx(CORNERS[FACES], abs=1e-6)


def test_two_frames_in_one_file_are_refused(tmp_path):
    path = tmp_path / "both.stl"
    path.write_bytes(text_stl("SPACE=LPS", "# SPACE=RAS\n"))
    with pytest.raises(MeshError, match="two frames, LPS and RAS"):
        read_mesh_file(path)
    assert stated_in([b"SPACE=LPS", b"space = lps"], "f") == "lps"


def test_every_frame_is_a_rotation_that_says_where_up_is():
    words = [*FRAMES, *(f"lps-{p.lower()}" for p in POSITIONS)]
    for word in words:
        R = rotation(word)
        assert np.abs(R @ R.T - np.eye(3)).max() < 1e-15
        assert np.linalg.det(R) == pytest.approx(1.0)
    up, right = np.eye(3)[2], np.eye(3)[0]
    for axis in range(3):  # COLLADA 1.4.1, up_axis
        assert rotation(f"{'xyz'[axis]}-up") @ np.eye(3)[axis] == pytest.approx(up)
    assert rotation("y-up") @ [1.0, 0.0, 0.0] == pytest.approx(right)
    assert rotation("x-up") @ [0.0, -1.0, 0.0] == pytest.approx(right)
    for position in POSITIONS:
        expected = scanner_from_patient("RAS", position)
        assert rotation(f"ras-{position.lower()}") == pytest.approx(expected)
    assert rotation("lps") == pytest.approx(scanner_from_patient("LPS", "HFS"))
    assert not any(map(is_frame, ["lps-", "lps-xyz", "up", "w-up", "las", "hfs"]))


def test_y_up_is_a_turn_about_x():
    turned = rotation("y-up") @ [1.0, 2.0, 3.0]
    assert turned == pytest.approx([1.0, -3.0, 2.0])


def test_the_torso_of_slicer(arm):
    """Where its header puts it, the arm is in it; taken as it stands it is beside."""
    unheard = bc.load_scene([], patients=[f"{TORSO}:mm"])
    verdict = bc.check(arm, unheard, [0.0])
    assert verdict.verdict == "unknown"
    assert f"{TORSO} states the frame LPS" in verdict.reason
    assert f"type {TORSO}:mm:lps if that is right" in verdict.reason
    assert any("SPACE" in w or "LPS" in w for w in unheard.warnings)
    heard = bc.load_scene([], patients=[f"{TORSO}:mm:lps"])
    assert heard.doubt is None
    assert bc.check(arm, heard, [0.0]).verdict == "contact"
    posed = bc.load_scene(f"{TORSO}:mm:z-up@0,0,0,-90deg,0,-90deg")  # HFS by hand
    corners = heard.obstacles[0].mesh.corners
    assert corners == pytest.approx(posed.obstacles[0].mesh.corners, abs=1e-12)
    assert "hfs" in "".join(heard.warnings)
    assert "isocentre" in "".join(heard.warnings)


def test_the_frame_turns_first_and_the_pose_places(tmp_path):
    """p_scanner = T_pose R_frame p_file."""
    path = tmp_path / "part.stl"
    path.write_bytes(binary_stl("SPACE=LPS"))
    scene = bc.load_scene([], patients=[f"{path}:m:lps-ffp@0.1,0.2,0.3,0,0,90deg"])
    Rz = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    R = Rz @ scanner_from_patient("LPS", "FFP")
    expected = CORNERS[FACES] @ R.T + [0.1, 0.2, 0.3]
    assert scene.obstacles[0].mesh.corners == pytest.approx(expected, abs=1e-6)


def test_an_up_axis_is_unknown_until_it_is_acknowledged(arm):
    moved = bc.load_robot(ROBOT, base=_at(0.0, -0.3, 0.0))
    unheard = bc.check(moved, bc.load_scene(f"{POST}"), [0.3])
    assert unheard.verdict == "unknown"
    assert "Y_UP" in unheard.reason
    assert f"type {POST}:y-up if" in unheard.reason
    heard = bc.check(moved, bc.load_scene(f"{POST}:y-up"), [0.3])
    assert heard.verdict == "contact"
    as_it_stands = bc.load_scene(f"{POST}:m:z-up")
    assert bc.check(moved, as_it_stands, [0.3]).verdict == "clear"
    assert "as they stand" in as_it_stands.warnings[0]


def _at(x, y, z):
    T = np.eye(4)
    T[:3, 3] = x, y, z
    return T


@pytest.mark.parametrize(
    ("name", "typed", "told"),
    [
        ("binary.stl", "ras", "states LPS, but RAS was typed"),
        ("binary_ras.stl", "lps", "states RAS, but LPS was typed"),
        ("slicer.ply", "lps-ffs", "states RAS"),
        ("binary.stl", "y-up", "states LPS"),
        ("y.dae", "x-up", "states Y_UP"),
        ("z.dae", "y-up", "states Z_UP"),
        ("z.dae", "lps", "states Z_UP"),
        ("odd.ply", "lps", "LAS"),
    ],
)
def test_a_frame_that_contradicts_the_file_is_refused(name, typed, told, tmp_path):
    path = tmp_path / name
    path.write_bytes(STATEMENTS[name][0])
    with pytest.raises(MeshError, match=told):
        bc.load_scene(f"{path}:m:{typed}")


@pytest.mark.parametrize(
    ("name", "typed"),
    [
        ("binary.stl", "lps"),
        ("binary.stl", "lps-hfp"),
        ("slicer.obj", "LPS"),
        ("plain.stl", "ras"),
        ("plain.stl", "y-up"),
        ("y.dae", "y-up"),
        ("x.dae", "x-up"),
        ("unsaid.dae", "z-up"),
        ("unsaid.dae", "x-up"),
        ("z.dae", "z-up"),
    ],
)
def test_a_frame_that_is_acknowledged_or_free_is_no_doubt(name, typed, tmp_path):
    path = tmp_path / name
    path.write_bytes(STATEMENTS[name][0])
    for role in ("obstacles", "patients"):
        assert bc.load_scene([], **{role: [f"{path}:m:{typed}"]}).doubt is None


def test_a_guessed_unit_and_an_unheard_frame_are_one_reason(arm, tmp_path):
    path = tmp_path / "body.stl"
    write_stl(path, box("body", (350.0, 350.0, 350.0)))
    data = bytearray(path.read_bytes())
    data[:80] = b"SPACE=RAS".ljust(80)
    path.write_bytes(bytes(data))
    scene = bc.load_scene(f"{path}@2,0,0")
    reason = bc.check(arm, scene, [0.0]).reason
    assert f"the unit of {path} was guessed (mm) and {path} states" in reason
    assert f"type {path}:mm:ras@2,0,0 if" in reason
    assert bc.load_scene(f"{path}:ras@2,0,0").doubt is not None
    assert bc.load_scene(f"{path}:mm:ras@2,0,0").doubt is None


def test_nothing_is_certified_in_doubt(arm):
    scene = bc.load_scene(f"{POST}:m")
    motion = bc.check_path(arm, scene, [[0.0], [0.05]])
    assert motion.verdict == "unknown"
    assert not motion.certified
    with pytest.raises(UsageError, match="Y_UP"):
        bc.first_contacts(arm, scene, [[0.0]])


def test_the_parts_of_what_is_typed(tmp_path):
    def split(text):
        found = split_file_text(text)
        return str(found.path), found.unit, found.frame, found.pose

    assert split("a.stl") == ("a.stl", None, None, None)
    assert split("a.stl:mm:lps@1,2,3") == ("a.stl", "mm", "lps", "1,2,3")
    assert split("a.stl:Y-UP") == ("a.stl", None, "y-up", None)
    assert split("a.stl:lps-ffdr@0,0,0") == ("a.stl", None, "lps-ffdr", "0,0,0")
    odd = tmp_path / "a:mm.stl:lps"
    odd.write_bytes(b"x")
    assert split(str(odd)) == (str(odd), None, None, None)
    assert split(f"{odd}:cm:ras@1,1,1") == (str(odd), "cm", "ras", "1,1,1")
    for wrong in ("a.stl:mm:mm", "a.stl:lps:ras", "a.stl:lps:mm", "a.stl:m:left"):
        with pytest.raises(UsageError, match=r"a\.stl"):
            split(wrong)


def test_a_unit_that_the_file_states_otherwise_is_refused(tmp_path):
    path = tmp_path / "inch.dae"
    path.write_bytes(document(asset=ASSET.replace('"1"', '"0.0254"')))
    stated = bc.load_scene(f"{path}:in")
    assert stated.doubt is None
    size = np.ptp(stated.obstacles[0].mesh.bounds[:, 0])
    assert size == pytest.approx(0.2 * 0.0254)
    with pytest.raises(MeshError, match=r"states its unit, 0\.0254 m"):
        bc.load_scene(f"{path}:cm")


def test_a_urdf_has_its_own_frame():
    with pytest.raises(UsageError, match="leave out :y-up"):
        bc.load_scene(f"{ROBOT}:y-up")


def test_a_mesh_of_a_urdf_is_taken_as_it_stands_and_told(tmp_path):
    """The custom of ROS, for a robot and for an obstacle."""
    (tmp_path / "post.dae").write_bytes(POST.read_bytes())
    geometry = '<geometry><mesh filename="post.dae"/></geometry>'
    path = tmp_path / "stand.urdf"
    path.write_text(
        f'<robot name="stand"><link name="post"><collision>{geometry}</collision>'
        "</link></robot>"
    )
    scene = bc.load_scene(str(path))
    assert any("Y_UP, which is not applied" in warning for warning in scene.warnings)
    assert scene.doubt is None
    found = scene.obstacles[0].mesh.corners
    np.testing.assert_array_equal(found, read_mesh_file(POST).mesh.corners)
    said = " ".join(map(str, bc.load_robot(path).not_modelled))
    said += " ".join(bc.load_robot(path).warnings)
    assert "Y_UP" in said
