"""Collada files through trimesh (1.6 s to import: only when such a file comes).

The unit of the file is applied, so the result is in metres. The up axis is not:
viewers and collision libraries disagree on turning it, and the placement in a URDF
is written for the numbers as they stand. `collada_conventions` tells both.
"""

import re
from os import PathLike

import numpy as np

from borecheck.errors import MeshError
from borecheck.geometry.mesh_files.polygons import RawMesh

File = str | PathLike[str]

_UNIT = re.compile(rb"<unit\b[^>]*\bmeter\s*=\s*[\"']([^\"']*)[\"']")
_UP_AXIS = re.compile(rb"<up_axis>\s*([XYZ]_UP)\s*</up_axis>")


def collada_conventions(data: bytes, file: File) -> tuple[float, str]:
    """Metres per unit and the up axis ("Y_UP" when unsaid, by the standard).

    Raises:
        MeshError: The unit is no positive number.
    """
    unit = _UNIT.search(data)
    up_axis = _UP_AXIS.search(data)
    try:
        metres = float(unit[1]) if unit else 1.0
    except ValueError:
        metres = np.nan
    if not (np.isfinite(metres) and metres > 0.0):
        raise MeshError(file, "states a unit that is no positive number of metres")
    return metres, up_axis[1].decode() if up_axis else "Y_UP"


def states_unit(data: bytes) -> bool:
    """Whether the file says its unit; by the standard it is metres when unsaid."""
    return _UNIT.search(data) is not None


def parse_collada(data: bytes, file: File) -> RawMesh:
    """All triangles of the scene, in metres, in the order of its nodes.

    Raises:
        MeshError: No Collada, damaged, or trimesh cannot read it.
    """
    if b"<!DOCTYPE" in data or b"<!ENTITY" in data:
        raise MeshError(file, "defines its own XML entities, which is refused")
    metres, _ = collada_conventions(data, file)
    vertices: list[np.ndarray[tuple[int, ...], np.dtype[np.float64]]] = []
    triangles: list[np.ndarray[tuple[int, ...], np.dtype[np.int64]]] = []
    n_vertices = 0
    for points, faces in _parts(data, file):
        vertices.append(points * metres)
        triangles.append(faces + n_vertices)
        n_vertices += len(points)
    if not triangles:
        raise MeshError(file, "holds no triangles")
    return RawMesh(np.concatenate(vertices), np.concatenate(triangles))


def _parts(
    data: bytes, file: File
) -> list[
    tuple[
        np.ndarray[tuple[int, ...], np.dtype[np.float64]],
        np.ndarray[tuple[int, ...], np.dtype[np.int64]],
    ]
]:
    from io import BytesIO

    import trimesh

    try:
        scene = trimesh.load_scene(
            BytesIO(_without_looks(data)),
            file_type="dae",
            process=False,
            ignore_broken=False,
        )
        parts = []
        for node in scene.graph.nodes_geometry:
            T, name = scene.graph[node]
            mesh = scene.geometry[name]
            if not isinstance(mesh, trimesh.Trimesh):
                continue  # lines and points touch nothing
            points = np.asarray(mesh.vertices, dtype=np.float64)
            points = points @ T[:3, :3].T + T[:3, 3]
            parts.append((points, np.asarray(mesh.faces, dtype=np.int64)))
    except Exception as error:  # lxml, pycollada, numpy, trimesh: anything
        reason = " ".join(str(error).split())[:120] or type(error).__name__
        raise MeshError(file, f"cannot be read as Collada: {reason}") from error
    return parts


def _without_looks(data: bytes) -> bytes:
    """The file without materials: a missing texture is no reason to refuse a shape.

    Broken references must stay errors, or trimesh would leave out geometry in silence.
    """
    from lxml import etree

    parser = etree.XMLParser(resolve_entities=False, no_network=True)
    root = etree.fromstring(data, parser)
    looks = {f"library_{kind}" for kind in ("images", "effects", "materials")}
    looks.add("bind_material")
    for element in list(root.iter("{*}*")):
        parent = element.getparent()
        if parent is not None and etree.QName(element).localname in looks:
            parent.remove(element)
    return bytes(etree.tostring(root))
