"""Bodies by sex, height and body mass index: solids of the right size and girths."""

import json
from hashlib import sha256
from importlib.resources import files

import numpy as np
import pytest
import trimesh
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components
from scipy.spatial import ConvexHull

import borecheck as bc
from borecheck.bodies.body import make_body, manifest, table_girths
from borecheck.bodies.spec import BodySpec, body_spec
from borecheck.bodies.table import DENSITY, GIRTHS, KEYS
from borecheck.cli import main
from borecheck.errors import BorecheckError
from borecheck.geometry.mesh_files.reading import read_mesh
from borecheck.validation.reading.mesh_crossing import crossing_pairs

HEIGHTS = {"m": 1.76, "f": 1.63}
TWELVE = [
    BodySpec(sex, bmi, HEIGHTS[sex], arms)
    for sex in "mf"
    for bmi, arms in zip(range(20, 46, 5), ("side", "up") * 3, strict=True)
]


def name(spec):
    return f"{spec.sex}{spec.bmi:g}{spec.arms}"


@pytest.fixture(scope="module")
def bodies():
    return {name(spec): make_body(spec) for spec in TWELVE}


def as_trimesh(mesh):
    return trimesh.Trimesh(mesh.vertices, mesh.triangles, process=False)


def tape(mesh, station):
    """Round the largest piece that a plane cuts out, by trimesh's segments."""
    lines = trimesh.intersections.mesh_plane(mesh, [1, 0, 0], [station, 0, 0])
    ends, index = np.unique(
        np.round(lines.reshape(-1, 3), 9), axis=0, return_inverse=True
    )
    pairs = index.reshape(-1, 2)
    graph = coo_matrix((np.ones(len(pairs)), pairs.T), shape=(len(ends),) * 2)
    count, piece = connected_components(graph, directed=False)
    hulls = [ConvexHull(ends[piece == k, 1:]) for k in range(count)]
    return max(hulls, key=lambda hull: hull.volume).area


@pytest.mark.parametrize("spec", TWELVE, ids=name)
def test_a_body_is_one_closed_solid_of_its_mass_and_height(spec, bodies):
    body = bodies[name(spec)]
    solid = as_trimesh(body.mesh)
    assert solid.is_watertight
    assert solid.body_count == 1
    if spec.bmi in (20, 45):  # of all twelve: python -m studies.bodies
        assert len(crossing_pairs(body.mesh)) == 0
    low, high = solid.bounds
    height = high[0] - low[0] if spec.arms == "side" else body.crown - low[0]
    assert height == pytest.approx(spec.height, abs=0.005)
    # by the divergence theorem of another library
    assert DENSITY * solid.volume / height**2 == pytest.approx(spec.bmi, abs=0.3)
    assert body.to_json()["bmi"] == pytest.approx(spec.bmi, abs=1e-9)


@pytest.mark.parametrize("spec", TWELVE, ids=name)
def test_girths_are_those_of_the_table(spec, bodies):
    body = bodies[name(spec)]
    waist, hip = table_girths(spec.sex, spec.bmi)
    solid = as_trimesh(body.mesh)
    station = (0.515 - 0.607) * spec.height  # hips below the waist, at x = 0
    for found, said, table in (
        (tape(solid, 1e-6), body.waist, waist),
        (tape(solid, station), body.hip, hip),
    ):
        assert found == pytest.approx(said, abs=0.01)
        assert found == pytest.approx(table, abs=0.04)


@pytest.mark.parametrize("arms", ["side", "up"])
@pytest.mark.parametrize("sex", ["m", "f"])
def test_more_weight_is_more_girth(sex, arms):
    made = [
        make_body(BodySpec(sex, bmi, HEIGHTS[sex], arms))
        for bmi in np.linspace(20.0, 45.0, 41)
    ]
    for girths in ([body.waist for body in made], [body.hip for body in made]):
        assert (np.diff(girths[::4]) > 0.0).all()  # from shape to shape
        # where the next shape takes over, by less than a tape is right
        assert (np.diff(girths) > -0.005).all()


