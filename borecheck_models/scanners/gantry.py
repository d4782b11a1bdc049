"""Surfaces of a CT gantry, its stand and its couch.

The gantry is one closed surface around its bore: a grid of rings, from the throat
over the flared rear mouth, the rear cover, the outside, the front cover and the
flared front mouth back to the throat. Polygons of the bore lie *within* the true
circle, so a coarse bore is never wider than a fine one.
"""

from math import pi

import numpy as np
from numpy.typing import NDArray

from borecheck.plugin import TriangleMesh
from borecheck_models.shapes import Detail, box, lofted

Array = NDArray[np.float64]

FLARE_LENGTH = 0.12  # of a bore mouth along x [m], assumed
FLARE_WIDTH = 0.06  # by which a mouth is wider than the throat [m], assumed
HALF_WIDTH = 1.00  # housing along y [m], assumed
HALF_HEIGHT = (0.86, 0.92)  # below and above the isocentre [m], assumed
HOUSING_EXPONENT = 7.0  # a box with rounded corners, assumed
EDGE_RADIUS = 0.06  # between covers and outside [m], assumed

COUCH_X = (-1.85, 0.55)  # ends of the couch top at travel 0 [m], assumed
COUCH_HALF_WIDTH = 0.21  # assumed
COUCH_DEPTH = 0.06  # assumed


def gantry(radius: float, depth: float, around: int, edge: float) -> TriangleMesh:
    """The gantry's closed surface, bore along x, isocentre at the origin.

    Args:
        radius: Of the bore's throat, [m].
        depth: From front cover to rear cover, [m].
        around: Points around the bore, a multiple of 8.
        edge: Longest step from ring to ring, about, [m].
    """
    angles = np.arange(around, dtype=np.float64) * (2.0 * pi / around)
    circle = np.column_stack([np.cos(angles), np.sin(angles)])
    outline = circle * _housing_reach(angles)[:, None]
    half = _half_section(radius, depth / 2.0, circle, outline, edge)
    mirrored = [ring * (-1.0, 1.0, 1.0) for ring in reversed(half[1:-1])]
    return lofted(np.array([*half, *mirrored]))


def _half_section(
    radius: float, face: float, circle: Array, outline: Array, edge: float
) -> list[Array]:
    """Rings from mid-throat over the rear cover to the middle of the outside."""
    throat = face - FLARE_LENGTH
    rings = [_ring(x, radius * circle) for x in _run(0.0, throat, edge)]
    for a in _run(0.0, pi / 2.0, edge / FLARE_LENGTH, least=6):
        r = radius + FLARE_WIDTH * (1.0 - np.cos(a))
        rings.append(_ring(throat + FLARE_LENGTH * np.sin(a), r * circle))
    mouth = (radius + FLARE_WIDTH) * circle
    inset = outline * (1.0 - EDGE_RADIUS / np.linalg.norm(outline, axis=1)[:, None])
    span = float(np.linalg.norm(inset - mouth, axis=1).mean())
    for share in _run(0.0, 1.0, edge / span):
        rings.append(_ring(face, (1.0 - share) * mouth + share * inset))
    for a in _run(0.0, pi / 2.0, edge / EDGE_RADIUS, least=3):
        across = inset + np.sin(a) * (outline - inset)
        rings.append(_ring(face - EDGE_RADIUS * (1.0 - np.cos(a)), across))
    outside = [_ring(x, outline) for x in _run(face - EDGE_RADIUS, 0.0, edge)]
    return [*rings, *outside, _ring(0.0, outline)]


def _run(start: float, stop: float, step: float, least: int = 2) -> Array:
    """Even steps, `least` or more, from start up to, and without, stop."""
    count = max(least, round(abs(stop - start) / step))
    return np.linspace(start, stop, count, endpoint=False)


def _ring(x: float, across: Array) -> Array:
    return np.column_stack([np.full(len(across), x), across])


def _housing_reach(angles: Array) -> Array:
    """Distance from the bore's axis to the outside of the housing, [m]."""
    height: Array = np.where(np.sin(angles) < 0.0, *HALF_HEIGHT)
    share = np.abs(np.cos(angles)) / HALF_WIDTH, np.abs(np.sin(angles)) / height
    m = HOUSING_EXPONENT
    reach: Array = (share[0] ** m + share[1] ** m) ** (-1.0 / m)
    return reach


def stand(detail: Detail) -> list[TriangleMesh]:
    """Two pillars beside the gantry that carry the tilt axis, on the floor."""
    return [
        box((-0.25, min(a, b), -1.0), (0.25, max(a, b), 0.14), detail, 0.03)
        for a, b in ((1.02, 1.16), (-1.02, -1.16))
    ]


def couch_top(detail: Detail) -> TriangleMesh:
    """The couch top: flat above (z = 0), rounded below, its ends rounded."""
    n = detail.segments
    angles = np.arange(n) * (2.0 * pi / n)
    cos, sin = np.cos(angles), np.sin(angles)
    reach = (np.abs(cos) ** 4 + np.abs(sin) ** 4) ** -0.25
    depth = np.where(sin > 0.0, 0.02, COUCH_DEPTH - 0.02)
    y = COUCH_HALF_WIDTH * reach * cos
    z = depth * np.clip(reach * sin, -1.0, 1.0) - 0.02
    outline = np.column_stack([np.zeros(n), y, z])
    middle = np.array([0.0, 0.0, -0.02])
    start, stop = COUCH_X
    places = np.append(_run(start + 0.04, stop - 0.04, detail.edge), stop - 0.04)
    rings = [_scaled(outline, middle, 1.0, x) for x in places]
    cap = [*_run(0.0, 0.8, 1.5 * detail.edge / COUCH_HALF_WIDTH)[1:], 0.8]
    first = [_scaled(outline, middle, share, start) for share in cap]
    last = [_scaled(outline, middle, share, stop) for share in reversed(cap)]
    ends = (_scaled(middle, middle, 1.0, start), _scaled(middle, middle, 1.0, stop))
    return lofted(np.array([*first, *rings, *last]), ends)


def _scaled(outline: Array, middle: Array, share: float, x: float) -> Array:
    return middle + share * (outline - middle) + (x, 0.0, 0.0)
