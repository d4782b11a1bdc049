"""A torso phantom of given girth: an oval body with rounded ends, lying on its back.

The shape is assumed: no patient data are in it. The cross-section is a superellipse
whose depth is 5/7 of its width; its largest one has the given girth. It narrows a
little towards the waist, and the ends (shoulders, hips) are rounded.
"""

from math import pi

import numpy as np
from numpy.typing import NDArray

from borecheck.mesh import TriangleMesh
from scanners.shapes import Detail, lofted

Array = NDArray[np.float64]

LENGTH = 0.62  # shoulders to hips [m], assumed
DEPTH_TO_WIDTH = 5.0 / 7.0  # assumed: 0.95 m of girth lies 0.25 m deep
EXPONENT = 2.3  # a little boxier than an ellipse, assumed
WAIST = 0.05  # the waist is this share slimmer than chest and hips, assumed
END = 0.10  # length of the rounded ends [m], assumed


def torso(girth: float, detail: Detail) -> TriangleMesh:
    """The torso lying on the plane z = 0, its middle over the origin, along x.

    Args:
        girth: Largest perimeter around the body, [m].
        detail: `segments` around the body, `edge` along it.
    """
    width, depth = half_axes(girth)
    n = detail.segments
    grown = 1.0 / np.cos(pi / n)
    outline = _outline(width, depth, n) * (1.0, grown, grown)
    stations = _stations(detail.edge)
    rings = np.array([outline * (0.0, f, f) + (x, 0.0, depth) for x, f in stations])
    ends = tuple(np.array([side * LENGTH / 2.0, 0.0, depth]) for side in (-1.0, 1.0))
    return lofted(rings, (ends[0], ends[1]))


def half_axes(girth: float) -> tuple[float, float]:
    """Half the width (along y) and half the depth (along z) [m] for a girth [m]."""
    fine = _outline(1.0, DEPTH_TO_WIDTH, 4096)
    steps = np.linalg.norm(np.roll(fine, -1, axis=0) - fine, axis=1)
    width = girth / float(steps.sum())
    return width, DEPTH_TO_WIDTH * width


def _outline(width: float, depth: float, n: int) -> Array:
    """Points (n, 3) of the cross-section around the x axis."""
    angles = np.arange(n) * (2.0 * pi / n)
    cos, sin = np.cos(angles), np.sin(angles)
    reach = (np.abs(cos) ** EXPONENT + np.abs(sin) ** EXPONENT) ** (-1.0 / EXPONENT)
    return np.column_stack([np.zeros(n), width * reach * cos, depth * reach * sin])


def _stations(edge: float) -> list[tuple[float, float]]:
    """Places along x and the share of the outline there, the tips left out."""
    quarter = max(3, round(1.6 * END / edge))
    angles = np.arange(1, quarter + 1) * (pi / 2.0 / quarter)
    straight = LENGTH / 2.0 - END
    caps = [(straight + END * np.cos(a), np.sin(a)) for a in angles]
    steps = max(4, round(2.0 * straight / edge))
    middle = -straight + np.arange(1, steps) * (2.0 * straight / steps)
    left = [(-x, f) for x, f in caps]
    right = [(x, f) for x, f in reversed(caps)]
    return left + [(x, _slimmer(x / straight)) for x in middle] + right


def _slimmer(share: float) -> float:
    """Share of the outline at -1..1 along the trunk: 1 at both ends, less between."""
    return float(1.0 - WAIST * np.cos(share * pi / 2.0) ** 2)
