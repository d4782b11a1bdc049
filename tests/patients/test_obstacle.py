"""The obstacle contains the skin, is not much larger, and stands where it should."""

import json
from dataclasses import replace

import jsonschema
import numpy as np
import pytest

from borecheck.api import certify, verify
from borecheck.cli import main
from borecheck.contact.check import check
from borecheck.contact.settings import settings
from borecheck.core.patient_frame import scanner_from_patient
from borecheck.errors import UsageError
from borecheck.exchange.itk_transform import transform_text
from borecheck.geometry.mesh.primitives import box
from borecheck.geometry.mesh.triangle_mesh import TriangleMesh
from borecheck.geometry.mesh_files.reading import read_mesh
from borecheck.motion.check import check_motion, check_path
from borecheck.patients.body import COUCH, KEPT, SPECK, body_of
from borecheck.patients.motion import BREATHING, SAG, Motion
from borecheck.patients.obstacle import Wishes, patient_obstacle
from borecheck.patients.proof import prove
from borecheck.patients.raster import Raster, rasterised
from borecheck.patients.reading import read_volume
from borecheck.robots.obstacle_files import Assumed, Obstacle
from borecheck.robots.robot import load_robot
from borecheck.robots.scene import load_scene
from studies.scanned_torso import EXCESS_M, judged
from tests.patients.series import block, straight, write_series
from tests.places import PROJECT, ROBOTS

ARM = str(ROBOTS / "two_link.urdf")
SCHEMA = PROJECT / "borecheck" / "schemas" / "patient.schema.json"


@pytest.fixture(scope="module")
def series(tmp_path_factory):
    """A block of water, 45 x 36 x 24 mm, that both ends of the scan cut."""
    return write_series(tmp_path_factory.mktemp("scan") / "s", block(), straight(8))


@pytest.fixture(scope="module")
def made(series):
    return patient_obstacle(read_volume(series), np.eye(4))


def test_a_torso_is_contained_and_in_its_place(tmp_path):
    """The study's judgement on one coarse scan; it runs all positions, finely."""
    voxel = (8.0, 8.0, 9.0)
    inside, excess, made = judged("FFDR", 20.0, 20_000, tmp_path / "s", voxel=voxel)
    assert inside == 1.0
    assert (
        excess <= made.proof.offset + EXCESS_M * 3.0
    )  # voxels of three times the size
    assert made.proof.gap > 0.0
    assert [one.kind for one in made.body.components].count(KEPT) == 3  # both arms
    # the torso's own middle, up to what voxels of 6 mm tell of a symmetric surface
    low, high = made.mesh.bounds
    assert np.abs((low + high)[1] / 2) < 0.002
    assert made.cuts == ()


def test_a_block_has_the_gap_and_the_excess_that_are_stated(made):
    """Against its true corners: water between voxel centres -1 and 0 half way."""
    mesh, proof = made.mesh, made.proof
    assert mesh.is_closed
    seen = mesh.corners[~made.assumed].reshape(-1, 3)
    # the block's sides: columns 7 to 24, rows 3 to 20, half a voxel around
    low = np.array([-40.0 + 2.5 * 6.5, -30.0 + 2.0 * 2.5]) / 1e3
    high = np.array([-40.0 + 2.5 * 24.5, -30.0 + 2.0 * 20.5]) / 1e3
    outside = np.maximum(np.maximum(low - seen[:, :2], seen[:, :2] - high), 0.0)
    away = np.linalg.norm(outside, axis=1)
    assert away.max() <= proof.excess + 1e-3
    assert 0.0 < proof.gap < proof.offset < proof.excess


