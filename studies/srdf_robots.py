"""Robots of example-robot-data with their SRDFs: what touches at their named poses.

    python -m studies.srdf_robots [NAME ...]

For each `group_state` of each SRDF: which pairs of links touch without the SRDF, with
it, and with its statistics trusted; and which ones Coal finds, on geometry and an SRDF
that Pinocchio reads. With the SRDF nothing may touch where Coal finds nothing, but for
pairs that it lets touch by statistics or for no known reason alone: these are told.
Without it the page must name every pair and the options to type.
"""

import argparse
import contextlib
import html
import io
import re
import shlex
import sys
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
from numpy.typing import NDArray

from borecheck.cli import main as borecheck
from borecheck.contact.check import check
from borecheck.errors import BorecheckError, UrdfError
from borecheck.geometry.mesh.primitives import box
from borecheck.geometry.mesh_files.reading import write_stl
from borecheck.robots.allowed import MOST_OPTIONS, Allowances
from borecheck.robots.robot import Robot, load_robot
from borecheck.robots.scene import Scene, load_scene
from borecheck.robots.srdf import read_srdf
from studies.one_judge import example_robot_data

Pairs = set[frozenset[str]]
WALL = "m@9,9,9"  # out of every robot's reach


@dataclass(frozen=True)
class Row:
    """One named pose of one robot.

    Attributes:
        name: SRDF and pose.
        alone: Pairs that touch without the SRDF.
        given: Those that touch with it.
        trusted: Those that touch with its statistics as well.
        left: Pairs that it lets touch for no reason that is taken.
        coal: Those that Coal finds, all pairs of the SRDF left out.
        seen: Links of which Coal has geometry; it has none of what is only drawn.
        page: What the page without the SRDF does not say, or "".
    """

    name: str
    alone: Pairs
    given: Pairs
    trusted: Pairs
    left: Pairs
    coal: Pairs
    seen: frozenset[str]
    page: str

    @property
    def wrong(self) -> str:
        """What is not as it must be, or ""."""
        if self.page:
            return self.page
        for pairs in (self.trusted, self.given - self.left):
            more = {pair for pair in pairs - self.coal if pair <= self.seen}
            if more:
                return f"contact that Coal does not find: {told(more)}"
        return ""


def told(pairs: Pairs) -> str:
    """Pairs in words, three of them."""
    names = sorted(" with ".join(sorted(pair)) for pair in pairs)
    return ", ".join(names[:3]) + (f" and {len(names) - 3} more" * (len(names) > 3))


def robot_of(srdf: Path) -> Robot:
    """The robot an SRDF is for: its namesake, or the first that has all its links.

    Raises:
        BorecheckError: None can be loaded; why not the likeliest one.
    """
    folder = next(p for p in srdf.parents if p.parent.name == "robots")
    files = [*folder.rglob("*.urdf")]
    problem = BorecheckError("there is no URDF by it")
    for file in sorted(files, key=lambda f: (f.stem != srdf.stem, str(f))):
        try:
            robot = load_robot(file, package_paths=[folder.parents[1]])
            read_srdf(srdf, robot.model.link_names)
        except BorecheckError as error:
            problem = problem if isinstance(problem, UrdfError) else error
            continue
        return robot
    raise problem


def poses(robot: Robot, srdf: Path) -> Iterator[tuple[str, NDArray[np.float64]]]:
    """The named poses, joints that are not named at home, all within their limits."""
    model = robot.model
    for state in ElementTree.parse(srdf).getroot().iter("group_state"):
        q = robot.home.copy()
        for joint in state.iter("joint"):
            values = (joint.get("value") or "").split()
            if joint.get("name") in model.joint_names and len(values) == 1:
                q[model.joint_names.index(joint.get("name") or "")] = float(values[0])
        yield state.get("name") or "?", np.clip(q, model.lower, model.upper)


def touching(robot: Robot, scene: Scene, q: NDArray[np.float64]) -> Pairs:
    """Pairs of links in contact, one within another among them."""
    return {frozenset(pair) for pair in check(robot, scene, q).itself.pairs}


class CoalsView:
    """The robot as Pinocchio reads it, with the SRDF that Pinocchio reads."""

    def __init__(self, robot: Robot, srdf: Path, packages: Path) -> None:
        import pinocchio as pin

        self.pin = pin
        self.model = pin.buildModelFromUrdf(str(robot.file))
        self.geometry = pin.buildGeomFromUrdf(
            self.model,
            str(robot.file),
            pin.GeometryType.COLLISION,
            package_dirs=[str(packages)],
        )
        self.geometry.addAllCollisionPairs()
        pin.removeCollisionPairs(self.model, self.geometry, str(srdf), False)
        self.joints = robot.model

    def touching(self, q: NDArray[np.float64]) -> Pairs:
        """Pairs of links that it finds in contact."""
        pin = self.pin
        full = pin.neutral(self.model)
        for name, value in self.joints.positions(q).items():
            joint = self.model.joints[self.model.getJointId(name)]
            if joint.nq == 2:  # cosine and sine
                full[joint.idx_q : joint.idx_q + 2] = np.cos(value), np.sin(value)
            else:
                full[joint.idx_q] = value
        data, seen = self.model.createData(), self.geometry.createData()
        pin.computeCollisions(self.model, data, self.geometry, seen, full, False)
        return {
            frozenset((self._link(pair.first), self._link(pair.second)))
            for pair, result in zip(
                self.geometry.collisionPairs, seen.collisionResults, strict=True
            )
            if result.isCollision()
        }

    @property
    def seen(self) -> frozenset[str]:
        """Links of which it has geometry."""
        return frozenset(map(self._link, range(self.geometry.ngeoms)))

    def _link(self, number: int) -> str:
        frame = self.geometry.geometryObjects[number].parentFrame
        return str(self.model.frames[frame].name)


