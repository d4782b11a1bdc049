"""From a scan to an obstacle that provably contains the patient.

The recipe: tissue in cells that hold every voxel of it; couch and specks out; what was
cut carried on; a closed surface around all at about twice a voxel; simplified; and the
result proven on the skin at full resolution. If the proof fails the surface is
simplified less, and where that does not help either the scan is refused.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from borecheck.core.patient_frame import scanner_from_patient
from borecheck.geometry.mesh.triangle_mesh import TriangleMesh
from borecheck.patients.beyond import Extended, extended
from borecheck.patients.body import Body, body_of
from borecheck.patients.edges import Cut, cuts_of
from borecheck.patients.fine_skin import SkinSlab, skin_slabs
from borecheck.patients.motion import COVER, Motion, swept
from borecheck.patients.offset_surface import offset_level, simplified, surface_around
from borecheck.patients.proof import Proof, prove
from borecheck.patients.raster import Raster, rasterised
from borecheck.patients.volume import Array, Volume, VolumeError

Triangles = NDArray[np.int64]
Progress = Callable[[str, int, int], None]

EXTENSION_MM = 50.0

# Offset as a share of the usual one, and simplification as a share of the usual: what
# is tried while the proof fails.
_TRIES = ((1.0, 1.0), (1.0, 0.5), (1.3, 0.5), (1.7, 0.3))
# Cells below that size are taken two by two for the surface, [mm].
_FINE_CELL_MM = 2.1
# Simplification of surfaces on one or on two cells, [mm].
_TOLERANCES_MM = {1: 0.85, 2: 1.1}
# Of scans up to that size the skin is made once.
_KEPT_VOXELS = 30_000_000


@dataclass(frozen=True)
class Wishes:
    """What the user asks for.

    Attributes:
        extension: How far the body goes on where the scan cuts it, [mm].
        motions: Ways in which the body may move, or be covered.
        couch: Whether a couch is looked for and taken out.
        up: Away from the couch, in LPS, unit; None: as the scan says that the patient
            lies, on the back if it does not.
    """

    extension: float = EXTENSION_MM
    motions: tuple[Motion, ...] = ()
    couch: bool = True
    up: tuple[float, float, float] | None = None

    def up_of(self, volume: Volume) -> Array:
        """Away from the couch, in LPS, (3,)."""
        if self.up is not None:
            return np.array(self.up)
        R_scanner_lps = scanner_from_patient("LPS", volume.position or "HFS")
        return np.asarray(R_scanner_lps.T @ np.array([0.0, 0.0, 1.0]))


@dataclass(frozen=True, eq=False)
class PatientObstacle:
    """A patient as an obstacle.

    Attributes:
        mesh: Closed surface, in the frame of `T_frame_lps`, [m].
        assumed: Triangles that continue the body beyond the scan, (m,).
        proof: That it contains the skin.
        cuts: Edges of the scan at which the body is cut.
        body: What was kept and removed.
        volume: The scan.
        wishes: What was asked for.
    """

    mesh: TriangleMesh
    assumed: NDArray[np.bool_]
    proof: Proof
    cuts: tuple[Cut, ...]
    body: Body = field(repr=False)
    volume: Volume = field(repr=False)
    wishes: Wishes = field(default_factory=Wishes)

    @property
    def notes(self) -> tuple[str, ...]:
        """What the user should know, the scan's own notes first."""
        volume, length = self.volume, self.wishes.extension
        lines = [*volume.notes, *(cut.told for cut in self.cuts)]
        if self.cuts:
            lines.append(
                f"where the scan cuts the body it is carried on by {length:g} mm "
                f"({int(self.assumed.sum())} triangles): assumed, not seen"
            )
        lines.append(
            f"the obstacle is at least {1e3 * self.proof.gap:.1f} mm outside the skin: "
            "a plan's entry belongs on the obstacle, not on the skin"
        )
        lines += [motion.told for motion in self.wishes.motions]
        lines += [f"removed: {one}" for one in _removed(self.body)]
        return (*lines, *self.not_modelled)

    @property
    def not_modelled(self) -> tuple[str, ...]:
        """What the obstacle does not hold."""
        covered = any(motion.kind == COVER for motion in self.wishes.motions)
        if covered:
            return ()
        return ("blankets and hair, which X-rays do not see (--cover adds room)",)

    def to_json(self) -> dict[str, Any]:
        """Parts of the result."""
        return {
            "volume": self.volume.to_json(),
            "dropped": list(self.volume.dropped),
            "components": [one.to_json() for one in self.body.components],
            "cuts": [cut.to_json() for cut in self.cuts],
            "extension_m": self.wishes.extension / 1e3 if self.cuts else 0.0,
            "proof": self.proof.to_json(),
        }


