"""Faces of any number of corners as triangles, in the order of the file."""

from dataclasses import dataclass
from os import PathLike

import numpy as np
from numpy.typing import NDArray

from borecheck.errors import MeshError

# A fan triangle may point against its face by this share of the face's area before
# the face counts as not convex: rounded coordinates of planar faces stay far below.
_BACKWARD_SHARE = 1e-6


@dataclass(frozen=True, eq=False)
class RawMesh:
    """What a mesh file says, before any unit: nothing checked but its syntax.

    Attributes:
        vertices: Points in the unit of the file, (n, 3).
        triangles: Vertex indices, (m, 3); may still be out of range.
    """

    vertices: NDArray[np.float64]
    triangles: NDArray[np.int64]


def fan(
    vertices: NDArray[np.float64],
    counts: NDArray[np.int64],
    indices: NDArray[np.int64],
    file: str | PathLike[str],
) -> NDArray[np.int64]:
    """Triangles (first, k, k+1) of every face, in file order.

    A fan covers a face that is not seen whole from its first corner wrongly: such a
    face is refused, because a surface that is not there hides or invents contacts.

    Args:
        vertices: Points, (n, 3).
        counts: Corners of each face, (f,).
        indices: The corners of all faces, one after the other, (counts.sum(),).
        file: Named in errors.

    Raises:
        MeshError: A face with fewer than three corners, an index out of range, or a
            face of more than three corners that its fan does not cover.
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
        _check_fans(vertices[triangles], face_of, counts, file)
    return triangles


def _check_fans(
    corners: NDArray[np.float64],
    face_of: NDArray[np.int64],
    counts: NDArray[np.int64],
    file: str | PathLike[str],
) -> None:
    with np.errstate(all="ignore"):  # NaN and huge numbers are reported later
        normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        whole = np.zeros((len(counts), 3))
        np.add.at(whole, face_of, normals)
        along = np.einsum("ij,ij->i", normals, whole[face_of])
        backward = along < -_BACKWARD_SHARE * (whole[face_of] ** 2).sum(axis=1)
    wrong = np.flatnonzero(backward)
    if len(wrong):
        raise MeshError(
            file,
            "is not convex, so cutting it into triangles would be a guess: "
            "export triangles",
            f"face {face_of[wrong[0]]}",
        )
