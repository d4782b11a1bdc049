"""The collision geometry of a URDF: triangles per link, in the link's own frame."""

from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass
from pathlib import Path

from borecheck.errors import MeshError, UrdfError
from borecheck.geometry.mesh.primitives import box, capsule, cylinder, sphere
from borecheck.geometry.mesh.triangle_mesh import TriangleMesh
from borecheck.geometry.mesh_files.reading import MeshFile, read_mesh_file
from borecheck.robots.urdf.package_paths import resolve
from borecheck.robots.urdf.reach import NO_ROOTS, Roots
from borecheck.robots.urdf.tree import (
    Box,
    Capsule,
    Cylinder,
    Link,
    Mesh,
    Sphere,
    UrdfTree,
)

Reader = Callable[[Path], MeshFile]

THIN = 1e-6  # [m] a drawn plate without thickness gets this: never smaller than it is
AS_DRAWN = "what differs from its drawn shape (it has no <collision>)"


@dataclass(frozen=True)
class Part:
    """One closed or open surface of a link.

    Attributes:
        link: The link it is fixed to.
        mesh: Its triangles in the link's frame, [m].
        file: Name of the mesh file, if it is from one.
        remarks: What its file states and is not applied, or was read over.
    """

    link: str
    mesh: TriangleMesh
    file: str = ""
    remarks: tuple[str, ...] = ()


def collision_parts(
    tree: UrdfTree,
    file: Path | None,
    roots: Roots = NO_ROOTS,
    read: Reader = read_mesh_file,
) -> tuple[Part, ...]:
    """All collision geometry, a part for each `<collision>`, in the file's order.

    A link that is drawn and has no `<collision>` is taken as it is drawn: nothing that
    is there is left unexamined. Round primitives are circumscribed (see `primitives`),
    so a part is never smaller than the shape it stands for.

    Args:
        tree: The parsed robot.
        file: The file it came from: relative mesh names start there.
        roots: Where its meshes may lie beside its own folder tree.
        read: What reads a mesh file.

    Raises:
        MeshError: A mesh that is missing, out of reach or cannot be read.
    """
    links = {link.name for link in tree.links}
    return tuple(
        _part(link, index, _name(link, index, links), file, roots, read)
        for link in tree.links
        for index, shape in enumerate(link.collisions or link.visuals)
        if shape.has_size
    )


def refuse_nothing(parts: Sequence[Part], file: Path) -> None:
    """Nothing, if there is any part.

    Raises:
        UrdfError: No link has geometry: no verdict could say anything.
    """
    if not parts:
        raise UrdfError(file, "no link has collision geometry: nothing to check")


def without_size(tree: UrdfTree) -> tuple[str, ...]:
    """Links whose drawn shape has neither volume nor surface: nothing is there."""
    return tuple(
        link.name
        for link in tree.links
        if not link.collisions and not all(shape.has_size for shape in link.visuals)
    )


def links_without_collision(tree: UrdfTree) -> tuple[str, ...]:
    """Links without a collision shape that are taken as they are drawn."""
    return tuple(
        link.name for link in tree.links if link.visuals and not link.collisions
    )


def _name(link: Link, index: int, links: Collection[str]) -> str:
    """The link, numbered where it has several shapes; no two parts are called alike."""
    if len(link.collisions or link.visuals) == 1:
        return link.name
    name = f"{link.name}[{index}]"
    while name in links:
        name += "'"
    return name


def _part(
    link: Link, index: int, name: str, file: Path | None, roots: Roots, read: Reader
) -> Part:
    shapes = link.collisions or link.visuals
    geometry, T = shapes[index].geometry, shapes[index].origin
    if not isinstance(geometry, Mesh):
        return Part(link.name, primitive(name, geometry).moved(T))
    path = mesh_path(geometry.filename, link.name, file, roots)
    found = read(path)
    mesh = _scaled(name, found.mesh, geometry.scale)
    return Part(link.name, mesh.moved(T), path.name, found.remarks)


def primitive(name: str, geometry: Box | Cylinder | Capsule | Sphere) -> TriangleMesh:
    """The triangles of a shape in its own frame, [m]."""
    match geometry:
        case Box():
            return box(name, [max(size, THIN) for size in geometry.size])
        case Cylinder():
            return cylinder(name, geometry.radius, max(geometry.length, THIN))
        case Sphere():
            return sphere(name, geometry.radius)
        case Capsule():
            return capsule(name, geometry.radius, max(geometry.length, THIN))


def mesh_path(reference: str, link: str, file: Path | None, roots: Roots) -> Path:
    """The file that a mesh reference means.

    Raises:
        MeshError: It is not there, or out of reach.
    """
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


def _scaled(
    name: str, mesh: TriangleMesh, scale: tuple[float, float, float]
) -> TriangleMesh:
    """The mesh times its scale; a mirrored one keeps its outside outside."""
    if scale == (1.0, 1.0, 1.0):
        return TriangleMesh(name, mesh.vertices, mesh.triangles)
    x, y, z = scale
    triangles = mesh.triangles if x * y * z > 0.0 else mesh.triangles[:, ::-1]
    return TriangleMesh(name, mesh.vertices * [x, y, z], triangles)
