"""Triangle meshes from files: the triangles as they stand there, or one clear error.

STL (binary and text), OBJ, PLY and Collada are read strictly: all of a file or nothing.
Vertices and triangles keep the order of the file, so a triangle number in a report is
the triangle's place in the file, from 0 (a polygon of n corners counts as n - 2
triangles). Zero-area triangles stay: they can touch too. What a file states about its
frame or unit is told (`MeshFile`), never applied in silence.
"""

import math
from dataclasses import dataclass
from pathlib import Path
from stat import S_ISREG

import numpy as np
from numpy.typing import NDArray

from borecheck.core.units import LENGTH_UNITS
from borecheck.errors import MeshError, UsageError
from borecheck.geometry.mesh.triangle_mesh import TriangleMesh
from borecheck.geometry.mesh_files.diagnosis import diagnose
from borecheck.geometry.mesh_files.frames import AS_IT_STANDS, spelt
from borecheck.geometry.mesh_files.obj import parse_obj
from borecheck.geometry.mesh_files.ply import parse_ply
from borecheck.geometry.mesh_files.polygons import RawMesh
from borecheck.geometry.mesh_files.stl import parse_stl, write_stl
from borecheck.geometry.mesh_files.units import guess_unit, unit_mistake

__all__ = [
    "MeshFile",
    "guess_unit",
    "read_mesh",
    "read_mesh_file",
    "read_mesh_in_unit",
    "stated_frame",
    "unit_mistake",
    "write_stl",
    "zero_area_triangles",
]

_PARSERS = {".stl": parse_stl, ".obj": parse_obj, ".ply": parse_ply}
_COLLADA = ".dae"  # its parser is imported only when such a file comes
FORMATS = (*_PARSERS, _COLLADA)
# Formats of whole scenes, with transforms, units and up axes of their own.
_CONVERTED = (".glb", ".gltf", ".3mf")
# A damaged exponent makes coordinates like 1e38; products of three of them leave the
# range in which the contact tests are correct. No scanner room is a million km wide.
_LARGEST_M = 1e9


@dataclass(frozen=True, eq=False)
class MeshFile:
    """A mesh, and what its file says about how it is meant.

    Attributes:
        mesh: Its triangles, the numbers as they stand there times unit and scale.
        unit_m: Metres per unit as the file states it, applied; None if it does not.
        frame: The frame or up axis that the file states, not applied: "lps", "ras",
            "x-up", "y-up", "z-up", or another of Slicer's; None if it states none.
        frame_is_implied: The file states none, but its standard says which one holds.
        warnings: Harmless oddities that were read over.
    """

    mesh: TriangleMesh
    unit_m: float | None
    frame: str | None
    frame_is_implied: bool
    warnings: tuple[str, ...]

    @property
    def remarks(self) -> tuple[str, ...]:
        """What to say where the numbers are taken as they stand: a robot's mesh.

        ROS does not turn the meshes of a URDF, whatever up axis or frame they state:
        their placement there is written for the numbers.
        """
        if self.frame is None or self.frame == AS_IT_STANDS:
            return self.warnings
        verb = "implies" if self.frame_is_implied else "states"
        said = f"{verb} {spelt(self.frame)}, which is not applied, as in ROS"
        return (*self.warnings, said)


def read_mesh(path: Path, scale: float = 1.0, name: str | None = None) -> TriangleMesh:
    """The mesh in a file, its numbers times `scale`.

    Args:
        path: STL, OBJ, PLY or DAE file, told by its suffix.
        scale: Metres per unit of the file; Collada files state their own unit, which
            is applied before.
        name: What to call it; the file's name without suffix otherwise.

    Raises:
        MeshError: The file is missing, not readable, damaged, not a mesh, or has no
            triangles, vertices that are not finite, or indices out of range.
        UsageError: The scale is not a positive number.
    """
    return read_mesh_file(path, scale, name).mesh


def read_mesh_file(path: Path, scale: float = 1.0, name: str | None = None) -> MeshFile:
    """As `read_mesh`, with what the file states about unit and frame."""
    path = Path(path)
    if not (math.isfinite(scale) and scale > 0.0):
        raise UsageError(f"mesh scale {scale} is not a positive number")
    raw = _parse(path)
    with np.errstate(over="ignore", invalid="ignore"):
        vertices = raw.vertices if scale == 1.0 else raw.vertices * scale
    _check(vertices, raw.triangles, path)
    mesh = TriangleMesh(name or path.stem, vertices, raw.triangles)
    return MeshFile(mesh, raw.unit_m, raw.frame, raw.frame_is_implied, raw.warnings)