def test_the_table_goes_up():
    for rows in GIRTHS.values():
        for row in rows:
            assert len(row) == len(KEYS)
            assert (np.diff(row) > 0.0).all()


@pytest.mark.parametrize("spec", TWELVE, ids=name)
def test_a_body_lies_flat_on_the_couch(spec, bodies):
    mesh = as_trimesh(bodies[name(spec)].mesh)
    z = mesh.vertices[:, 2] - bodies[name(spec)].couch
    assert z.min() == pytest.approx(0.0, abs=1e-9)
    areas, middles = mesh.area_faces, mesh.triangles_center
    down = (mesh.face_normals[:, 2] < -0.8) & (np.abs(middles[:, 0]) < 0.35)
    low = middles[:, 2] - bodies[name(spec)].couch < 0.015
    # of what of the trunk faces the couch, most is on it
    assert areas[down & low].sum() > 0.6 * areas[down].sum()
    assert areas[down & low].sum() > 0.05


def test_shapes_are_the_ones_of_the_manifest():
    folder = files("borecheck.bodies") / "shapes"
    records = manifest()["bodies"]
    assert len(records) == 2 * 2 * len(KEYS)
    for record in records:
        content = (folder / record["file"]).read_bytes()
        assert sha256(content).hexdigest() == record["sha256"]
    assert "CC0" in manifest()["source"]["data"]


REFUSED = {
    "sex=f": "bmi is missing",
    "bmi=30": "sex is missing",
    "sex=x,bmi=30": "unknown sex",
    "sex=f,bmi=50": "from 20 to 45",
    "sex=f,bmi=nan": "no number",
    "sex=f,bmi=30,height=165": "from 1.4 to 2.1",
    "sex=f,bmi=30,height=x": "no length",
    "sex=f,bmi=30,arms=down": "place of the arms",
    "sex=f,bmi=30,bmi=31": "given twice",
    "sex=f,weight=30": "unknown field",
    "sex": "NAME=VALUE",
}


@pytest.mark.parametrize("text", REFUSED)
def test_what_is_no_body_is_told_in_a_line(text):
    with pytest.raises(BorecheckError, match=REFUSED[text]) as told:
        body_spec(text)
    assert "\n" not in str(told.value)


def test_a_body_as_typed_is_read_again():
    assert body_spec("sex=f,bmi=35,height=165cm").height == pytest.approx(1.65)
    spec = body_spec("body:sex=f,bmi=35,height=1.65,arms=side")
    assert spec == BodySpec("f", 35.0, 1.65, "side")
    assert body_spec(str(spec)) == spec


def test_a_body_in_a_scene_stands_where_it_is_put():
    text = "body:sex=f,bmi=35,height=1.65"
    (here,) = bc.load_scene([text]).obstacles
    scene = bc.load_scene("ct_gantry", patient="no", patients=[f"{text}@10mm,0,20mm"])
    there = next(o for o in scene.obstacles if o.role == "patient")
    moved = there.mesh.bounds - here.mesh.bounds
    np.testing.assert_allclose(moved, [[0.01, 0, 0.02]] * 2, atol=1e-12)
    assert there.source.startswith("body:sex=f,bmi=35")
    assert any("stands for" in text for text in scene.not_modelled)


def test_the_command_writes_what_it_says(tmp_path, capsys):
    file = tmp_path / "b.stl"
    words = ["sex=m,bmi=30,height=1.8,arms=side", "--out", str(file)]
    assert main(["body", *words, "--format", "json"]) == 0
    said = json.loads(capsys.readouterr().out)
    low, high = read_mesh(file).bounds
    assert high[0] - low[0] == pytest.approx(1.8, abs=0.005)
    np.testing.assert_allclose(high - low, said["size_m"], atol=1e-6)
    assert main(["body", *words[:1], "--out", str(tmp_path / "b.obj")]) == 2
    assert capsys.readouterr().err.count("\n") == 1
    assert main(["body", *words]) == 0  # ours is written anew, another's is not
    file.write_bytes(b"solid gantry\nendsolid gantry\n")
    assert main(["body", *words]) == 2
    assert file.read_bytes().startswith(b"solid gantry")
