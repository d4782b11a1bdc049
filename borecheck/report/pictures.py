"""Still pictures of a pose with lines and labels over them, as inline SVG."""

from base64 import b64encode
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from markupsafe import Markup, escape
from numpy.typing import NDArray

from borecheck.report.display import inflated

Array = NDArray[np.float64]
Plan = tuple[Sequence[float], Sequence[float]]

# Half the size of the bore's surroundings that a picture of the whole shows, [m].
OVERVIEW, NEAR = 2.6, 0.34


def pictures_at(
    display: Mapping[str, Any],
    motion: int,
    pose: int,
    closest: Mapping[str, Any] | None,
    plan: Plan | None = None,
) -> list[dict[str, Any]]:
    """Pictures of one pose: the whole cut open, the narrow place, along the bore.

    Args:
        display: The geometry of the result.
        motion: Which motion.
        pose: Which of its poses.
        closest: The closest pair at that pose, if known.
        plan: Entry and target, scanner's frame, [m].
    """
    from borecheck.report.figures_still import Stage, looking

    stage = Stage(display)
    lit = _lit(display, motion, pose)
    spot = _spot(closest, lit, plan)
    middle = np.array([-0.25, 0.0, 0.05])
    # The eye stands across from the robot's base, and the section opens towards it.
    near = 1.0 if stage.robot_points(motion, pose)[:, 1].mean() < 0.0 else -1.0
    half = (np.array([0.0, near, 0.0]), 0.0)
    shots = [
        ("cut open", looking(middle, (0.8, -1.3 * near, -0.65), OVERVIEW), half),
        ("from the side", looking(middle, (0.0, -near, 0.0), OVERVIEW), half),
        ("along the bore", looking(middle, (1.0, 0.0, 0.0), OVERVIEW), None),
    ]
    if spot is not None:
        cut = (np.array([-1.0, 0.0, 0.0]), -float(spot[0]) + 0.02)
        close = looking(spot, (1.0, -0.25 * near, -0.2), NEAR)
        shots.insert(0, ("the narrowest place", close, cut))
    made = []
    for name, camera, cut_by in shots:
        png = stage.picture(motion, pose, camera, cut_by)
        made.append({"name": name, "svg": _overlaid(png, camera, closest, lit, plan)})
    return made


def _lit(display: Mapping[str, Any], motion: int, pose: int) -> Array:
    """Corners of the triangles in contact at a pose, (n, 2, 3, 3)."""
    for found in display["motions"][motion]["lit"]:
        if found["pose"] == pose:
            corners: Array = inflated(found["corners"], "<f4").astype(np.float64)
            return corners.reshape(-1, 2, 3, 3)
    return np.zeros((0, 2, 3, 3))


def _spot(
    closest: Mapping[str, Any] | None, lit: Array, plan: Plan | None
) -> Array | None:
    """The place to look at: contact, else the closest points, else the plan."""
    if len(lit):
        sizes = np.ptp(lit, axis=2).max(axis=2).min(axis=1)
        k = int(np.argmin(sizes))
        small = int(np.argmin(np.ptp(lit[k], axis=1).max(axis=1)))
        return np.asarray(lit[k, small].mean(axis=0))
    if closest is not None:
        return np.asarray(np.mean(closest["points"], axis=0))
    return None if plan is None else np.asarray(np.mean(plan, axis=0))


def _overlaid(
    png: bytes,
    camera: Any,
    closest: Mapping[str, Any] | None,
    lit: Array,
    plan: Plan | None,
) -> Markup:
    from borecheck.report.figures_still import HEIGHT, WIDTH

    data = b64encode(png).decode("ascii")
    parts = [
        f'<image width="{WIDTH}" height="{HEIGHT}" '
        f'href="data:image/png;base64,{data}"/>'
    ]
    for pair in lit:
        for kind, triangle in zip(("alpha", "beta"), pair, strict=True):
            places = camera.on_picture(triangle)
            points = " ".join(f"{x:.1f},{y:.1f}" for x, y, _ in places)
            parts.append(f'<polygon class="lit {kind}" points="{points}"/>')
    if plan is not None:
        parts.append(_line(camera.on_picture(np.array(plan)), "plan"))
    if closest is not None and not len(lit):
        places = camera.on_picture(np.array(closest["points"]))
        parts.append(_line(places, "closest"))
        label = f"{1e3 * closest['distance']:.1f} mm"
        x, y = places[:, :2].mean(axis=0)
        parts.append(
            f'<text class="label" x="{x + 10:.1f}" y="{y:.1f}">{escape(label)}</text>'
        )
    return Markup(
        f'<svg viewBox="0 0 {WIDTH} {HEIGHT}" class="still" role="img" '
        f'aria-label="still picture">{"".join(parts)}</svg>'
    )


def _line(places: Array, kind: str) -> str:
    (x0, y0, _), (x1, y1, _) = places
    return (
        f'<line class="{kind}" x1="{x0:.1f}" y1="{y0:.1f}" '
        f'x2="{x1:.1f}" y2="{y1:.1f}"/>'
        f'<circle class="{kind}" r="3.5" cx="{x0:.1f}" cy="{y0:.1f}"/>'
        f'<circle class="{kind}" r="3.5" cx="{x1:.1f}" cy="{y1:.1f}"/>'
    )