def test_ends_are_cut_carried_on_and_marked(made, series):
    assert {cut.where for cut in made.cuts} == {"superior end", "inferior end"}
    first, last = -0.1, -0.1 + 7 * 0.003
    low, high = made.mesh.bounds
    reach = made.wishes.extension / 1e3
    assert low[2] <= first - reach
    assert high[2] >= last + reach
    heights = made.mesh.corners[..., 2]
    beyond = (heights < first - 0.006).any(axis=1) | (heights > last + 0.006).any(
        axis=1
    )
    assert made.assumed[beyond].all()
    assert not made.assumed[~beyond].all()
    shorter = patient_obstacle(read_volume(series), np.eye(4), Wishes(20.0))
    assert shorter.mesh.bounds[1][2] == pytest.approx(high[2] - 0.03, abs=0.003)


@pytest.mark.parametrize(("kind", "axis"), [(BREATHING, 1), (SAG, 1)])
def test_a_body_that_moves_is_held_at_every_place(series, made, kind, axis):
    """Forwards is -y in LPS, downwards of a patient on the back +y."""
    moved = patient_obstacle(
        read_volume(series), np.eye(4), Wishes(50.0, (Motion(kind, 15.0),))
    )
    low, high = made.mesh.bounds
    side = moved.mesh.bounds
    grown = (low - side[0])[axis] if kind == BREATHING else (side[1] - high)[axis]
    still = (side[1] - high)[axis] if kind == BREATHING else (low - side[0])[axis]
    assert grown == pytest.approx(0.015, abs=0.004)
    assert abs(still) < 0.004


def test_down_is_where_the_patient_is_said_to_lie(series, made):
    """Of a patient on the belly the couch is before him, -y in LPS."""
    wishes = Wishes(50.0, (Motion(SAG, 15.0),), up=(0.0, 1.0, 0.0))
    moved = patient_obstacle(read_volume(series), np.eye(4), wishes)
    (low, high), side = made.mesh.bounds, moved.mesh.bounds
    assert low[1] - side[0][1] == pytest.approx(0.015, abs=0.004)
    assert abs(side[1][1] - high[1]) < 0.004


def test_a_transform_says_where_down_is(series, tmp_path, capsys):
    """A scan of a patient on the back, who now lies on the belly: z up is back."""
    file = tmp_path / "prone.tfm"
    # of the scanner's frame (head +x) to LPS: y to +x (left), z to +y (posterior)
    T = np.eye(4)
    T[:3, :3] = scanner_from_patient("LPS", "HFP").T
    file.write_text(transform_text(T))
    low = {}
    for name, more in (("still", []), ("sagged", ["--couch-sag", "15mm"])):
        words = ["patient", series, "--transform", str(file), "--format", "json"]
        status, out, _ = run(capsys, *words, *more)
        assert status == 0
        low[name] = np.array(json.loads(out)["obstacle"]["bounds_m"])
    lower = low["still"][0, 2] - low["sagged"][0, 2]
    assert lower == pytest.approx(0.015, abs=0.004)
    assert abs(low["sagged"][1, 2] - low["still"][1, 2]) < 0.004


def cells(*boxes):
    """A raster of 2 mm cells with these boxes of tissue, (w, v, u)."""
    found = np.zeros((10, 120, 160), dtype=bool)
    for w, v, u in boxes:
        found[w, v, u] = True
    return Raster(found, np.zeros(3), np.array([2.0, 2.0, 2.0]))


def at(a, b):
    return slice(a, b)


TRUNK = (at(0, 10), at(20, 70), at(40, 120))
ARMS = ((at(0, 10), at(40, 60), at(10, 30)), (at(0, 10), at(40, 60), at(130, 150)))
SHELL = (at(0, 10), at(80, 83), at(20, 140))
DOWN = np.array([0.0, 1.0, 0.0])


def test_the_couch_goes_and_arms_stay():
    found = body_of(cells(TRUNK, *ARMS, SHELL), DOWN)
    assert np.array_equal(found.raster.cells, cells(TRUNK, *ARMS).cells)
    kinds = [one.kind for one in found.components]
    assert kinds == [KEPT, KEPT, KEPT, COUCH]
    assert found.components[-1].volume == pytest.approx(10 * 3 * 120 * 8.0)


