"""`borecheck directions`: which way in is clear, of all directions to a target."""

import argparse
from pathlib import Path
from typing import TYPE_CHECKING, Any

from borecheck.commands import common
from borecheck.commands.options.patient_place import add_patient_place, stated
from borecheck.commands.output import emit, refuse_outputs, refuse_suffix
from borecheck.core.units import parse_length
from borecheck.errors import UsageError

if TYPE_CHECKING:
    from numpy import float64
    from numpy.typing import NDArray

    from borecheck.directions.direction_map import DirectionMap
    from borecheck.directions.ranking import Ranked


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Options of the command."""
    common.add_robot(parser)
    common.add_scene(parser)
    add_patient_place(parser)
    parser.add_argument(
        "--target",
        required=True,
        metavar="X,Y,Z",
        help="where needles end, scanner's frame: 0,0,-50mm",
    )
    parser.add_argument(
        "--resolution", default="1deg", help="cells are not split below it"
    )
    parser.add_argument(
        "--margin", default="0", help="clearance kept from obstacles, e.g. 5mm"
    )
    parser.add_argument(
        "--target-error",
        default="0",
        metavar="R",
        help="every target so near must be reached so, e.g. 2mm",
    )
    parser.add_argument(
        "--standoff", default="50mm", help="length of the approach before the skin"
    )
    parser.add_argument("--max-depth", metavar="D", help="deeper is out, e.g. 120mm")
    parser.add_argument(
        "--max-obliquity",
        metavar="ANGLE",
        help="more off the skin's inward normal is out, e.g. 40deg",
    )
    parser.add_argument(
        "--asked",
        metavar="X,Y,Z",
        help="an entry: is its direction clear, and which is the nearest that is?",
    )
    parser.add_argument(
        "--rank", type=int, default=3, metavar="N", help="clear directions to propose"
    )
    _add_files(parser)


def _add_files(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--out",
        type=Path,
        metavar="PLANS",
        help="write the proposed directions as plans: .csv or .json",
    )
    parser.add_argument(
        "--picture", type=Path, metavar="MAP.svg", help="write a picture of the map"
    )
    common.add_result(parser)


def run(args: argparse.Namespace) -> int:
    """Makes the map; 0 a direction (the asked one) is clear, 1 none is, 2 undecided."""
    _refuse(args)
    from borecheck.commands.compiling import tell_of_compiling

    tell_of_compiling()
    from borecheck.commands.progress import Progress
    from borecheck.directions.ask import directions
    from borecheck.directions.ranking import ranked
    from borecheck.report.direction_words import direction_text

    target = _three(args.target, "--target")
    asked = None if args.asked is None else _three(args.asked, "--asked")
    if asked == target:
        raise UsageError("--asked is the target itself: give where the needle goes in")
    found = directions(
        common.load(args),
        common.load_surroundings(args),
        target,
        resolution=args.resolution,
        margin=args.margin,
        target_error=args.target_error,
        standoff=args.standoff,
        max_depth=args.max_depth,
        max_obliquity=args.max_obliquity,
        progress=Progress("rounds"),
    )
    best = ranked(found, args.rank) if args.rank else ()
    document = _document(args, found, best, asked)
    _write(args, found, best, asked)
    emit(args, document, direction_text)
    return {"clear": 0, "none": 1}.get(document["verdict"], 2)


def _refuse(args: argparse.Namespace) -> None:
    refuse_outputs(args, "out", "picture", "result")
    stated(args)  # refused before any work is done
    if args.rank < 0:
        raise UsageError(f"--rank {args.rank} is not 0 or more")
    refuse_suffix("--out", args.out, "plans are CSV or JSON", ".csv", ".json")
    refuse_suffix("--picture", args.picture, "pictures are SVG", ".svg")


def _three(text: str, option: str) -> list[float]:
    parts = text.split(",")
    if len(parts) != 3:
        raise UsageError(f"{option} {text!r}: give three lengths, e.g. 0,0,-50mm")
    return [parse_length(part) for part in parts]


def _document(
    args: argparse.Namespace,
    found: "DirectionMap",
    best: "tuple[Ranked, ...]",
    asked: list[float] | None,
) -> dict[str, Any]:
    from borecheck.directions.map_json import map_block
    from borecheck.report.document import about_block, header

    block = None if asked is None else _asked(found, asked)
    state = found.verdict if block is None else block["state"]
    verdict = {"clear": "clear", "undecided": "unknown"}.get(state, "none")
    robot, scene = found.setup.robot, found.setup.scene
    return {
        **header("directions", args.argv, args.date),
        **about_block(robot, scene),
        "verdict": verdict,
        "reason": _reason(found, verdict, block),
        "map": map_block(found),
        "ranked": [_ranked(k, row) for k, row in enumerate(best, start=1)],
        "asked": block,
        "not_modelled": [*robot.not_modelled, *scene.not_modelled],
    }


def _reason(found: "DirectionMap", verdict: str, asked: dict[str, Any] | None) -> str:
    if asked is not None:
        words = "the asked direction is" + (" not" if verdict == "none" else "")
        return f"{words} clear" if verdict != "unknown" else asked["reason"]
    if verdict == "clear":
        share = 100.0 * found.shares["clear"]
        return f"{share:.1f} % of the directions are proven clear at every instant"
    if verdict == "none":
        return "no direction is clear, proven"
    return next((why for (state, why) in found.reasons if state == "undecided"), "")


def _asked(found: "DirectionMap", entry: list[float]) -> dict[str, Any]:
    """What is known of the direction from an entry to the target."""
    import numpy as np

    direction = found.target - np.array(entry)
    cell = found.at(direction)
    near = found.nearest_clear(direction)
    return {
        "entry": entry,
        "direction": (direction / np.linalg.norm(direction)).tolist(),
        "state": cell.state,
        "reason": cell.reason,
        "nearest_clear": {
            "entry": None if near.plan is None else near.plan.entry.tolist(),
            "angle_deg": _degrees(near.angle),
            "none_nearer_than_deg": _degrees(near.none_nearer_than),
        },
    }


def _degrees(angle: float) -> float | None:
    import numpy as np

    return float(np.degrees(angle)) if np.isfinite(angle) else None


def _ranked(rank: int, row: "Ranked") -> dict[str, Any]:
    return {
        "rank": rank,
        "name": row.plan.name,
        "entry": row.plan.entry.tolist(),
        "target": row.plan.target.tolist(),
        "cost": row.cost,
        "depth_m": row.depth,
        "obliquity_deg": _degrees(row.obliquity),
        "clearance_seen_m": row.clearance,
        "cell": row.cell,
    }


def _write(
    args: argparse.Namespace,
    found: "DirectionMap",
    best: "tuple[Ranked, ...]",
    asked: list[float] | None,
) -> None:
    if args.out is not None and best:
        from borecheck.plans.plan_file import save_plans

        save_plans(args.out, [row.plan for row in best])
    elif args.out is not None:
        from borecheck.commands.progress import say

        say(f"borecheck: --out {args.out} is not written: no plan is clear")
    if args.picture is None:
        return
    import numpy as np

    from borecheck.core.whole_files import write_whole
    from borecheck.report.figure_directions import direction_picture

    along = None if asked is None else found.target - np.array(asked)
    near = None if along is None else found.nearest_clear(along)
    unit = None if along is None else along / np.linalg.norm(along)
    picture = direction_picture(found, best, unit, near, _lies(args))
    write_whole(args.picture, picture)


def _lies(args: argparse.Namespace) -> "NDArray[float64] | None":
    """How the patient lies, R_scanner_ras (3, 3), where it is said."""
    from borecheck.core.patient_frame import LPS_FROM_RAS

    said = stated(args)
    return said.place.T_scanner_lps[:3, :3] @ LPS_FROM_RAS if said.turned else None
