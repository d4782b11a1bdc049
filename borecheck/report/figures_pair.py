"""Two triangles drawn alone: how they lie to each other, seen from their best side."""

from collections.abc import Sequence

import numpy as np
from markupsafe import Markup, escape
from numpy.typing import NDArray

Array = NDArray[np.float64]

SIDE, EDGE = 240, 22


def two_triangles(corners: Sequence[Sequence[Sequence[float]]], title: str) -> Markup:
    """The triangles of a pair in three views.

    Along both planes (each is a line there) shows whether and how far one passes
    through the other's plane; onto the obstacle's triangle shows where; oblique for
    the eye.

    Args:
        corners: (2, 3, 3), [m]; the robot's triangle first.
        title: What it shows.
    """
    pair = np.array(corners, dtype=np.float64)
    views = _views(pair)
    parts = [
        f'<g transform="translate({k * (SIDE + 16)} 0)">{_view(pair, axes, name)}</g>'
        for k, (name, axes) in enumerate(views)
    ]
    width = len(views) * (SIDE + 16) - 16
    return Markup(
        f'<svg class="pair" viewBox="0 0 {width} {SIDE + 24}" role="img" '
        f'aria-label="{escape(title)}">{"".join(parts)}</svg>'
    )


def _views(pair: Array) -> list[tuple[str, Array]]:
    first, second = _normal(pair[0]), _normal(pair[1])
    line = np.cross(first, second)
    if np.linalg.norm(line) < 1e-9:
        line = _any_across(first)
    line = line / np.linalg.norm(line)
    across = np.cross(second, line)
    if np.linalg.norm(across) < 1e-9:
        across = _any_across(line)
    across = across / np.linalg.norm(across)
    up = np.cross(line, across)
    eye = 0.55 * line + 0.45 * across + 0.7 * up
    eye = eye / np.linalg.norm(eye)
    aside = np.cross(up, eye)
    aside = aside / np.linalg.norm(aside)
    return [
        ("oblique", np.array([aside, np.cross(eye, aside)])),
        ("along both planes", np.array([across, up])),
        ("onto the obstacle's triangle", np.array([across, line])),
    ]


def _normal(triangle: Array) -> Array:
    n = np.cross(triangle[1] - triangle[0], triangle[2] - triangle[0])
    length = np.linalg.norm(n)
    return n / length if length > 0.0 else np.array([0.0, 0.0, 1.0])


def _any_across(direction: Array) -> Array:
    axis = np.zeros(3)
    axis[int(np.argmin(np.abs(direction)))] = 1.0
    return np.cross(direction, axis)


def _view(pair: Array, axes: Array, name: str) -> str:
    flat = pair @ axes.T
    # The smaller triangle fills the picture: the larger one may run out of it.
    sizes = np.ptp(flat, axis=1).max(axis=1)
    small = flat[int(np.argmin(sizes))]
    centre = 0.5 * (small.min(axis=0) + small.max(axis=0))
    size = max(2.2 * float(np.ptp(small, axis=0).max()), 1e-9)
    places = (flat - centre) / size * (SIDE - 2 * EDGE) * np.array([1.0, -1.0])
    places = np.clip(places + 0.5 * SIDE, -20 * SIDE, 20 * SIDE)
    shapes = "".join(
        f'<polygon class="{kind}" points="'
        + " ".join(f"{x:.1f},{y:.1f}" for x, y in triangle)
        + '"/>'
        for kind, triangle in zip(("beta", "alpha"), places[::-1], strict=True)
    )
    return (
        f'<svg width="{SIDE}" height="{SIDE}" viewBox="0 0 {SIDE} {SIDE}">'
        f'<rect class="frame" width="{SIDE}" height="{SIDE}"/>{shapes}'
        f"{_scale_bar(size)}</svg>"
        f'<text class="tick" x="2" y="{SIDE + 16}">view {escape(name)}</text>'
    )


def _scale_bar(size: float) -> str:
    """A bar of a round length at the lower left."""
    length = 10.0 ** np.floor(np.log10(0.4 * size))
    pixels = length / size * (SIDE - 2 * EDGE)
    label = f"{1e3 * length:g} mm"
    return (
        f'<path class="scale" d="M10 {SIDE - 12}h{pixels:.1f}"/>'
        f'<text class="tick" x="10" y="{SIDE - 17}">{label}</text>'
    )
