"""A torso phantom of given girth, lying on its back: no patient data are in it.

Its cross-section is a superellipse whose depth is 5/7 of its width. The chest has the
given girth; towards waist and hips the body gets slimmer; shoulders and hips end round.
"""

from math import pi

import numpy as np
from numpy.typing import NDArray

from borecheck.plugin import TriangleMesh
from borecheck_models.shapes import Detail, lofted

Array = NDArray[np.float64]

LENGTH = 0.62  # hips (x < 0) to shoulders (x > 0) [m], assumed
DEPTH_TO_WIDTH = 5.0 / 7.0  # assumed: 0.95 m of girth lies 0.25 m deep
EXPONENT = 2.3  # a little boxier than an ellipse, assumed
END = 0.10  # length of the rounded ends [m], assumed
END_EXPONENT = 2.6  # a little blunter than an ellipse, assumed

# Share of the chest's width and depth at hips, waist and chest, assumed.
PLACES = (-1.0, -0.1, 1.0)
WIDTH_SHARES = (0.97, 0.90, 1.0)
DEPTH_SHARES = (0.93, 0.90, 1.0)


def torso(girth: float, detail: Detail) -> TriangleMesh:
    """The torso lying on the plane z = 0, its middle over the origin, along x.

    The polygon goes around the true outline, so a coarse torso contains a fine one.

    Args:
        girth: Perimeter of the chest, [m].
        detail: `segments` around the body, `edge` along it.
    """
    width, depth = half_axes(girth)
    n = detail.segments
    outline = _outline(width, depth, n) / np.cos(pi / n)
    stations = _stations(detail.edge)
    rings = np.array([_section(outline, depth, x, end) for x, end in stations])
    half = LENGTH / 2.0
    ends = (_middle(depth, -half), _middle(depth, half))
    return lofted(rings, ends)


def half_axes(girth: float) -> tuple[float, float]:
    """Half the width (along y) and half the depth (along z) [m] of the chest."""
    fine = _outline(1.0, DEPTH_TO_WIDTH, 4096)
    steps = np.linalg.norm(np.roll(fine, -1, axis=0) - fine, axis=1)
    width = girth / float(steps.sum())
    return width, DEPTH_TO_WIDTH * width


def _outline(width: float, depth: float, n: int) -> Array:
    """Points (n, 3) of the chest's outline around the x axis."""
    angles = np.arange(n) * (2.0 * pi / n)
    cos, sin = np.cos(angles), np.sin(angles)
    reach = (np.abs(cos) ** EXPONENT + np.abs(sin) ** EXPONENT) ** (-1.0 / EXPONENT)
    return np.column_stack([np.zeros(n), width * reach * cos, depth * reach * sin])


def _section(outline: Array, depth: float, x: float, end: float) -> Array:
    """The outline at x; `end` is its share in a rounded end, 1 along the trunk."""
    wide, deep = _share(WIDTH_SHARES, x), _share(DEPTH_SHARES, x)
    return outline * (0.0, end * wide, end * deep) + _middle(depth, x)


def _middle(depth: float, x: float) -> Array:
    """Middle of the section at x: the back lies on z = 0 all along the trunk."""
    return np.array([x, 0.0, depth * _share(DEPTH_SHARES, x)])


def _share(shares: tuple[float, float, float], x: float) -> float:
    """The parabola through the shares at hips, waist and chest; level in the ends."""
    straight = LENGTH / 2.0 - END
    place = min(max(x / straight, -1.0), 1.0)
    total = 0.0
    for i, share in enumerate(shares):
        others = [p for k, p in enumerate(PLACES) if k != i]
        weights = [(place - p) / (PLACES[i] - p) for p in others]
        total += share * weights[0] * weights[1]
    return total


def _stations(edge: float) -> list[tuple[float, float]]:
    """Places along x and the share of the outline there, the tips left out."""
    quarter = max(6, round(1.6 * END / edge))
    angles = np.arange(1, quarter + 1) * (pi / 2.0 / quarter)
    straight = LENGTH / 2.0 - END
    bend = 2.0 / END_EXPONENT
    caps = [
        (straight + END * float(np.cos(a)) ** bend, float(np.sin(a)) ** bend)
        for a in angles[:-1]
    ]
    caps.append((straight, 1.0))
    steps = max(4, round(2.0 * straight / edge))
    middle = -straight + np.arange(1, steps) * (2.0 * straight / steps)
    left = [(-x, share) for x, share in caps]
    right = [(x, share) for x, share in reversed(caps)]
    return left + [(float(x), 1.0) for x in middle] + right
