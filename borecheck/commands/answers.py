"""What `check` answers about a pose, a path, or needle plans, as parts of a result."""

import argparse
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

from borecheck.commands import common
from borecheck.commands.certificate_files import PATH
from borecheck.core.units import parse_length, parse_share

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from borecheck.contact.settings import Settings
    from borecheck.motion.least_clearance import Tolerance
    from borecheck.motion.samples import Proof
    from borecheck.plans.corridor import Corridor
    from borecheck.plans.joint_path import JointPath
    from borecheck.plans.needle_plan import NeedlePlan
    from borecheck.robots.robot import Robot
    from borecheck.robots.scene import Scene


# The two questions that every verdict answers apart.
HALVES = ("obstacles", "itself")


@dataclass(frozen=True, eq=False)
class Asked:
    """What is to be answered.

    Attributes:
        args: The options.
        robot: The robot.
        scene: What stands around it.
        chosen: Checker, pruning, margin.
        plans: Needle plans; none for a pose or a path.
        waypoints: Of a path, (k, n).
        corridor: Where a path may bring the needle into the patient.
        proofs: The searches of motions, added by the name of what they are of.
    """

    args: argparse.Namespace
    robot: "Robot"
    scene: "Scene"
    chosen: "Settings"
    plans: Sequence["NeedlePlan"] = ()
    waypoints: "NDArray[np.float64] | None" = None
    corridor: "Corridor | None" = None
    proofs: dict[str, "Proof"] = field(default_factory=dict)

    def answer(self) -> dict[str, Any]:
        """The answer's part of the result."""
        if self.args.q is not None:
            return _pose(self)
        if self.waypoints is not None:
            return _path(self, self.waypoints)
        return _plans(self)


def _pose(asked: Asked) -> dict[str, Any]:
    from borecheck.contact.check import check_with
    from borecheck.report.document import verdict_block

    robot = asked.robot
    q = common.configuration(robot, asked.args.q)
    verdict = check_with(robot, asked.scene, q, asked.chosen)
    return verdict_block(verdict, robot.model.joint_names)


def _path(asked: Asked, waypoints: "NDArray[np.float64]") -> dict[str, Any]:
    from borecheck.plans.needle_corridor import LAST_LEG

    corridor = asked.corridor
    if corridor is None:
        return _motion(asked, waypoints)
    begins = asked.args.corridor != LAST_LEG
    notes = _corridor_notes(corridor, asked.scene, begins)
    return {**_motion(asked, waypoints, None, corridor), "notes": notes}


def add_times(document: dict[str, Any], path: "JointPath") -> None:
    """Adds when a timed path is where, and what is not used of its file."""
    from borecheck.plans.joint_path import BETWEEN_WAYPOINTS

    if path.notes:
        document["notes"] = [*path.notes, *document.get("notes", ())]
        document["not_modelled"] = [*document["not_modelled"], BETWEEN_WAYPOINTS]
    times = path.times_at(document["path"]["fractions"])
    if times is not None:
        document["path"]["times_s"] = times


def _corridor_notes(corridor: "Corridor", scene: "Scene", begins: bool) -> list[str]:
    """Whether a path's corridor begins at the patient's skin and ends inside."""
    from borecheck.commands.progress import say
    from borecheck.plans.needle_plan import NeedlePlan

    plan = NeedlePlan("corridor", corridor.entry, corridor.target)
    notes = _notes(plan, scene, begins)
    for note in notes:
        say(f"borecheck: the corridor: {note}")
    return notes


def _motion(
    asked: Asked,
    waypoints: "NDArray[np.float64]",
    plan: "NeedlePlan | None" = None,
    corridor: "Corridor | None" = None,
) -> dict[str, Any]:
    """A path's or a plan's motion, sampled and searched."""
    from borecheck.commands.progress import Progress
    from borecheck.motion.certificate import corridor_record
    from borecheck.motion.check import check_motion
    from borecheck.report.document import motion_block

    args = asked.args
    answer = check_motion(
        asked.robot,
        asked.scene,
        waypoints,
        asked.chosen,
        corridor=corridor,
        samples=args.samples,
        certify=not args.no_certificate,
        long_way=args.long_way,
        tolerance=_tolerance(args.clearance_tolerance),
        progress=Progress("poses" if plan is None else f"poses of plan {plan.name}"),
    )
    if answer.proof is not None:
        asked.proofs[PATH if plan is None else plan.name] = answer.proof
    block = motion_block(answer, asked.robot.model.joint_names)
    if corridor is not None:
        block["corridor"] = corridor_record(corridor)
    return {"not_covered": list(answer.not_covered), **block}


def _tolerance(text: str) -> "Tolerance":
    """From `5%`, `0.1mm` or both, by a comma.

    Raises:
        UsageError: Neither a share nor a length.
    """
    from borecheck.motion.least_clearance import Tolerance

    found = {"relative": 0.0, "absolute": 0.0}
    for part in text.split(","):
        if part.strip().endswith("%"):
            found["relative"] = parse_share(part)
        else:
            found["absolute"] = parse_length(part)
    return Tolerance(**found)