@pytest.mark.parametrize(
    "body",
    [
        pytest.param((at(0, 10), at(72, 78), at(60, 66)), id="finger under the back"),
        pytest.param((at(0, 10), at(72, 92), at(50, 75)), id="arm under the back"),
        pytest.param((at(0, 10), at(60, 64), at(0, 40)), id="thin, beside the trunk"),
    ],
)
def test_nothing_that_may_be_the_body_is_taken_for_the_couch(body):
    found = body_of(cells(TRUNK, body), DOWN)
    assert np.array_equal(found.raster.cells, cells(TRUNK, body).cells)


def test_specks_go_unless_the_scan_cuts_them():
    speck, corner = (at(4, 6), at(2, 6), at(2, 6)), (at(8, 10), at(2, 8), at(80, 86))
    found = body_of(cells(TRUNK, speck, corner), DOWN)
    assert np.array_equal(found.raster.cells, cells(TRUNK, corner).cells)
    assert [one.kind for one in found.components] == [KEPT, KEPT, SPECK]


def test_hollows_within_a_slice_are_filled():
    raster = cells(TRUNK)
    raster.cells[:, 40:50, 60:80] = False
    assert np.array_equal(body_of(raster, DOWN).raster.cells, cells(TRUNK).cells)


def test_cells_hold_every_voxel_of_tissue_of_a_tilted_stack(tmp_path):
    angle = np.radians(17.0)
    tilted = (1.0, 0.0, 0.0, 0.0, np.cos(angle), np.sin(angle))
    values = block()
    folder = write_series(tmp_path / "s", values, straight(8), orientation=tilted)
    volume = read_volume(folder)
    raster = rasterised(volume)
    for k, plane in enumerate(values):
        rows, columns = np.nonzero(plane > -500)
        u, v, w = volume.places[k]
        for du in (-1.2, 1.2):
            for dv in (-0.95, 0.95):
                i = raster.holding(u + 2.5 * columns + du, 0)
                j = raster.holding(v + 2.0 * rows + dv, 1)
                layer = raster.holding(np.array([w]), 2)[0]
                assert raster.cells[layer, j, i].all()


def test_a_surface_that_does_not_contain_the_skin_is_not_proven():
    outer, skin = box("outer", (0.04, 0.04, 0.04)), box("skin", (0.03, 0.03, 0.03))
    none = np.zeros(len(outer.triangles), dtype=bool)

    def asked(shift):
        moved = skin.vertices + np.array([shift, 0.0, 0.0])
        return prove(outer, none, [(moved, skin.triangles, 1)], 0.005)

    proof = asked(0.0)
    assert proof.gap == pytest.approx(0.005, abs=1e-9)
    assert proof.excess >= 0.005
    assert asked(0.006) is None  # the surfaces meet
    assert asked(0.5) is None  # beside it
    opened = type(outer)("open", outer.vertices, outer.triangles[:-1])
    slabs = [(skin.vertices, skin.triangles, 1)]
    assert prove(opened, none[:-1], slabs, 0.005) is None


@pytest.mark.parametrize("assumed", [False, True])
def test_what_was_not_seen_is_never_clear_where_it_is_nearest(assumed):
    robot = load_robot(ARM)
    mesh = box("patient", (0.2, 0.2, 0.2)).moved(
        np.array([[1, 0, 0, 2.0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]], float)
    )
    marks = np.full(len(mesh.triangles), assumed)
    obstacle = Obstacle("p", "patient", mesh, "p", None, Assumed(marks, "beyond it"))
    far = f"{ROBOTS / 'two_link.urdf'}@5,0,0"
    scene = load_scene(far).with_obstacles([obstacle])
    verdict = check(robot, scene, [0.0])
    assert verdict.verdict == ("unknown" if assumed else "clear")
    assert ("assumed, not seen: beyond it" in verdict.reason) == assumed


def run(capsys, *words):
    status = main([*map(str, words)])
    out, err = capsys.readouterr()
    return status, out, err


