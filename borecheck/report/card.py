"""The picture on a verdict's card in a notebook: robot and scanner, cut open."""

from typing import Any

from numpy.typing import ArrayLike

from borecheck.contact.check import check
from borecheck.plans.corridor import Corridor
from borecheck.report.document import verdict_block
from borecheck.robots.robot import Robot
from borecheck.robots.scene import Scene

WIDTH, HEIGHT = 660, 420
# With colours of its own: a notebook has no style sheet of ours.
_STYLE = "".join(
    f".borecheck-card {rule}"
    for rule in (
        "svg{display:block;max-width:30em}",
        ".lit{fill:#c62828;fill-opacity:.45}",
        ".halo{stroke:#fff;stroke-width:8}",
        ".pair,.leader{stroke:#1b1f24;stroke-width:3}",
        ".plan{stroke:#6a1b9a;stroke-width:3;fill:none}",
        ".chip rect{fill:#fff;stroke:#1b1f24}",
        ".chip .fill{fill:#1b1f24}",
        ".chip .stroke{fill:none;stroke:#fff;stroke-width:2.5}",
        "text{font:600 22px sans-serif;fill:#1b1f24;stroke:none}",
    )
)


def picture_of(
    robot: Robot,
    scene: Scene,
    q: ArrayLike,
    *,
    margin: float = 0.0,
    corridor: Corridor | None = None,
) -> str:
    """Robot and scanner at a configuration, with what touches or is nearest, as HTML.

    Args:
        robot: The robot.
        scene: What stands around it.
        q: The configuration, (n,), [m] and [rad].
        margin: Required clearance to obstacles, [m].
        corridor: Where the needle may be in the patient.
    """
    from borecheck.report.display import display_block
    from borecheck.report.pictures import CUT_OPEN, Subject, pictures_at

    seen = check(robot, scene, q, margin=margin, corridor=corridor)
    block: dict[str, Any] = verdict_block(seen, robot.model.joint_names)
    met = [*seen.contacts, *seen.self_contacts]
    subject = Subject(
        motion=0,
        pose=0,
        verdict=seen.verdict,
        closest=block["closest"],
        touching=(met[0].link, met[0].obstacle) if met else None,
        plan=None if corridor is None else _ends(corridor),
    )
    shown = display_block(robot, scene, block)
    (drawn,) = pictures_at(shown, subject, WIDTH, HEIGHT, (CUT_OPEN,))
    style = f"<style>{_STYLE}</style>"
    return f'<div class="borecheck-card">{style}{drawn["svg"]}</div>'


def _ends(corridor: Corridor) -> tuple[list[float], list[float]]:
    return corridor.entry.tolist(), corridor.target.tolist()
