"""Points of a part that prove contact for a whole cell of directions.

At a station that every direction of a cell visits, a point of a part moves from the
centre's pose by no more than the chart's bound b (and the target's error). If it lies
in a closed obstacle, deeper than b below its surface, it is in the obstacle for every
direction: the surfaces meet, or one holds the other. If it lies nearer to the surface
than the margin less b, the part comes within the margin for every direction.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from borecheck.core.once import once_per_record
from borecheck.directions.questions import RESERVE, Cells
from borecheck.directions.setup import MapSetup
from borecheck.geometry.mesh.triangle_mesh import TriangleMesh
from borecheck.geometry.surfaces import surface
from borecheck.geometry.tree.many_links import MovingLinks
from borecheck.geometry.tree.mesh_tree import MeshTree
from borecheck.geometry.tree.packed import PackedTrees
from borecheck.geometry.tree.rays import windings

Array = NDArray[np.float64]
Ids = NDArray[np.int64]
Bools = NDArray[np.bool_]

# Points are taken along edges so far apart, [m], and thinned to so many.
SPACING = 0.02
MOST_POINTS = 200


@once_per_record
def points_of(mesh: TriangleMesh) -> Array:
    """The points of a part that are tried, spread over its surface, (n, 3), [m].

    Of a round shape they are on the polyhedron within it.
    """
    corners = mesh.inner.corners
    edges = np.concatenate([corners[:, [0, 1]], corners[:, [1, 2]], corners[:, [2, 0]]])
    along = edges[:, 1] - edges[:, 0]
    pieces = np.linalg.norm(along, axis=1) / SPACING
    points = [corners.reshape(-1, 3), corners.mean(axis=1)]
    for k in range(1, min(int(pieces.max()) + 1, MOST_POINTS)):
        long = pieces > k
        points.append(edges[long, 0] + (k / pieces[long])[:, None] * along[long])
    return _thinned(np.concatenate(points))


def _thinned(points: Array) -> Array:
    """One point of every cube of a grid that is as fine as their number allows."""
    spacing = 0.1 * SPACING
    while True:
        cubes = np.floor(points / spacing).astype(np.int64)
        _, first = np.unique(cubes, axis=0, return_index=True)
        if len(first) <= MOST_POINTS:
            return points[np.sort(first)]
        spacing *= 1.3


@dataclass(frozen=True, eq=False)
class Candidates:
    """Where contact is looked for: a part and an obstacle at a station of a cell.

    Attributes:
        cell: Which cell, (k,).
        part: Which part.
        obstacle: Which obstacle.
        station: Where every direction of the cell brings the part, [m].
    """

    cell: Ids
    part: Ids
    obstacle: Ids
    station: Array


class Witnesses:
    """Finds points of parts that are deep in obstacles.

    Args:
        setup: The map's.
    """

    def __init__(self, setup: MapSetup) -> None:
        self._setup = setup
        self._obstacles: dict[int, MovingLinks] = {}

    def prove(self, cells: Cells, asked: Candidates) -> Ids:
        """The point of the part that proves contact, or -1, of each candidate, (k,)."""
        found = np.full(len(asked.cell), -1)
        for part, obstacle in {
            (int(a), int(b)) for a, b in zip(asked.part, asked.obstacle, strict=True)
        }:
            rows = np.flatnonzero((asked.part == part) & (asked.obstacle == obstacle))
            found[rows] = self._prove(cells, asked, rows, part, obstacle)
        return found

    def _prove(
        self, cells: Cells, asked: Candidates, rows: Ids, part: int, obstacle: int
    ) -> Ids:
        points = points_of(self._setup.robot.parts[part].mesh)
        every = np.broadcast_to(points, (len(rows), *points.shape))
        proven = self._deep(cells, asked, rows, part, obstacle, every)
        return np.where(proven.any(axis=1), proven.argmax(axis=1), -1)

    def _deep(
        self,
        cells: Cells,
        asked: Candidates,
        rows: Ids,
        part: int,
        obstacle: int,
        points: Array,
    ) -> Bools:
        """Which points (k, n, 3) of a part are proven in or at the obstacle, (k, n)."""
        setup = self._setup
        cell = asked.cell[rows]
        link = setup.robot.parts[part].link
        own = setup.chart.own(cells.angles[cell], asked.station[rows])
        T = setup.chart.place(part, setup.chart.in_urdf(own))
        at = points @ T[:, :3, :3].transpose(0, 2, 1) + T[:, None, :3, 3]
        bound = setup.chart.displacements(link, at, own, cells.half[cell])
        if not setup.chart.stands(link):
            bound = bound + setup.asked.target_error
        bound = bound * (1.0 + 1e-12) + RESERVE
        mesh = setup.scene.obstacles[obstacle].mesh.inner
        spare = setup.asked.margin - bound
        low, high = mesh.bounds
        grow = np.maximum(spare, 0.0)[..., None]
        maybe = ((at >= low - grow) & (at <= high + grow)).all(axis=2)
        flat = np.flatnonzero(maybe)
        proven = np.zeros(maybe.size, np.bool_)
        if len(flat):
            there = at.reshape(-1, 3)[flat]
            proven[flat] = self._is_deep(obstacle, there, spare.ravel()[flat])
        return proven.reshape(maybe.shape)

    def _is_deep(self, obstacle: int, at: Array, spare: Array) -> Bools:
        """Whether points (n, 3) are deeper than -spare, or nearer than spare, (n,)."""
        mesh = self._setup.scene.obstacles[obstacle].mesh.inner
        inside = np.zeros(len(at), np.bool_)
        if surface(mesh).topology.is_closed:
            tree = surface(mesh).tree
            of_tree = tree.nodes, tree.frames, tree.depth, tree.corners
            inside = windings(at, *of_tree) != 0
        proven = inside & (spare > 0.0)
        # what is inside may be deep enough, what is outside near enough
        asked = np.flatnonzero(inside ^ (spare > 0.0))
        if len(asked):
            lengths = np.abs(spare[asked]) + RESERVE
            T = np.tile(np.eye(4), (len(asked), 1, 1, 1))
            T[:, 0, :3, 3] = at[asked]
            least = float(lengths.min())
            bounds = self._tree(obstacle).farther_than(T, lengths[:, None], least)[:, 0]
            deep = inside[asked] & (bounds[:, 0] > lengths)
            near = ~inside[asked] & (bounds[:, 1] <= spare[asked])
            proven[asked] = deep | near
        return proven

    def _tree(self, obstacle: int) -> MovingLinks:
        """A point against an obstacle."""
        if obstacle not in self._obstacles:
            mesh = self._setup.scene.obstacles[obstacle].mesh.inner
            self._obstacles[obstacle] = MovingLinks.against(
                PackedTrees([_point]), PackedTrees([surface(mesh).tree])
            )
        return self._obstacles[obstacle]


_point = MeshTree(np.zeros((3, 3)), np.array([[0, 1, 2]]), cached=False)
