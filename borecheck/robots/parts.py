"""The collision geometry of a URDF: triangles per link, in the link's own frame."""

from dataclasses import dataclass
from pathlib import Path

from borecheck.errors import MeshError
from borecheck.geometry.mesh.primitives import box, capsule, cylinder, sphere
from borecheck.geometry.mesh.triangle_mesh import TriangleMesh
from borecheck.geometry.mesh_files.reading import read_mesh
from borecheck.robots.urdf.package_paths import resolve
from borecheck.robots.urdf.reach import NO_ROOTS, Roots
from borecheck.robots.urdf.tree import (
    Box,
    Capsule,
    Cylinder,
    Geometry,
    Link,
    Mesh,
    Sphere,
    UrdfTree,
)

AS_DRAWN = "what differs from its drawn shape (it has no <collision>)"


@dataclass(frozen=True)
class Part:
    """One closed or open surface of a link.

    Attributes:
        link: The link it is fixed to.
        mesh: Its triangles in the link's frame, [m].
    """

    link: str
    mesh: TriangleMesh


def collision_parts(
    tree: UrdfTree, file: Path | None, roots: Roots = NO_ROOTS
) -> tuple[Part, ...]:
    """All collision geometry, a part for each `<collision>`, in the file's order.

    A link that is drawn and has no `<collision>` is taken as it is drawn: nothing that
    is there is left unexamined. Round primitives are circumscribed (see `primitives`),
    so a part is never smaller than the shape it stands for.

    Args:
        tree: The parsed robot.
        file: The file it came from: relative mesh names start there.
        roots: Where its meshes may lie beside its own folder tree.

    Raises:
        MeshError: A mesh that is missing, out of reach or cannot be read.
    """
    return tuple(
        Part(link.name, _mesh(link, index, file, roots))
        for link in tree.links
        for index in range(len(link.collisions or link.visuals))
    )


def links_without_collision(tree: UrdfTree) -> tuple[str, ...]:
    """Links without a collision shape that are taken as they are drawn."""
    return tuple(
        link.name for link in tree.links if link.visuals and not link.collisions
    )


def _mesh(link: Link, index: int, file: Path | None, roots: Roots) -> TriangleMesh:
    shapes = link.collisions or link.visuals
    name = link.name if len(shapes) == 1 else f"{link.name}[{index}]"
    mesh = _shape(name, shapes[index].geometry, file, roots)
    return mesh.moved(shapes[index].origin)


def _shape(
    name: str, geometry: Geometry, file: Path | None, roots: Roots
) -> TriangleMesh:
    match geometry:
        case Box():
            return box(name, geometry.size)
        case Cylinder():
            return cylinder(name, geometry.radius, geometry.length)
        case Sphere():
            return sphere(name, geometry.radius)
        case Capsule():
            return capsule(name, geometry.radius, geometry.length)
        case Mesh():
            path = _mesh_path(geometry.filename, name, file, roots)
            return _scaled(read_mesh(path, name=name), geometry.scale)


def _mesh_path(reference: str, link: str, file: Path | None, roots: Roots) -> Path:
    base = file.parent if file is not None else Path.cwd()
    found = resolve(reference, base, roots)
    if found.path is not None:
        return found.path
    name = file or "robot"
    if found.is_refused:
        raise MeshError(name, f"mesh {reference!r}: {found.problem}", f"link {link!r}")
    tried = ", ".join(str(path) for path in found.tried[:6]) or "nothing"
    problem = f"mesh {reference!r} is not there: {found.problem} (tried: {tried})"
    raise MeshError(name, problem, f"link {link!r}")


def _scaled(mesh: TriangleMesh, scale: tuple[float, float, float]) -> TriangleMesh:
    """The mesh times its scale; a mirrored one keeps its outside outside."""
    if scale == (1.0, 1.0, 1.0):
        return mesh
    x, y, z = scale
    triangles = mesh.triangles if x * y * z > 0.0 else mesh.triangles[:, ::-1]
    return TriangleMesh(mesh.name, mesh.vertices * [x, y, z], triangles)
