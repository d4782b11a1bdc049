"""The MRI arm's task: certified steps to 10 mm from the entry, then the insertion.

Prints the steps; --path writes the gross motion and the approach as CSV, to be checked
again with `borecheck check mri_arm mri_open_magnet --path FILE`.
"""

import argparse
import sys
from pathlib import Path

import borecheck as bc
from borecheck.core.units import parse_length
from mri_arm.studies.task import Task, plan_task, tip_speeds


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--entry", default="-30mm,-67.5mm,35.3mm")
    parser.add_argument("--target", default="-20mm,-20mm,10mm")
    parser.add_argument("--margin", default="0mm", help="of gross motion and approach")
    parser.add_argument("--needle-mount", default="along", choices=("along", "square"))
    parser.add_argument("--path", type=Path, help="write the motion up to 10 mm there")
    options = parser.parse_args()
    robot = bc.load_robot("mri_arm", needle_mount=options.needle_mount)
    scene = bc.load_scene("mri_open_magnet")
    entry, target = (
        [parse_length(part) for part in text.split(",")]
        for text in (options.entry, options.target)
    )
    task = plan_task(robot, scene, entry, target, margin=parse_length(options.margin))
    print(f"{task.verdict}: {task.reason} ({task.tried} ways tried)")
    for step in task.steps:
        peak = 1e3 * tip_speeds(robot, step).max()
        print(
            f"{step.name}: {len(step.waypoints)} waypoints, "
            f"{step.seconds.sum():.1f} s, tip at most {peak:.1f} mm/s: "
            f"{step.verdict}, {step.reason}"
        )
    if options.path is not None and task.steps:
        options.path.write_text(as_csv(robot.model.joint_names, task))
    return 0 if task.verdict == "clear" else 2


def as_csv(names: tuple[str, ...], task: Task) -> str:
    gross, approach = task.steps[:2]
    waypoints = [*gross.waypoints, *approach.waypoints[1:]]
    rows = [",".join(repr(float(value)) for value in q) for q in waypoints]
    return "\n".join([",".join(names), *rows]) + "\n"


if __name__ == "__main__":
    sys.exit(main())
