"""The open magnet: sizes, roles, named zones, head and its entry points."""

import numpy as np
import pytest

import borecheck as bc
from borecheck.errors import BorecheckError
from borecheck.geometry.mesh_files.reading import read_mesh
from borecheck_models.scanners.head import HEAD, MELON, VAULT, ellipsoid, entry_points
from borecheck_models.scanners.mri_open_magnet import (
    DESCRIPTION,
    ZONES,
    build,
    zones_of,
)
from borecheck_models.shapes import Detail, signed_volume


def test_gap_is_as_published():
    """[Heikkila2010] section 2: a 44 cm patient gap."""
    for gap in ("0.44", "0.60"):
        corners = build("coarse", {"gap": gap})["magnet"].corners.reshape(-1, 3)
        inside = np.hypot(corners[:, 0], corners[:, 1]) < 0.5
        z = corners[inside, 2]
        assert z[z > 0].min() == pytest.approx(float(gap) / 2)
        assert z[z < 0].max() == pytest.approx(-float(gap) / 2)


def test_both_sides_of_the_patient_are_open():
    corners = build("coarse", {"gap": "0.44"})["magnet"].corners.reshape(-1, 3)
    between = corners[np.abs(corners[:, 2]) < 0.2]
    assert len(between)
    assert (between[:, 0] < -0.6).all()


@pytest.mark.parametrize("level", ["coarse", "middle", "fine"])
def test_surfaces_are_closed_and_outward(level):
    for mesh in build(level, {"gap": "0.44"}).values():
        assert mesh.is_closed, mesh.name
        assert signed_volume(mesh) > 0.0


def test_shipped_meshes_are_the_generated_ones():
    defaults = {name: a.default for name, a in DESCRIPTION.arguments.items()}
    for stem, mesh in build("coarse", defaults).items():
        shipped = read_mesh(DESCRIPTION.shipped / f"{stem}.stl")
        np.testing.assert_allclose(shipped.corners, mesh.corners, atol=1e-6)


def test_scene_has_the_roles():
    scene = bc.load_scene("mri_open_magnet")
    roles = {item.name: item.role for item in scene.obstacles}
    assert roles["magnet"] == "scanner"
    assert roles["head"] == "patient"
    assert "melon" not in roles
    assert "melon" in {
        item.name
        for item in bc.load_scene("mri_open_magnet", phantom="melon").obstacles
    }


def test_nothing_touches_anything_by_itself():
    """Head, coil, table, torso and magnet stand apart: no contact is built in."""
    parts = bc.load_scene("mri_open_magnet").obstacles
    trees = [bc.MeshTree(p.mesh.vertices, p.mesh.triangles) for p in parts]
    for i in range(len(parts)):
        for j in range(i + 1, len(parts)):
            touching = trees[i].first_contact(trees[j], np.eye(4), np.eye(4))
            names = {parts[i].name, parts[j].name}
            assert not touching, names


def test_wrong_arguments_are_refused():
    with pytest.raises(BorecheckError):
        bc.load_scene("mri_open_magnet", phantom="pumpkin")


def test_field_zones_are_named_distances():
    radii = {zone.name: zone.radius for zone in ZONES}
    assert radii["0.5 mT"] == 1.5
    assert radii["2 mT"] == 1.0
    # a dipole's 1/r^3 through the published 2 mT at 1 m
    assert radii["20 mT"] == pytest.approx((2 / 20) ** (1 / 3), abs=0.005)
    points = [[2, 0, 0], [0, 1.2, 0], [0.9, 0, 0], [0, 0, 0.3]]
    assert [len(names) for names in zones_of(points)] == [0, 1, 2, 3]


@pytest.mark.parametrize("half_axes", [HEAD, MELON])
def test_ellipsoids_go_around_the_true_one(half_axes):
    mesh = ellipsoid(half_axes, Detail(0.05, 24, 1))
    assert mesh.is_closed
    share = np.linalg.norm(mesh.corners / np.array(half_axes), axis=2)
    assert share.min() >= 1.0
    assert share.max() < 1.05
    flat = np.linalg.norm(mesh.corners.mean(axis=1) / np.array(half_axes), axis=1)
    assert flat.min() >= 1.0 - 1e-9


def test_entry_points_lie_on_the_vault():
    found = entry_points(200)
    axes = np.array(HEAD)
    assert len(found.points) == pytest.approx(200, abs=3)
    np.testing.assert_allclose(((found.points / axes) ** 2).sum(axis=1), 1.0)
    gradient = found.points / axes**2
    gradient /= np.linalg.norm(gradient, axis=1)[:, None]
    np.testing.assert_allclose(gradient, found.normals, atol=1e-12)
    assert (found.normals @ np.array(VAULT) > 0).all()