def read_mesh_in_unit(
    path: Path, unit: str | None = None, name: str | None = None
) -> TriangleMesh:
    """The mesh in a file whose numbers are in `unit` (None: metres).

    Raises:
        MeshError: As `read_mesh`.
        UsageError: No such unit of length.
    """
    if unit is not None and unit not in LENGTH_UNITS:
        raise UsageError(
            f"mesh unit {unit!r} is no length (known: {', '.join(LENGTH_UNITS)})"
        )
    return read_mesh(path, LENGTH_UNITS[unit or "m"], name)


def stated_frame(path: Path) -> str | None:
    """The frame or up axis that a mesh file states or, as Collada, implies.

    Returns:
        "lps", "ras", "x-up", "y-up", "z-up", another word of its header, or None.

    Raises:
        MeshError: As `read_mesh`.
    """
    return _parse(Path(path)).frame


def zero_area_triangles(mesh: TriangleMesh) -> NDArray[np.int64]:
    """Numbers of the triangles whose float64 cross product is exactly zero.

    They are kept in the mesh (a needle's tip may be one) and count in contact.
    """
    a, b, c = (mesh.corners[:, k] for k in range(3))
    area_is_zero = (np.cross(b - a, c - a) == 0.0).all(axis=1)
    return np.flatnonzero(area_is_zero).astype(np.int64)


def unread_format(suffix: str) -> str | None:
    """Why files that end so are not read, and what to do; None where they are.

    Args:
        suffix: In lower case, with its point.
    """
    if suffix in FORMATS:
        return None
    problem = f"no mesh format is known by {suffix!r} ({', '.join(FORMATS)})"
    if suffix in _CONVERTED:
        how = f"trimesh.load({f'x{suffix}'!r}, force='mesh').export('x.stl')"
        problem += f": convert it, for example by {how}, and state its unit"
    return problem


def _parse(path: Path) -> RawMesh:
    suffix = path.suffix.lower()
    data = _content(path)
    problem = unread_format(suffix)
    if problem is not None:
        raise MeshError(path, problem)
    if suffix == _COLLADA:
        from borecheck.geometry.mesh_files.collada import parse_collada

        parse = parse_collada
    else:
        parse = _PARSERS[suffix]
    try:
        return parse(data, path)
    except MeshError as error:
        really = diagnose(data, suffix)
        if really is None:
            raise
        raise MeshError(path, f"is {really}") from error


def _content(path: Path) -> bytes:
    try:
        mode = path.stat().st_mode
        if path.is_dir():
            raise MeshError(path, "is a directory, not a mesh file")
        if not S_ISREG(mode):  # a pipe would wait for ever
            raise MeshError(path, "is not a regular file")
        data = path.read_bytes()
    except FileNotFoundError as error:
        raise MeshError(path, "there is no such file") from error
    except PermissionError as error:
        raise MeshError(path, "no permission to read it") from error
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or error
        raise MeshError(path, f"cannot be read: {reason}") from error
    if not data:
        raise MeshError(path, "is empty")
    return data


def _check(
    vertices: NDArray[np.float64], triangles: NDArray[np.int64], path: Path
) -> None:
    if len(triangles) == 0:
        raise MeshError(path, f"holds no triangles ({len(vertices)} vertices)")
    outside = (triangles < 0) | (triangles >= len(vertices))
    if outside.any():
        k = int(np.argmax(outside)) // 3
        raise MeshError(path, "names a vertex that is not there", f"triangle {k}")
    with np.errstate(invalid="ignore"):
        wild = ~(np.abs(vertices) <= _LARGEST_M).all(axis=1)
    if wild.any():
        vertex = int(np.flatnonzero(wild)[0])
        user = np.flatnonzero(triangles == vertex) // 3
        where = f"triangle {user[0]}" if len(user) else f"vertex {vertex}"
        is_finite = bool(np.isfinite(vertices[vertex]).all())
        problem = "is beyond every room" if is_finite else "is not finite"
        values = ", ".join(f"{v:g}" for v in vertices[vertex])
        raise MeshError(path, f"vertex ({values}) {problem}", where)