def test_the_result_fits_its_schema_and_the_file_is_the_obstacle(
    series, tmp_path, capsys
):
    skin = tmp_path / "skin.stl"
    place = ["--isocentre", "0,-10mm,-90mm"]
    words = ["patient", series, *place, "--out", skin, "--format", "json"]
    status, out, _ = run(capsys, *words)
    assert status == 0
    document = json.loads(out)
    jsonschema.Draft202012Validator(json.loads(SCHEMA.read_text())).validate(document)
    mesh = read_mesh(skin)
    assert document["obstacle"]["triangles"] == len(mesh.triangles)
    assert document["place"]["known"]
    assert np.allclose(mesh.bounds, document["obstacle"]["bounds_m"])
    # superior is along the bore, z up: the block's middle, seen from the isocentre
    middle = mesh.bounds.mean(axis=0)
    assert np.allclose(middle, [0.0005, 0.0012, -0.003], atol=0.0015)
    before = skin.read_bytes()
    assert run(capsys, *words)[0] == 0  # its own file is written again
    assert skin.read_bytes() == before


def test_geometry_alone_fits_the_schema_too(series, capsys):
    words = ["patient", series, "--geometry-only", "--format", "json"]
    document = json.loads(run(capsys, *words)[1])
    jsonschema.Draft202012Validator(json.loads(SCHEMA.read_text())).validate(document)
    assert document["proof"] is None
    assert len(document["cuts"]) == 2


def test_without_an_isocentre_nothing_is_clear(series, tmp_path, capsys):
    words = ["check", ARM, f"{ROBOTS / 'two_link.urdf'}@5,0,0", "--q", "0"]
    near = ["--patient-ct", series, "--isocentre", "3,0,0"]
    away = write_series(tmp_path / "a", block(), straight(8, first=(2e3, 0.0, 0.0)))
    status, out, _ = run(capsys, *words, "--patient-ct", away)
    assert status == 2
    assert "give --isocentre" in out
    status, out, _ = run(capsys, *words, *near, "--format", "json")
    document = json.loads(out)
    assert document["verdict"] in ("clear", "unknown")
    assert any("beyond the scan" in line for line in document["not_modelled"])
    assert any(o["name"] == "s" for o in document["scene"]["obstacles"])
    assert any("from the isocentre: is the pose" in w for w in document["warnings"])


@pytest.mark.parametrize(
    "words",
    [
        ["directions", "zerobot", "ct_gantry", "--target", "0,0,-50mm"],
        ["setup", "zerobot", "ct_gantry", "--plan"],
    ],
)
def test_a_scan_of_unknown_place_is_taken_by_all_commands(
    words, series, tmp_path, capsys
):
    plans = tmp_path / "plans.csv"
    head = "name,entry_x,entry_y,entry_z,target_x,target_y,target_z"
    plans.write_text(f"{head}\na,0,0,0.1,0,0,-0.05\n")
    more = [str(plans)] if words[-1] == "--plan" else ["--resolution", "20deg"]
    status, out, err = run(capsys, *words, *more, "--patient-ct", series)
    assert status == 2
    assert "Traceback" not in err
    assert "CLEAR" not in out


@pytest.mark.parametrize(
    ("more", "saying"),
    [
        (["--isocentre", "1,2"], "3"),
        (["--transform", "a.tfm", "--position", "FFS"], "no --position"),
        (["--cover", "5mm", "--series", "9"], "9"),
        (["--isocentre", "12,-40,-750"], "millimetres"),
        (["--position", "FFS"], "says HFS"),
        (["--extend", "-3mm"], "--extend"),
        (["--breathing", "3m"], "--breathing"),
        (["--segment", "all"], "is a CT"),
        (["--out", "skin.obj"], ".stl"),
        (["--list", "--out", "skin.stl"], "--list"),
    ],
)
def test_what_cannot_be_meant_is_one_line(series, capsys, more, saying):
    status, out, err = run(capsys, "patient", series, *more)
    assert (status, out) == (2, "")
    assert err.count("\n") == 1
    assert saying in err


