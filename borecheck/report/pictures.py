"""Still pictures of a pose with marks and labels over them, as inline SVG.

They look where the page's panes look, with the same cuts.
"""

from base64 import b64encode
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from markupsafe import Markup
from numpy.typing import NDArray

from borecheck.report.display import inflated
from borecheck.report.picture_marks import label, plan_marks, segment, told
from borecheck.report.places import Place, Plan, across, place_of

if TYPE_CHECKING:
    from borecheck.report.figures_still import Cuts, OrthographicView, Stage

Array = NDArray[np.float64]

# Names of the pictures, in the order of the page's panes.
CUT_OPEN, BORE, SIDE, NARROW = (
    "cut open",
    "along the bore",
    "from the side",
    "the narrowest place",
)


@dataclass(frozen=True, eq=False)
class Subject:
    """A pose as a picture tells of it.

    Attributes:
        motion: Which motion.
        pose: Which of its poses.
        verdict: What is said of it.
        closest: The closest pair, if known.
        touching: What is in contact, or None; names as far as they are known.
        plan: Entry and target, scanner's frame, [m].
    """

    motion: int
    pose: int
    verdict: str
    closest: Mapping[str, Any] | None = None
    touching: Sequence[str] | None = None
    plan: Plan | None = None


@dataclass(frozen=True, eq=False)
class Shot:
    """One picture to be made: its name, from where, and what is cut away."""

    name: str
    view: "OrthographicView"
    cuts: "Cuts"


def pictures_at(
    display: Mapping[str, Any],
    subject: Subject,
    width: int = 880,
    height: int = 560,
    names: Sequence[str] = (CUT_OPEN, BORE, SIDE, NARROW),
) -> list[dict[str, Any]]:
    """Pictures of one pose, each with `name` and `svg`: see the names above."""
    from borecheck.report.figures_still import Stage

    stage = Stage(display, width, height)
    lit = _lit(display, subject.motion, subject.pose)
    place = place_of(subject.closest, lit, subject.plan)
    return [
        {"name": shot.name, "svg": _picture(stage, shot, subject, lit, place)}
        for shot in shots(stage, subject, place)
        if shot.name in names
    ]


def shots(stage: "Stage", subject: Subject, place: Place | None) -> list[Shot]:
    """The four views of a pose; three where there is no place to look at."""
    from borecheck.report.figures_still import looking

    robot = stage.robot_points(subject.motion, subject.pose)
    low, high = robot.min(axis=0), robot.max(axis=0)
    middle = (low + high) / 2.0
    at = middle if place is None else place.at
    # The eye stands across from the robot's base, and the cut opens towards it.
    near = 1.0 if middle[1] <= at[1] else -1.0
    ahead = -1.0 if middle[0] <= at[0] else 1.0
    size = 2.0 * min(0.8, max(0.12, 0.3 * float(np.linalg.norm(high - low))))
    size *= stage.width / stage.height
    centre = at + 0.2 * (middle - at)
    housing: Cuts = {"housing": (np.array([0.0, near, 0.0]), 0.0)}
    before = (np.array([-ahead, 0.0, 0.0]), -ahead * float(at[0]) + 0.02)
    found = [
        Shot(
            CUT_OPEN,
            looking(centre, (0.8, -1.25 * near, -0.55), 0.9 * size),
            housing,
        ),
        Shot(
            BORE,
            looking(at * (1.0, 0.5, 0.5), (ahead, 0.0, -0.02), 0.75 * size),
            {"housing": before, "rest": before},
        ),
        Shot(SIDE, looking(centre, (0.0, -near, -0.02), 0.9 * size), housing),
    ]
    if place is not None:
        found.append(_narrow(place, ahead, near, stage.width / stage.height))
    return found


def _narrow(place: Place, ahead: float, near: float, aspect: float) -> Shot:
    from borecheck.report.figures_still import looking

    view = looking(place.at, across(place.axis, ahead, near), place.frame * aspect)
    towards, middle = view.towards, float(view.towards @ place.at)
    around = (towards, middle + 0.06 * place.frame)
    robot = (towards, middle + 0.6 * place.frame)
    return Shot(NARROW, view, {"housing": around, "rest": around, "robot": robot})


def _lit(display: Mapping[str, Any], motion: int, pose: int) -> Array:
    """Corners of the triangles in contact at a pose, (n, 2, 3, 3)."""
    for found in display["motions"][motion]["lit"]:
        if found["pose"] == pose:
            corners: Array = inflated(found["corners"], "<f4").astype(np.float64)
            return corners.reshape(-1, 2, 3, 3)
    return np.zeros((0, 2, 3, 3))


def _picture(
    stage: "Stage", shot: Shot, subject: Subject, lit: Array, place: Place | None
) -> Markup:
    png = stage.picture(subject.motion, subject.pose, shot.view, shot.cuts)
    data = b64encode(png).decode("ascii")
    parts = [
        f'<image width="{stage.width}" height="{stage.height}" '
        f'href="data:image/png;base64,{data}"/>',
        *_marks(stage, shot.view, subject, lit, place),
    ]
    return Markup(
        f'<svg viewBox="0 0 {stage.width} {stage.height}" class="still" role="img" '
        f'aria-label="{shot.name}">{"".join(parts)}</svg>'
    )


def _marks(
    stage: "Stage",
    view: "OrthographicView",
    subject: Subject,
    lit: Array,
    place: Place | None,
) -> list[str]:
    def pixels(points: Any) -> Array:
        found: Array = stage.pixels(view, np.array(points, dtype=np.float64))
        return found[:, :2]

    parts = []
    for pair in lit:
        for kind, triangle in zip(("alpha", "beta"), pair, strict=True):
            corners = " ".join(f"{x:.1f},{y:.1f}" for x, y in pixels(triangle))
            parts.append(f'<polygon class="lit {kind}" points="{corners}"/>')
    if subject.plan is not None:
        parts.append(plan_marks(pixels(subject.plan)))
    closest = None if len(lit) else subject.closest
    if closest is not None:
        ends = pixels(closest["points"])
        parts.append(segment(ends, f"pair {subject.verdict}"))
    words = told(closest, (subject.touching or ()) if len(lit) else subject.touching)
    if words and place is not None:
        spot = pixels(place.at[None])[0]
        parts.append(label(spot, words, subject.verdict, stage.width))
    return parts
