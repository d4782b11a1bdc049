"""Collision geometry of a URDF: every shape, in the link's frame, never smaller."""

import numpy as np
import pytest

from borecheck.errors import MeshError, UrdfError
from borecheck.geometry.mesh.primitives import box
from borecheck.geometry.mesh_files.reading import write_stl
from borecheck.geometry.triangles.solid import Side, is_inside
from borecheck.robots.parts import collision_parts, links_without_collision
from borecheck.robots.urdf.parse import parse
from borecheck.robots.urdf.reach import Roots

# STL holds float32: seven digits of coordinates below 1 m.
FLOAT32 = 1e-7


def robot(links):
    return parse(f"<robot name='r'>{links}</robot>")


def collision(geometry, origin=""):
    return f"<collision>{origin}<geometry>{geometry}</geometry></collision>"


def parts_of(tmp_path, inside):
    tree = robot(f"<link name='a'>{inside}</link>")
    return collision_parts(tree, tmp_path / "r.urdf")


@pytest.fixture
def wedge(tmp_path):
    """A box that lies on one side of the origin, so that mirroring shows."""
    mesh = box("wedge", (0.2, 0.4, 0.6))
    moved = type(mesh)("wedge", mesh.vertices + np.array([0.1, 0, 0]), mesh.triangles)
    write_stl(tmp_path / "wedge.stl", moved)
    return moved


def volume(mesh):
    return float(np.linalg.det(mesh.corners).sum() / 6.0)


def test_every_collision_is_a_part_with_its_own_name(tmp_path):
    shapes = (
        collision("<box size='1 2 3'/>"),
        collision("<sphere radius='0.5'/>"),
        collision("<cylinder radius='0.5' length='2'/>"),
        collision("<capsule radius='0.5' length='2'/>"),
    )
    parts = parts_of(tmp_path, "".join(shapes))
    assert [part.link for part in parts] == ["a"] * 4
    assert [part.mesh.name for part in parts] == ["a[0]", "a[1]", "a[2]", "a[3]"]
    assert all(part.mesh.is_closed for part in parts)
    assert all(volume(part.mesh) > 0.0 for part in parts)


def test_round_shapes_hold_the_true_shape(tmp_path, rng):
    inside = collision("<sphere radius='0.5'/>") + collision(
        "<capsule radius='0.5' length='2'/>"
    )
    ball, capsule = (part.mesh for part in parts_of(tmp_path, inside))
    on_ball = rng.normal(size=(40, 3))
    on_ball *= 0.5 / np.linalg.norm(on_ball, axis=1)[:, None]
    for point in on_ball:
        assert is_inside(point, ball) is not Side.OUTSIDE
        end = point + [0.0, 0.0, np.sign(point[2])]
        assert is_inside(end, capsule) is not Side.OUTSIDE


def test_the_origin_of_a_collision_moves_it(tmp_path):
    origin = "<origin xyz='1 2 3' rpy='0 0 1.5707963267948966'/>"
    (part,) = parts_of(tmp_path, collision("<box size='2 4 6'/>", origin))
    expected = np.array([[-1.0, 1.0, 0.0], [3.0, 3.0, 6.0]])
    assert part.mesh.bounds == pytest.approx(expected, abs=1e-12)


def test_a_mesh_is_found_beside_the_file_and_scaled(tmp_path, wedge):
    geometry = "<mesh filename='wedge.stl' scale='0.5 2 1'/>"
    (part,) = parts_of(tmp_path, collision(geometry))
    assert part.mesh.name == "a"
    expected = wedge.bounds * [0.5, 2.0, 1.0]
    assert part.mesh.bounds == pytest.approx(expected, abs=FLOAT32)


@pytest.mark.parametrize("scale", ["-1 1 1", "1 -1 1", "-1 -1 -1", "-1 -1 1"])
def test_a_mirrored_mesh_keeps_its_outside_outside(tmp_path, wedge, scale):
    geometry = f"<mesh filename='wedge.stl' scale='{scale}'/>"
    (part,) = parts_of(tmp_path, collision(geometry))
    factors = np.array(scale.split(), dtype=float)
    assert volume(part.mesh) == pytest.approx(volume(wedge), rel=1e-6)
    expected = np.sort(wedge.bounds * factors, axis=0)
    assert part.mesh.bounds == pytest.approx(expected, abs=FLOAT32)


def test_drawn_links_without_a_collision_shape_are_taken_as_drawn():
    visual = "<visual><geometry><box size='1 1 1'/></geometry></visual>"
    solid = collision("<box size='1 1 1'/>")
    joints = "".join(
        f"<joint name='j{n}' type='fixed'><parent link='a'/><child link='{n}'/></joint>"
        for n in "bc"
    )
    links = (
        f"<link name='a'>{visual}{solid}</link><link name='b'>{visual}</link>"
        "<link name='c'/>"
    )
    tree = robot(links + joints)
    assert links_without_collision(tree) == ("b",)
    assert [part.link for part in collision_parts(tree, None)] == ["a", "b"]


def test_a_missing_mesh_says_where_it_was_looked_for(tmp_path):
    with pytest.raises(MeshError, match=r"nothing\.stl.*is not there") as error:
        parts_of(tmp_path, collision("<mesh filename='nothing.stl'/>"))
    assert str(tmp_path) in str(error.value)


def test_packages_are_found_over_the_roots_given(tmp_path, wedge):
    package = tmp_path / "root" / "pack" / "meshes"
    package.mkdir(parents=True)
    write_stl(package / "w.stl", wedge)
    inside = collision("<mesh filename='package://pack/meshes/w.stl'/>")
    tree = robot(f"<link name='a'>{inside}</link>")
    (part,) = collision_parts(tree, tmp_path / "r.urdf", Roots((tmp_path / "root",)))
    assert len(part.mesh.triangles) == 12
    elsewhere = tmp_path / "elsewhere"
    elsewhere.mkdir()
    with pytest.raises(MeshError, match="pack"):
        collision_parts(tree, elsewhere / "r.urdf")


@pytest.mark.parametrize(
    "geometry",
    [
        "<box size='1 0 1'/>",
        "<box size='1 1'/>",
        "<sphere radius='-1'/>",
        "<cylinder radius='nan' length='1'/>",
        "<mesh filename='wedge.stl' scale='0 1 1'/>",
        "<mesh filename=''/>",
        "<cone/>",
        "",
    ],
)
def test_a_shape_that_is_none_is_refused(tmp_path, wedge, geometry):
    with pytest.raises(UrdfError):
        parts_of(tmp_path, collision(geometry))