def patient_obstacle(
    volume: Volume,
    T_frame_lps: Array,
    wishes: Wishes | None = None,
    progress: Progress | None = None,
) -> PatientObstacle:
    """The obstacle of a scan.

    Args:
        volume: The scan.
        T_frame_lps: Where its coordinates lie in the frame that is wanted, (4, 4), [m].
        wishes: Extension, motions; None: the usual ones.
        progress: Called with what is done, how far, and of how much.

    Raises:
        VolumeError: There is no body in it, or no surface could be proven.
    """
    asked = Wishes() if wishes is None else wishes
    shown = progress or (lambda _what, _done, _total: None)
    raster = rasterised(volume, lambda done, total: shown("slices", done, total))
    _refuse_empty(volume, raster)
    up = asked.up_of(volume)
    body = body_of(raster, -volume.axes @ up if asked.couch else None)
    cuts = cuts_of_body(volume, body)
    whole = extended(volume, body.raster, asked.extension if cuts else 0.0)
    whole = swept(whole, [(one.way(volume, up), one) for one in asked.motions])
    T_frame_axes = T_frame_lps[:3, :3] @ volume.axes.T
    shift = T_frame_lps[:3, 3]

    def placed(points: Array) -> Array:
        return points / 1e3 @ T_frame_axes.T + shift

    skin = _Skin(volume, body)

    def slabs() -> Iterator[tuple[Array, Triangles, int]]:
        for slab in skin.slabs():
            yield placed(slab.vertices), slab.triangles, slab.done

    coarser = 2 if float(raster.size.max()) <= _FINE_CELL_MM else 1
    for wider, share in _TRIES:
        level = offset_level(volume, raster) * wider
        # what moves is swept in cells, and has no skin of its own
        near = None if asked.motions else (slab.vertices for slab in skin.slabs())
        points, triangles = surface_around(whole, level, near, coarser)
        mesh = simplified(points, triangles, share * _TOLERANCES_MM[coarser])
        if mesh is None:
            continue
        assumed = _assumed(mesh, whole)
        outer = _as_written(placed(mesh.vertices), mesh.triangles)
        proof = prove(
            outer,
            assumed,
            slabs(),
            level / 1e3,
            lambda done: shown("proof", done, volume.slices),
        )
        if proof is not None:
            return PatientObstacle(outer, assumed, proof, cuts, body, volume, asked)
    raise VolumeError(volume.file, "no surface around it could be proven to contain it")


class _Skin:
    """The skin's slabs; those of a small scan are kept for the proof."""

    def __init__(self, volume: Volume, body: Body) -> None:
        self._volume, self._body = volume, body
        voxels = volume.slices * volume.rows * volume.columns
        self._kept: list[SkinSlab] | None = None
        self._keeps = voxels <= _KEPT_VOXELS

    def slabs(self) -> Iterator[SkinSlab]:
        """All of them, read again unless they are kept."""
        if self._kept is not None:
            yield from self._kept
            return
        kept = []
        for slab in skin_slabs(self._volume, self._body):
            if self._keeps:
                kept.append(slab)
            yield slab
        if self._keeps:
            self._kept = kept


def cuts_of_body(volume: Volume, body: Body) -> tuple[Cut, ...]:
    """Edges of the scan at which the body that was kept is cut."""
    raster = body.raster
    masks = (raster.cells[raster.at(volume, k)] for k in range(volume.slices))
    return cuts_of(volume, masks)


def _refuse_empty(volume: Volume, raster: Raster) -> None:
    if not raster.cells.any():
        raise VolumeError(volume.file, "holds no tissue: everything is air")
    if raster.cells.all():
        raise VolumeError(volume.file, "holds no air: its numbers are no CT of a body")


def _assumed(mesh: TriangleMesh, whole: Extended) -> NDArray[np.bool_]:
    """Triangles with a corner that is nearer to the continuation than to the body."""
    if not whole.assumed.any():
        return np.zeros(len(mesh.triangles), dtype=bool)
    seen = whole.raster.cells & ~whole.assumed
    to_assumed = _distances(whole.raster.with_cells(whole.assumed), mesh.vertices)
    to_seen = _distances(whole.raster.with_cells(seen), mesh.vertices)
    corners = (to_assumed < to_seen)[mesh.triangles]
    return np.asarray(corners.any(axis=1))


def _distances(raster: Raster, points: Array) -> Array:
    """Distances of points from the nearest cell's centre, [mm]."""
    from scipy import ndimage

    cells = raster.cells
    w, v, u = np.nonzero(cells & ~ndimage.binary_erosion(cells))
    centres = raster.low + raster.size * (np.stack([u, v, w], axis=1) + 0.5)
    found, _ = cKDTree(centres).query(points)
    return np.asarray(found)


def _as_written(vertices: Array, triangles: Triangles) -> TriangleMesh:
    """The mesh as an STL file holds it, so that what is proven is what is written."""
    return TriangleMesh("patient", vertices.astype("<f4").astype(np.float64), triangles)


def _removed(body: Body) -> list[str]:
    return [
        f"{'couch' if one.kind == 'couch' else f'{one.pieces} specks'}, "
        f"{one.volume / 1e3:.3g} cm3"
        for one in body.components
        if one.kind != "kept"
    ]
