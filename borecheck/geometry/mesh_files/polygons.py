"""Faces of any number of corners as triangles, in the order of the file."""

from dataclasses import dataclass
from os import PathLike

import numpy as np
from numpy.typing import NDArray

from borecheck.errors import MeshError
from borecheck.geometry.mesh_files.ears import cut_ears

Array = NDArray[np.float64]
Ids = NDArray[np.int64]

# A fan triangle may point against its face by this share of the face's area before
# the face counts as not convex: rounded coordinates of planar faces stay far below.
_BACKWARD_SHARE = 1e-6
_MOST_CUT = 50_000  # corners of faces cut by their ears, 30 to 100 us each


@dataclass(frozen=True, eq=False)
class RawMesh:
    """What a mesh file says, before any unit: nothing checked but its syntax.

    Attributes:
        vertices: Points in the unit of the file, (n, 3).
        triangles: Vertex indices, (m, 3); may still be out of range.
        unit_m: Metres per unit as the file states it; it is applied to `vertices`.
        frame: The frame or up axis that the file states ("lps", "y-up" ...).
        frame_is_implied: It says none, and its standard says which one then holds.
        warnings: Harmless oddities of the file.
    """

    vertices: Array
    triangles: Ids
    unit_m: float | None = None
    frame: str | None = None
    frame_is_implied: bool = False
    warnings: tuple[str, ...] = ()


def fan(
    vertices: Array,
    counts: Ids,
    indices: Ids,
    file: str | PathLike[str],
) -> Ids:
    """Triangles (first, k, k+1) of every face, in file order.

    A fan covers a face that is not seen whole from its first corner wrongly, and a
    surface that is not there hides or invents contacts: such a face is cut by its ears.

    Args:
        vertices: Points, (n, 3).
        counts: Corners of each face, (f,).
        indices: The corners of all faces, one after the other, (counts.sum(),).
        file: Named in errors.

    Raises:
        MeshError: A face with fewer than three corners, an index out of range, or a
            face whose outline crosses itself.
    """
    if len(counts) == 0:
        return np.zeros((0, 3), dtype=np.int64)
    if counts.min() < 3:
        face = int(np.argmin(counts))
        raise MeshError(file, f"{counts[face]} corners, not 3 or more", f"face {face}")
    starts = np.cumsum(counts) - counts
    wrong = np.flatnonzero((indices < 0) | (indices >= len(vertices)))
    if len(wrong):
        face = int(np.searchsorted(starts, wrong[0], side="right")) - 1
        raise MeshError(
            file,
            f"names vertex {indices[wrong[0]]} (counted from 0), but there are "
            f"{len(vertices)}",
            f"face {face}",
        )
    face_of = np.repeat(np.arange(len(counts)), counts - 2)
    first_of = np.cumsum(counts - 2) - (counts - 2)
    step = np.arange(len(face_of)) - first_of[face_of]
    first = starts[face_of]
    triangles = indices[np.stack([first, first + step + 1, first + step + 2], axis=1)]
    if counts.max() > 3:
        not_covered = _not_covered(vertices[triangles], face_of, len(counts))
        if int(counts[not_covered].sum()) > _MOST_CUT:
            raise MeshError(file, "too many faces that bend inwards: export triangles")
        for face in not_covered:
            corners = indices[starts[face] : starts[face] + counts[face]]
            ears = cut_ears(vertices[corners])
            if ears is None:
                raise MeshError(
                    file,
                    "an outline that crosses itself is no surface: export triangles",
                    f"face {face}",
                )
            triangles[face_of == face] = corners[np.array(ears)]
    return triangles


def _not_covered(corners: Array, face_of: Ids, n_faces: int) -> Ids:
    """Faces of which some fan triangle points against the whole, or all cancel out."""
    with np.errstate(all="ignore"):  # NaN and huge numbers are reported later
        normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        whole = np.zeros((n_faces, 3))
        np.add.at(whole, face_of, normals)
        along = np.einsum("ij,ij->i", normals, whole[face_of])
        backward = along < -_BACKWARD_SHARE * (whole[face_of] ** 2).sum(axis=1)
        parts = np.bincount(face_of, np.linalg.norm(normals, axis=1), n_faces)
        nothing_left = np.linalg.norm(whole, axis=1) < _BACKWARD_SHARE * parts
    return np.union1d(face_of[backward], np.flatnonzero(nothing_left))
