"""From standing to lying: back level and flat on the couch, belly settled, girths.

All are smooth maps of space, one to one, so that what did not touch does not after.
Their amounts are assumed; CT of the abdomen shows backs flat over half their width.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter1d
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components
from scipy.spatial import ConvexHull

Array = NDArray[np.float64]

STEP = 0.01  # of stations along the body, [m]
SMOOTH = 0.05  # of the back's profile, [m]
FLAT = 0.13  # of the local depth is pressed flat
PRESSED = 0.15  # what is left of that
SETTLED = 0.10  # of the belly's depth goes sideways

# Stations as shares of the stature from the soles: the waist is that of MakeHuman, the
# others are assumed.
WAIST, HIP, CHEST = 0.607, 0.515, 0.72


@dataclass(frozen=True)
class Stature:
    """Where soles and crown are on the body's axis, [m]."""

    sole: float
    crown: float

    def at(self, share: float) -> float:
        """The station that far up."""
        return self.sole + share * (self.crown - self.sole)


def levelled(skin: Array, trunk: NDArray[np.bool_]) -> tuple[Array, Array]:
    """The skin with the back level along the body, and how much of it is pressed.

    Returns:
        The points, the back's lowest line at z = 0, and the height below which each is
        pressed, [m].
    """
    x, low, high = _profile(skin[trunk])
    level = skin.copy()
    level[:, 2] -= np.interp(skin[:, 0], x, low)
    return level, FLAT * np.interp(skin[:, 0], x, high - low)


def lie_down(skin: Array, trunk: NDArray[np.bool_], stature: Stature) -> Array:
    """The skin on a flat couch at z = 0.

    Args:
        skin: (n, 3), x superior, z anterior, [m].
        trunk: Which points are no arm's.
        stature: Its ends.
    """
    lain, edge = levelled(skin, trunk)
    z = lain[:, 2]
    lain[:, 2] = np.where(z < edge, PRESSED * z, z - (1.0 - PRESSED) * edge)
    settled = SETTLED * _bump(skin[:, 0], stature.at(0.60), 0.10 * _length(stature))
    lain[:, 2] *= 1.0 - settled
    lain[:, 1] /= 1.0 - settled
    lain[:, 2] -= lain[:, 2].min()
    return lain


def widened(skin: Array, stature: Stature, ratios: dict[float, float]) -> Array:
    """The skin with its girths at stations multiplied, smoothly between."""
    shares = sorted(ratios)
    # nothing changes at neck and knees
    at = [stature.at(s) for s in (0.30, *shares, 0.84)]
    steps = np.arange(at[0] - 0.5, at[-1] + 0.6, STEP)
    there = np.interp(steps, at, [1.0, *(ratios[s] for s in shares), 1.0])
    there = gaussian_filter1d(there, 0.03 / STEP)
    factor = np.interp(skin[:, 0], steps, there)
    return skin * np.column_stack([np.ones_like(factor), factor, factor])


def girth(
    skin: Array,
    triangles: NDArray[np.int64],
    trunk: NDArray[np.bool_],
    station: float,
) -> float:
    """Length of a tape round the trunk at a station, [m]."""
    kept = triangles[trunk[triangles].all(axis=1)]
    edges = np.concatenate([kept[:, [0, 1]], kept[:, [1, 2]], kept[:, [2, 0]]])
    a, b = skin[edges[:, 0]], skin[edges[:, 1]]
    cut = (a[:, 0] - station) * (b[:, 0] - station) < 0.0
    a, b = a[cut], b[cut]
    t = ((station - a[:, 0]) / (b[:, 0] - a[:, 0]))[:, None]
    return float(ConvexHull((a + t * (b - a))[:, 1:]).area)  # a perimeter, in 2-D


def girth_of_solid(
    vertices: Array, triangles: NDArray[np.int64], station: float
) -> float:
    """A tape round the largest of the pieces that a closed surface is cut into, [m].

    Arms beside the trunk are pieces of their own.
    """
    ahead = vertices[:, 0] > station
    cut = triangles[ahead[triangles].any(axis=1) & ~ahead[triangles].all(axis=1)]
    edges = np.stack([cut, np.roll(cut, -1, axis=1)], axis=2)
    crossed = ahead[edges[..., 0]] != ahead[edges[..., 1]]  # two of each triangle
    ends = np.sort(edges[crossed], axis=1)
    unique, index = np.unique(ends, axis=0, return_inverse=True)
    pairs = index.reshape(-1, 2)
    links = coo_matrix((np.ones(len(pairs)), pairs.T), shape=(len(unique),) * 2)
    count, piece = connected_components(links, directed=False)
    a, b = vertices[unique[:, 0]], vertices[unique[:, 1]]
    t = ((station - a[:, 0]) / (b[:, 0] - a[:, 0]))[:, None]
    points = (a + t * (b - a))[:, 1:]
    hulls = [ConvexHull(points[piece == k]) for k in range(count)]
    return float(max(hulls, key=lambda hull: hull.volume).area)


def _profile(points: Array) -> tuple[Array, Array, Array]:
    """Stations, and the lowest and highest point at each, smoothed."""
    first = points[:, 0].min()
    bins = ((points[:, 0] - first) / STEP).astype(int)
    count = bins.max() + 1
    low, high = np.full(count, np.inf), np.full(count, -np.inf)
    np.minimum.at(low, bins, points[:, 2])
    np.maximum.at(high, bins, points[:, 2])
    known = np.isfinite(low)
    x = first + STEP * (np.arange(count) + 0.5)
    low = np.interp(x, x[known], low[known])
    high = np.interp(x, x[known], high[known])
    width = SMOOTH / STEP
    return (
        x,
        gaussian_filter1d(low, width, mode="nearest"),
        gaussian_filter1d(high, width, mode="nearest"),
    )


def _bump(x: Array, centre: float, width: float) -> Array:
    return np.exp(-0.5 * ((x - centre) / width) ** 2)


def _length(stature: Stature) -> float:
    return stature.crown - stature.sole