def _plans(asked: Asked) -> dict[str, Any]:
    """All plans; what is finished stays when the user interrupts."""
    from borecheck.plans.plan_motion import STANDOFF, check_mount

    plans, chosen = asked.plans, asked.chosen
    for plan in plans:
        check_mount(asked.robot, plan)
    results: list[dict[str, Any]] = []
    interrupted = False
    try:
        for plan in plans:
            results.append(_one_plan(asked, plan))
    except KeyboardInterrupt:
        interrupted = True
    return {
        **_worst(results, len(plans)),
        **{half: _worst_half(results, half, len(plans)) for half in HALVES},
        "interrupted": interrupted,
        "not_checked": [plan.name for plan in plans[len(results) :]],
        "each_plan": f"from {1e3 * STANDOFF:g} mm before its entry (0%), along its "
        "line, to its target (100%)",
        "checker": chosen.checker,
        "pruning": chosen.pruning,
        "margin_m": chosen.margin.size,
        "margin_kind": chosen.margin.kind,
        "not_modelled": [
            *asked.robot.not_modelled,
            *asked.scene.not_modelled,
            f"the way to where a plan begins, {1e3 * STANDOFF:g} mm before its entry",
            *dict.fromkeys(text for r in results for text in r.get("not_covered", ())),
        ],
        "plans": results,
    }


def _worst(results: Sequence[dict[str, Any]], total: int) -> dict[str, Any]:
    """The worst verdict of several, and how many there are of each."""
    from borecheck.contact.verdict import worst_of

    verdicts = [result["verdict"] for result in results]
    beyond = sum(not result.get("reachable", True) for result in results)
    return {
        "verdict": worst_of(verdicts),
        "reason": counted(verdicts, total, beyond),
    }


def _worst_half(
    results: Sequence[dict[str, Any]], half: str, total: int
) -> dict[str, Any]:
    """Of all plans, what holds of the obstacles, or of the robot itself."""
    answers = [
        {**result, **result[half]} if half in result else result for result in results
    ]
    pairs = {tuple(pair) for answer in answers for pair in answer.get("pairs", ())}
    return {**_worst(answers, total), "qualifiers": [], "pairs": sorted(pairs)}


def counted(verdicts: Sequence[str], total: int, beyond: int = 0) -> str:
    """How many plans are in contact, unknown, clear: what is worst comes first.

    Args:
        verdicts: Of the plans that were looked at.
        total: How many there are.
        beyond: How many of the unknown ones are out of reach, which is definite.
    """
    words = {"contact": "in contact", "unknown": "unknown", "clear": "clear"}
    counts = {word: verdicts.count(name) for name, word in words.items()}
    counts["unknown"] -= beyond
    counts["out of reach"] = beyond
    counts["not checked"] = total - len(verdicts)
    found = [(count, word) for word, count in counts.items() if count]
    if len(found) == 1:
        plans = "the plan is" if total == 1 else f"all {total} plans are"
        return f"{plans} {found[0][1]}"
    return f"of {total} plans " + ", ".join(f"{count} {word}" for count, word in found)


def _one_plan(asked: Asked, plan: "NeedlePlan") -> dict[str, Any]:
    from borecheck.commands.progress import say
    from borecheck.motion.needle_motion import needle_motion
    from borecheck.plans.plan_motion import UnreachableError

    named: dict[str, Any] = {
        "name": plan.name,
        "entry": [float(x) for x in plan.entry],
        "target": [float(x) for x in plan.target],
        "notes": _notes(plan, asked.scene),
    }
    for note in named["notes"]:
        say(f"borecheck: plan {plan.name}: {note}")
    try:
        motion = needle_motion(asked.robot, asked.scene, plan)
    except UnreachableError as error:
        reason = f"{error}{_swapped(asked.robot, plan)}"
        unreached = {"verdict": "unknown", "reason": reason, "reachable": False}
        return {**named, **unreached, "reason_code": reason_code(unreached)}
    block = _motion(asked, motion.waypoints, plan, motion.corridor)
    reached = {**named, "reachable": True, **block}
    return {**reached, "reason_code": reason_code(reached)}


def reason_code(plan: Mapping[str, Any]) -> str | None:
    """Why a plan is neither clear nor contact: out of reach is definite, the rest open.

    Args:
        plan: Its part of a result: `verdict` and `reachable`.
    """
    if not plan["reachable"]:
        return "out_of_reach"
    return "undecided" if plan["verdict"] == "unknown" else None


def _swapped(robot: "Robot", plan: "NeedlePlan") -> str:
    """What to add to "out of reach" where the same needle would do the other way."""
    from borecheck.plans.plan_motion import UnreachableError, plan_motion

    try:
        plan_motion(robot, replace(plan, entry=plan.target, target=plan.entry))
    except UnreachableError:
        return ""
    return "; entry and target look swapped: the other way round the plan is reachable"


def _notes(plan: "NeedlePlan", scene: "Scene", begins: bool = True) -> list[str]:
    """How the plan was read, whether it meets the patient, and what joints decide."""
    from borecheck.plans.skin import skin_notes

    patients = (o.mesh for o in scene.obstacles if o.role == "patient")
    notes = [*plan.notes, *skin_notes(plan, patients, begins=begins)]
    if plan.roll is not None:
        notes.append("its roll is not followed: the joints decide it")
    return notes
