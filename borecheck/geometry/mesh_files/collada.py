"""Collada files, 1.4 and 1.5: all surfaces of the scene, or a refusal by name.

The unit of the file is applied, so the result is in metres. The up axis is not:
viewers and collision libraries disagree on turning it, and the placement in a URDF
is written for the numbers as they stand. `collada_conventions` tells both.
"""

from os import PathLike

import numpy as np

from borecheck.errors import MeshError
from borecheck.geometry.mesh_files.collada_document import read_document
from borecheck.geometry.mesh_files.collada_scene import (
    scene_corners,
    unplaced_geometries,
)
from borecheck.geometry.mesh_files.polygons import RawMesh

File = str | PathLike[str]


def collada_conventions(data: bytes, file: File) -> tuple[float, str]:
    """Metres per unit and the up axis ("Y_UP" when unsaid, by the standard).

    Raises:
        MeshError: No Collada, or a unit or an up axis that is none.
    """
    document = read_document(data, file)
    return document.metres, document.up_axis


def parse_collada(data: bytes, file: File) -> RawMesh:
    """All triangles of the scene, in metres, in the order of its nodes.

    Raises:
        MeshError: No Collada, damaged, or it carries or moves a surface in a way that
            is not read here.
    """
    document = read_document(data, file)
    metres, frame = document.metres, document.up_axis.lower().replace("_", "-")
    corners = scene_corners(document)
    if not len(corners):
        raise MeshError(file, "holds no triangles")
    with np.errstate(over="ignore", invalid="ignore"):
        vertices = corners.reshape(-1, 3) * metres
    lost = unplaced_geometries(document)
    said = f"{len(lost)} of its geometries are in no node of its scene: {lost[:3]}"
    return RawMesh(
        vertices,
        np.arange(len(vertices)).reshape(-1, 3),
        frame=frame,
        frame_is_implied=not document.states_up_axis,
        unit_m=metres if document.states_unit else None,
        warnings=(*document.warnings, said) if lost else document.warnings,
    )