def missing_on_page(
    robot: Robot, wall: Path, q: NDArray[np.float64], pairs: Pairs, packages: Path
) -> str:
    """What the page of the check without an SRDF lacks of pairs and options."""
    if not pairs:
        return ""
    page = wall.with_name("page.html")
    values = ",".join(repr(float(value)) for value in q)
    words = ["check", str(robot.file), f"{wall}:{WALL}", f"--q={values}"]
    words += ["--package-path", str(packages), "--report", str(page)]
    with contextlib.redirect_stdout(io.StringIO()):
        borecheck(words)
    text = html.unescape(page.read_text("utf-8"))
    hint = next(iter(re.findall(r"Hint: (the robot touches itself[^<]*)", text)), "")
    option = {
        frozenset(word.split(":", 1))
        for before, word in zip(shlex.split(hint), shlex.split(hint)[1:], strict=False)
        if before == "--allow"
    }
    if option <= pairs and len(option) == min(len(pairs), MOST_OPTIONS):
        return ""
    return f"the page names {len(option)} of {len(pairs)} pairs"


def rows(srdf: Path, folder: Path) -> Iterator[Row]:
    """All named poses of one SRDF."""
    wall = folder / "wall.stl"
    write_stl(wall, box("wall", (1.0, 1.0, 1.0)))
    scene = load_scene(f"{wall}:{WALL}")
    robot = robot_of(srdf)
    packages = next(p for p in srdf.parents if p.name == "robots").parent.parent
    given = robot.allowing(Allowances(srdf))
    trusted = robot.allowing(Allowances(srdf, trust_never=True))
    left = {pair.links for pair in read_srdf(srdf, robot.model.link_names).left}
    coal = CoalsView(robot, srdf, packages)
    for name, q in poses(robot, srdf):
        alone = touching(robot, scene, q)
        yield Row(
            f"{srdf.stem} {name}",
            alone,
            touching(given, scene, q),
            touching(trusted, scene, q),
            left,
            coal.touching(q),
            coal.seen,
            missing_on_page(robot, wall, q, alone, packages),
        )


def main() -> int:
    """Prints the table; 1 if anything is not as it must be."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("names", nargs="*", help="SRDFs by name (default: all)")
    args = parser.parse_args()
    found = [p for base in example_robot_data() for p in sorted(base.glob("*/srdf/*"))]
    chosen = [p for p in found if not args.names or p.stem in args.names]
    print("SRDF and pose: pairs in contact alone, with it, trusted, by Coal")
    seen: list[Row] = []
    refused = 0
    for srdf in chosen:
        try:
            with tempfile.TemporaryDirectory() as folder:
                for row in rows(srdf, Path(folder)):
                    seen.append(row)
                    print(line(row), flush=True)
        except (BorecheckError, ValueError) as error:
            refused += 1
            print(f"{srdf.stem:28} not loaded: {error}", flush=True)
    print(f"{len(chosen)} SRDFs, {refused} of them not loaded; {summary(seen)}")
    return int(any(row.wrong for row in seen))


def summary(seen: list[Row]) -> str:
    """How many poses, and at how many something touches where Coal finds nothing."""
    quiet = [row for row in seen if not row.coal]
    left = sum(bool(row.given & row.left) for row in quiet)
    drawn = sum(any(not pair <= row.seen for pair in row.given) for row in quiet)
    wrong = sum(bool(row.wrong) for row in seen)
    return (
        f"{len(seen)} named poses, {wrong} wrong. At {len(quiet)} Coal finds nothing: "
        f"with the SRDF, pairs that it allows by statistics or for no known reason "
        f"touch at {left}, links that are only drawn at {drawn}"
    )


def line(row: Row) -> str:
    """A row as text."""
    sizes = [len(p) for p in (row.alone, row.given, row.trusted, row.coal)]
    numbers = " ".join(f"{size:4d}" for size in sizes)
    more = ""
    if row.wrong:
        more = f"  WRONG: {row.wrong}"
    elif row.given:
        drawn = {pair for pair in row.given if not pair <= row.seen}
        by_statistics = row.given & row.left
        kinds = ((drawn, "only drawn"), (by_statistics, "not taken"))
        named = [f"{what}: {told(pairs)}" for pairs, what in kinds if pairs]
        more = "  " + "; ".join(named or [f"Coal too: {told(row.given)}"])
    return f"{row.name:36} {numbers}{more}"


if __name__ == "__main__":
    sys.exit(main())