def test_the_picture_shows_seen_and_assumed_outlines(made, monkeypatch):
    """Water is seen as light, and both outlines run around it in their colours."""
    from borecheck.report import patient_picture

    image = []
    keep = patient_picture.png
    monkeypatch.setattr(
        patient_picture, "png", lambda pixels: image.append(pixels) or keep(pixels)
    )
    png = patient_picture.preview(made, np.eye(4), ())
    assert png.startswith(b"\x89PNG")
    frontal = image[0][: patient_picture.HEIGHT, -patient_picture.WIDTH :]
    seen = (frontal == patient_picture.SEEN).all(axis=2)
    assumed = (frontal == patient_picture.ASSUMED).all(axis=2)
    rows = [np.flatnonzero(marks.any(axis=1)) for marks in (seen, assumed)]
    assert rows[1].min() < rows[0].min() < rows[0].max() < rows[1].max()
    light = (frontal.min(axis=2) > 150).any(axis=1)
    assert light[(rows[0].min() + rows[0].max()) // 2]


def test_something_nearer_does_not_make_what_was_assumed_clear(tmp_path):
    """Without the wall it is unknown; with it, no more is known of the patient."""
    robot, gantry = load_robot(ARM), load_scene("ct_gantry")
    empty = gantry.without_obstacles(gantry.obstacles)
    low, high = robot_bounds(robot)
    size = np.full(3, 0.05)
    middle = 0.5 * (low + high)

    def block(name, z):
        cube = box(name, tuple(size))
        at = cube.vertices - cube.bounds.mean(axis=0) + [*middle[:2], z]
        return TriangleMesh(name, at, cube.triangles)

    patient = block("patient", high[2] + 0.06)
    unseen = Assumed(np.ones(len(patient.triangles), bool), "beyond the scan")
    assumed = Obstacle("patient", "patient", patient, "", None, unseen)
    wall = Obstacle("wall", "other", block("wall", low[2] - 0.035), "")
    for obstacles in ([assumed], [assumed, wall]):
        verdict = check(robot, empty.with_obstacles(obstacles), robot.home)
        assert verdict.verdict == "unknown"
        assert "beyond the scan" in verdict.reason
        way = np.array([robot.home, robot.home + 1e-3])
        path = check_path(robot, empty.with_obstacles(obstacles), way)
        assert path.verdict == "unknown"
        assert "beyond the scan" in path.reason
        assert "beyond the scan" in path.obstacles.reason
        quick = check_path(robot, empty.with_obstacles(obstacles), way, clearance=False)
        assert (quick.verdict, quick.obstacles.verdict) == ("unknown", "unknown")
        motion = check_motion(
            robot, empty.with_obstacles(obstacles), way, settings("exact", "bvh", 0.0)
        )
        assert (motion.verdict, motion.obstacles.verdict) == ("unknown", "unknown")
        assert motion.proof.outcome.unknown  # no certificate is written from it
        with pytest.raises(UsageError, match="beyond the scan"):
            certify(robot, empty.with_obstacles(obstacles), way, tmp_path / "c.json")
    seen = empty.with_obstacles([replace(assumed, assumed=None), wall])
    file = certify(robot, seen, way, tmp_path / "c.json")
    assert verify(file, robot, seen, waypoints=way).accepted
    bound = verify(file, robot, empty.with_obstacles([assumed, wall]), waypoints=way)
    assert not bound.accepted
    assert "beyond the scan" in " ".join(bound.problems)
    assert check(robot, empty.with_obstacles([wall]), robot.home).clear


def robot_bounds(robot):
    T = robot.placements(robot.home)
    points = np.concatenate(
        [p.mesh.vertices @ T[p.link][:3, :3].T + T[p.link][:3, 3] for p in robot.parts]
    )
    return points.min(axis=0), points.max(axis=0)
