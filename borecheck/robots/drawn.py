"""What is drawn of a link and lies outside its collision geometry.

Contacts are decided with `<collision>`; where a link is drawn beyond it, there may be
matter that no verdict knows. Reading what is drawn can take longer than a check, so the
answer is kept on disk under the content of all files it came from.
"""

from collections.abc import Sequence
from hashlib import sha256
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from borecheck.core import cache
from borecheck.errors import MeshError
from borecheck.geometry.mesh.triangle_mesh import TriangleMesh
from borecheck.geometry.mesh_files.reading import read_mesh
from borecheck.geometry.overhang import outline, overhang
from borecheck.robots.parts import Part, mesh_path, primitive
from borecheck.robots.urdf.reach import NO_ROOTS, Roots
from borecheck.robots.urdf.tree import Link, Mesh, Shape, UrdfTree

Array = NDArray[np.float64]

TOLERANCE = 0.01  # [m] simplified collision shapes cut corners by less
_KIND = "drawn-beyond-1"


class Beyond(NamedTuple):
    """A link that is drawn beyond its collision geometry.

    Attributes:
        link: Its name.
        distance: How far at least, [m]; None if what is drawn cannot be read.
    """

    link: str
    distance: float | None


class _Drawn(NamedTuple):
    """A link whose drawing differs from its collision geometry.

    Attributes:
        link: Its name.
        shapes: What is drawn, with the mesh file of each, if it is one.
        solids: Its collision geometry, in its frame.
    """

    link: str
    shapes: tuple[tuple[Shape, Path | None], ...]
    solids: tuple[TriangleMesh, ...]


def drawn_beyond(
    tree: UrdfTree,
    parts: Sequence[Part],
    file: Path | None,
    roots: Roots = NO_ROOTS,
    tolerance: float = TOLERANCE,
) -> tuple[Beyond, ...]:
    """Links that are drawn farther out than their collision geometry by a tolerance.

    Args:
        tree: The robot.
        parts: Its collision geometry.
        file: Where relative mesh names start.
        roots: Where its meshes may lie beside its own folder tree.
        tolerance: What is not told, [m].
    """
    found: list[Beyond] = []
    drawn: list[_Drawn] = []
    for link in tree.links:
        if not link.collisions or _drawn_alike(link):
            continue
        solids = tuple(part.mesh for part in parts if part.link == link.name)
        try:
            drawn.append(_Drawn(link.name, _shapes(link, file, roots), solids))
        except MeshError:
            found.append(Beyond(link.name, None))
    distances = _distances(drawn) if drawn else np.zeros(0)
    for one, distance in zip(drawn, distances, strict=True):
        if not distance <= tolerance:
            known = float(distance) if np.isfinite(distance) else None
            found.append(Beyond(one.link, known))
    return tuple(found)


def _drawn_alike(link: Link) -> bool:
    """Whether everything drawn is a collision shape too, at the same place."""

    def same(a: Shape, b: Shape) -> bool:
        return a.geometry == b.geometry and np.array_equal(a.origin, b.origin)

    return all(any(same(v, c) for c in link.collisions) for v in link.visuals)


def _shapes(
    link: Link, file: Path | None, roots: Roots
) -> tuple[tuple[Shape, Path | None], ...]:
    return tuple(
        (shape, mesh_path(shape.geometry.filename, link.name, file, roots))
        if isinstance(shape.geometry, Mesh)
        else (shape, None)
        for shape in link.visuals
        if shape.has_size
    )


def _distances(drawn: Sequence[_Drawn]) -> Array:
    """How far each link is drawn beyond its solids, [m]; NaN where it is not read."""
    key = sha256(b"".join(map(_identity, drawn))).hexdigest()
    kept = (cache.load(_KIND, key) or {}).get("distances")
    if kept is not None and kept.dtype == np.float64 and kept.shape == (len(drawn),):
        return np.asarray(kept, dtype=np.float64)
    found = np.array([_distance(one) for one in drawn])
    cache.store(_KIND, key, {"distances": found})
    return found


def _identity(drawn: _Drawn) -> bytes:
    """A hash of all that the distance depends on."""
    digest = sha256()
    for shape, path in drawn.shapes:
        suffix = path.suffix.lower() if path is not None else ""
        digest.update(f"{shape.geometry}{suffix}".encode())
        digest.update(shape.origin.tobytes())
        if path is not None:
            digest.update(_content_hash(path))
    for solid in drawn.solids:
        digest.update(bytes.fromhex(solid.sha256))
    return digest.digest()


def _content_hash(path: Path) -> bytes:
    try:
        return sha256(path.read_bytes()).digest()
    except OSError:
        return b"unreadable"


def _distance(drawn: _Drawn) -> float:
    try:
        points = [_points(shape, path) for shape, path in drawn.shapes]
    except MeshError:
        return np.nan
    return overhang(np.concatenate(points), drawn.solids) if points else 0.0


def _points(shape: Shape, path: Path | None) -> Array:
    """The outline of a drawn shape in the link's frame, (n, 3)."""
    if path is not None and isinstance(shape.geometry, Mesh):
        points = outline(read_mesh(path)) * np.array(shape.geometry.scale)
    elif not isinstance(shape.geometry, Mesh):
        points = outline(primitive("drawn", shape.geometry))
    return points @ shape.origin[:3, :3].T + shape.origin[:3, 3]
