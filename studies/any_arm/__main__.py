"""Stranger's arms do the main job in a CT gantry: solved, certified, verified.

    python -m studies.any_arm [--poses 10000] [--seed 1] [NAME ...]

Every arm gets a needle and stands before the gantry with the torso. A needle plan is
solved and checked (`check --plan --needle --tip --certificate`), its certificate is
verified by itself and bound to robot, scene and plan; then the same motion is given as
a path with a corridor, certified and verified again. With `--poses`, needles of random
configurations within the limits are asked back, held against Pinocchio's own placement
of the tip.
"""

import argparse
import contextlib
import io
import json
import sys
import time
from collections.abc import Sequence
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from borecheck.cli import main as borecheck
from borecheck.core.units import parse_pose
from borecheck.robots.robot import Robot, load_robot
from studies.any_arm.arms import ARMS, MISSING, NEEDLE, Arm, share
from studies.any_arm.poses import solved

HEAD = "name,entry_x,entry_y,entry_z,target_x,target_y,target_z"
# The share of reachable needles that must be found.
WANTED = 0.995


def main(argv: Sequence[str] | None = None) -> int:
    """Prints both tables; 1 if a plan is not accepted, or too few needles are found."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--poses", type=int, default=0)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("names", nargs="*", metavar="NAME")
    args = parser.parse_args(argv)
    arms = [arm for arm in ARMS if not args.names or arm.name in args.names]
    print(*(f"note: {line}" for line in MISSING), sep="\n")
    with TemporaryDirectory() as folder:
        here = [(arm, arm.written(Path(folder))) for arm in arms]
        for arm, file in here:
            if file is None:
                print(f"note: {arm.name} is left out: example-robot-data is not here")
        there = [(arm, file) for arm, file in here if file is not None]
        good = _plans(there, Path(folder))
        if args.poses:
            good = _poses(there, args.poses, args.seed) and good
    return 0 if good else 1


def _plans(arms: Sequence[tuple[Arm, Path]], folder: Path) -> bool:
    """Plans and paths of all arms: solved, certified, verified."""
    print("\narm          joints stations verdict  clearance  check  verify  as a path")
    good = True
    for arm, file in arms:
        row = _plan(arm, file, folder / file.stem)
        good = good and row.pop("good")
        print(
            "{name:12s} {joints:6d} {stations:8d} {verdict:8s} {clearance:6.1f} mm "
            "{check:5.1f} s {verify:5.1f} s  {accepted}".format(**row),
            flush=True,
        )
    return good


def _plan(arm: Arm, file: Path, folder: Path) -> dict[str, Any]:
    folder.mkdir()
    plans, path = folder / "plans.csv", folder / "path.csv"
    numbers = ",".join(str(x) for point in arm.plan for x in point)
    plans.write_text(f"{HEAD}\nplan,{numbers}\n")
    words = ["--base", arm.base, *NEEDLE, *_files(arm)]
    out, certificate = folder / "out.json", folder / "plan.json"
    more = ["--plan", plans, "--certificate", certificate, "--out", out]
    status, check = _timed("check", file, "ct_gantry", *words, *more)
    document = json.loads(out.read_text())
    block = document["plans"][0]
    waypoints = block["path"]["waypoints"] if "path" in block else []
    row: dict[str, Any] = {
        "name": arm.name,
        "joints": len(document["robot"]["joints"]),
        "stations": len(waypoints),
        "verdict": block["verdict"],
        "clearance": 1e3 * (block.get("clearance_m") or 0.0),
        "check": check,
        "verify": 0.0,
        "accepted": block["reason"],
        "good": False,
    }
    if status != 0:
        return row
    bound = ["--robot", file, "--scene", "ct_gantry", *words]
    alone = _timed("verify", certificate)[0] if arm.srdf is None else 0
    status, row["verify"] = _timed("verify", certificate, *bound, "--plan", plans)
    lines = [",".join(repr(x) for x in q.values()) for q in waypoints]
    path.write_text("\n".join([",".join(waypoints[0]), *lines]) + "\n")
    as_path = _as_path(file, path, plans, words, bound)
    row["good"] = alone == status == as_path == 0
    row["accepted"] = (
        "accepted, accepted"
        if row["good"]
        else (f"alone {alone}, bound {status}, as a path {as_path}")
    )
    return row


def _as_path(
    file: Path, path: Path, plans: Path, words: list[str], bound: list[Any]
) -> int:
    """The same motion as a path with a corridor; the exit status."""
    certificate = path.with_suffix(".json")
    corridor = ["--path", path, "--corridor", plans]
    more = [*corridor, "--certificate", certificate, "--samples", "3"]
    checked = _timed("check", file, "ct_gantry", *words, *more)[0]
    return checked or _timed("verify", certificate, *bound, *corridor)[0]


def _poses(arms: Sequence[tuple[Arm, Path]], count: int, seed: int) -> bool:
    """Inverse kinematics of all arms, on needles that are reachable."""
    print(
        f"\n{count} needles of random configurations each (seed {seed})\n"
        "arm           found   share  branches  tip off      turned  false  each"
    )
    good = True
    for arm, file in arms:
        row = solved(_loaded(arm, file), count, seed)
        share_found = row.found / row.poses
        good = good and share_found >= WANTED and row.false == 0
        print(
            f"{arm.name:12s} {row.found:6d} {100 * share_found:6.2f} % "
            f"{row.branches / max(row.found, 1):8.1f}  {row.tip:.1e} m  "
            f"{row.turned:.1e} {row.false:5d}  {1e3 * row.seconds / row.poses:.1f} ms",
            flush=True,
        )
    return good


def _loaded(arm: Arm, file: Path) -> Robot:
    folder = share()
    return load_robot(
        file,
        base=parse_pose(arm.base),
        package_paths=[] if folder is None else [folder],
        needle=NEEDLE[1],
        tip=NEEDLE[3],
    )


def _files(arm: Arm) -> list[str]:
    """Where its meshes lie, and which of its links may touch."""
    folder = share()
    if folder is None:
        return []
    words = ["--package-path", str(folder)]
    return words if arm.srdf is None else [*words, "--srdf", str(folder / arm.srdf)]


def _timed(*words: Any) -> tuple[int, float]:
    """Exit status and seconds of one command; what it prints is dropped."""
    begun = time.perf_counter()
    with contextlib.redirect_stdout(io.StringIO()):
        status = borecheck([str(word) for word in words])
    return status, time.perf_counter() - begun


if __name__ == "__main__":
    sys.exit(main())
