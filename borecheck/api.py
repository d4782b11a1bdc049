"""What the Python door adds to the rooms: one call for what a command does."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from functools import partial, wraps
from html import escape
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from borecheck.contact.settings import settings
from borecheck.contact.verdict import Verdict
from borecheck.core.whole_files import check_writable, write_whole
from borecheck.errors import UsageError
from borecheck.motion.binding import verify as verify_bound
from borecheck.motion.certify import write_path_certificate
from borecheck.motion.check import check_motion
from borecheck.motion.needle_motion import needle_motion
from borecheck.motion.samples import DEFAULT_SAMPLES, MotionVerdict
from borecheck.plans.corridor import Corridor
from borecheck.plans.needle_plan import NeedlePlan
from borecheck.plans.plan_file import given_plans
from borecheck.plans.plan_motion import UnreachableError
from borecheck.report.card import picture_of
from borecheck.robots.description import Solutions
from borecheck.robots.given import (
    configuration,
    configurations,
    length,
    refuse_others,
)
from borecheck.robots.kinematics.needle_inverse import needle_inverse
from borecheck.robots.robot import Robot
from borecheck.robots.scene import Scene
from borecheck.verify.verification import Verification

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False, repr=False)
class PlanAnswer:
    """What is said of one needle plan.

    Attributes:
        plan: The plan.
        verdict: clear, contact or unknown.
        reason: One sentence.
        reachable: Whether a configuration reaches it; else it is unknown.
        motion: The verdict of its motion; None if it is out of reach.
    """

    plan: NeedlePlan
    verdict: str
    reason: str
    reachable: bool
    motion: MotionVerdict | None

    def __repr__(self) -> str:
        said = self.verdict if self.reachable else "out of reach"
        return f"<plan {self.plan.name}: {said}, {self.reason}>"

    def _repr_html_(self) -> str:
        named = f"<p><b>{escape(self.plan.name)}</b></p>"
        if self.motion is None:
            return f"{named}<p><b>OUT OF REACH</b> {escape(self.reason)}</p>"
        return named + self.motion._repr_html_()


def check_plans(
    robot: Robot,
    scene: Scene,
    plans: str | Path | NeedlePlan | Iterable[NeedlePlan],
    *,
    margin: float | str = 0.0,
    samples: int = DEFAULT_SAMPLES,
) -> tuple[PlanAnswer, ...]:
    """The verdict for each needle plan, its whole motion certified, in their order.

    Args:
        robot: From `load_robot`, with a needle.
        scene: From `load_scene`.
        plans: A file of plans, a plan, or several.
        margin: Required clearance to obstacles, [m], or "20mm".
        samples: How many configurations of each motion are looked at first.

    Raises:
        PlanError: The file cannot be used.
        UsageError: No needle, or what is given is none of these.
    """
    refuse_others(robot, scene)
    chosen = settings(margin=length(margin, "margin"))
    answers = []
    for plan in given_plans(plans):
        try:
            motion = needle_motion(robot, scene, plan)
        except UnreachableError as error:
            answers.append(PlanAnswer(plan, "unknown", str(error), False, None))
            continue
        said = check_motion(
            robot,
            scene,
            motion.waypoints,
            chosen,
            corridor=motion.corridor,
            samples=samples,
        )
        worst = said.poses[said.worst]
        draw = partial(
            picture_of,
            robot,
            scene,
            worst.q,
            margin=worst.margin_m,
            corridor=motion.corridor,
        )
        answers.append(
            PlanAnswer(plan, said.verdict, said.reason, True, said.pictured(draw))
        )
    return tuple(answers)


def certify(
    robot: Robot,
    scene: Scene,
    motion: NeedlePlan | ArrayLike,
    file: str | Path,
    *,
    margin: float | str = 0.0,
    corridor: Corridor | None = None,
    long_way: bool = False,
) -> Path:
    """Writes the certificate of a motion that is clear, and its meshes beside it.

    `borecheck verify FILE` and `verify` check it, by code that shares nothing with the
    search.

    Args:
        robot: From `load_robot`.
        scene: From `load_scene`.
        motion: A needle plan; or the waypoints of a path as `check_path` takes them.
        file: The certificate to write, `.json`; the meshes get its name and `.npz`.
        margin: Required clearance to obstacles, [m], or "20mm".
        corridor: Of a path: where its needle may be in the patient.
        long_way: Of a path: see `check_path`.

    Returns:
        The certificate.

    Raises:
        UsageError: The motion is not proven clear, or has no certificate of a size
            that anybody would check; a corridor beside a plan; another suffix.
        UnreachableError: No configuration of the robot reaches the plan.
        BorecheckError: The files cannot be written; then there are none.
    """
    refuse_others(robot, scene)
    out = Path(file)
    if out.suffix.lower() != ".json":
        raise UsageError(f"{out}: a certificate is written as JSON: name it .json")
    size, plan = length(margin, "margin"), ""
    if isinstance(motion, NeedlePlan):
        if corridor is not None:
            raise UsageError("a plan has its own corridor: give waypoints with one")
        found = needle_motion(robot, scene, motion)
        points, corridor, plan = found.waypoints, found.corridor, motion.name
    else:
        points = configurations(robot, motion)
    write_path_certificate(
        robot, scene, points, size, out, corridor, plan, long_way=long_way
    )
    return out


@wraps(verify_bound)
def verify(  # noqa: D103
    certificate: str | Path | Mapping[str, Any], *given: Any, **asked: Any
) -> Verification:
    found = verify_bound(certificate, *given, **asked)
    if not found.could_not_run or isinstance(certificate, Mapping):
        return found
    return replace(
        found, problems=tuple(f"{certificate} {text}" for text in found.problems)
    )


def inverse(
    robot: Robot,
    tip: ArrayLike,
    direction: ArrayLike,
    insertion: float | str | None = None,
) -> Solutions:
    """Configurations that put the needle's tip there, pointing that way.

    Args:
        robot: A robot with a needle and a frame at its tip.
        tip: Scanner's frame, (3,), [m].
        direction: The way the needle points, (3,), of any length but 0.
        insertion: Where the insertion joint stands, [m]; it is not moved then.

    Returns:
        `configurations`, and `rejected`: what stands against it if there is none.

    Raises:
        UsageError: The robot has no needle with a tip, or numbers make no needle.
    """
    refuse_others(robot)
    held = None if insertion is None else length(insertion, "insertion")
    return needle_inverse(robot, tip, direction, held)


def fk(robot: Robot, q: Any) -> dict[str, Array]:
    """T_scene_link (4, 4) of every link at a configuration.

    Args:
        robot: From `load_robot`.
        q: Positions in the joints' order, by name, or "home"; [m] and [rad].

    Raises:
        JointLimitError, UsageError, UnknownNameError: q is none.
    """
    refuse_others(robot)
    return robot.placements(configuration(robot, q))


def random_configurations(robot: Robot, n: int, seed: int = 0) -> Array:
    """Configurations (n, joints) drawn evenly within the limits; the seed says which.

    Raises:
        UsageError: n is not 1 or more, or the seed negative.
    """
    refuse_others(robot)
    for name, value, least in (("n", n, 1), ("seed", seed, 0)):
        whole = isinstance(value, int | np.integer) and not isinstance(value, bool)
        if not whole or value < least:
            raise UsageError(f"{name} is {value!r}, not a whole number from {least} on")
    return robot.model.random_configurations(np.random.default_rng(seed), n)


def report(result: Mapping[str, Any] | str | Path, file: str | Path) -> Path:
    """A result as one HTML page.

    Args:
        result: A result of a command: its file, or what it holds.
        file: The page to write.

    Returns:
        The page.

    Raises:
        InputError: The result cannot be read, or the page not written.
        UsageError: It is no result.
    """
    from borecheck.core.result_file import read_result
    from borecheck.report.page import page

    out = Path(file)
    check_writable(out)
    if isinstance(result, str | Path):
        document: Mapping[str, Any] = read_result(Path(result))
    elif isinstance(result, Mapping) and "command" in result:
        document = result
    else:
        kind = type(result).__name__
        raise UsageError(
            f"result is a {kind}: give a result file of a command (--out FILE), "
            "or show(robot, scene, q, file) for a page of one pose"
        )
    write_whole(out, page(dict(document)))
    return out


def show(
    robot: Robot,
    scene: Scene,
    q: Any = "home",
    file: str | Path = "pose.html",
    *,
    margin: float | str = 0.0,
) -> Verdict:
    """Writes a page of one configuration, to be opened in a browser.

    The live view, with sliders, is `borecheck view`.

    Args:
        robot: From `load_robot`.
        scene: From `load_scene`.
        q: As in `fk`.
        file: The page to write.
        margin: Required clearance to obstacles, [m], or "20mm".

    Returns:
        The verdict that the page shows.

    Raises:
        JointLimitError, UsageError, UnknownNameError: q is none.
    """
    from borecheck.contact.check import check_with
    from borecheck.contact.checked import checked
    from borecheck.report import document as parts
    from borecheck.report.display import display_block
    from borecheck.report.page import page

    refuse_others(robot, scene)
    out = Path(file)
    check_writable(out)
    chosen = settings(margin=length(margin, "margin"), link_clearance=True)
    verdict = check_with(robot, scene, configuration(robot, q), chosen)
    about = checked(robot, scene, chosen.margin)
    content: dict[str, Any] = {
        **parts.header("check", ["(from Python)"], None),
        **parts.about_block(robot, scene, about),
        **parts.verdict_block(verdict, robot.model.joint_names),
        **parts.allowed_block(robot, verdict.itself.to_json()),
    }
    content["display"] = display_block(robot, scene, content)
    write_whole(out, page(content))
    return verdict
