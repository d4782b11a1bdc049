"""What `compare` found, as records, and what grows while poses are compared."""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from borecheck.contact.causes import cause_of
from borecheck.geometry.surfaces import Found

Array = NDArray[np.float64]


@dataclass(frozen=True)
class CheckerSummary:
    """What one checker said over all poses.

    Attributes:
        contact_poses: Numbers of the poses at which it sees contact.
        obstacle_poses: Those of them at which an obstacle is touched.
        triangle_pairs: Pairs in contact, over all poses.
        pairs_examined: Pairs its narrowphase looked at.
        pairs_pruned: Pairs it did not need to look at.
        seconds: Time taken, all poses.
    """

    contact_poses: tuple[int, ...] = ()
    obstacle_poses: tuple[int, ...] = ()
    triangle_pairs: int = 0
    pairs_examined: int = 0
    pairs_pruned: int = 0
    seconds: float = 0.0


@dataclass(frozen=True)
class CheckerDisagreement:
    """Two triangles about which the checkers differ, with the triangles themselves.

    Attributes:
        pose: Number of the pose.
        link: Part of the robot.
        obstacle: Obstacle, or other part.
        link_triangle: Triangle of the link; -1 where no pair of triangles is meant.
        obstacle_triangle: Triangle of the obstacle.
        verdicts: Contact or not, by checker.
        exact: What exact arithmetic says.
        cause: Why the others differ; None if no known cause fits.
        corners: The two placed triangles, (2, 3, 3), [m].
    """

    pose: int
    link: str
    obstacle: str
    link_triangle: int
    obstacle_triangle: int
    verdicts: dict[str, bool]
    exact: bool
    cause: str | None
    corners: tuple[tuple[tuple[float, ...], ...], ...]


@dataclass(frozen=True, eq=False)
class Comparison:
    """The outcome of `compare`.

    Attributes:
        joint_names: Order of every q.
        poses: Configurations, (n, joints).
        pruning: How pairs were kept from the narrowphases.
        checkers: Summary by checker.
        disagreements: Every pair of triangles about which two checkers differ.
        pose_verdicts: For every pose contact or not, by checker; containment included
            for `exact` as "contained".
        pose_obstacles: The same of obstacles alone: without what the robot does to
            itself.
        touching_itself: Pairs of its links that `exact` sees in contact.
        contained: Per pose, what only containment sees: texts.
        interrupted: Whether the user stopped it before the last pose.
    """

    joint_names: tuple[str, ...]
    poses: tuple[tuple[float, ...], ...]
    pruning: str
    checkers: dict[str, CheckerSummary]
    disagreements: tuple[CheckerDisagreement, ...]
    pose_verdicts: tuple[dict[str, bool], ...]
    pose_obstacles: tuple[dict[str, bool], ...]
    touching_itself: tuple[tuple[str, str], ...]
    contained: tuple[tuple[str, ...], ...]
    interrupted: bool = False

    def __repr__(self) -> str:
        found = ", ".join(
            f"{name} {len(one.contact_poses)}" for name, one in self.checkers.items()
        )
        return (
            f"<Comparison: poses {len(self.pose_verdicts)}, in contact by {found}; "
            f"{len(self.disagreements)} triangle pairs disputed>"
        )

    @property
    def unexplained(self) -> tuple[CheckerDisagreement, ...]:
        """Disagreements for which no known cause fits."""
        return tuple(d for d in self.disagreements if d.cause is None)


class Gathered:
    """What grows while poses are compared."""

    def __init__(self, names: tuple[str, ...]) -> None:
        self.names = names
        self.summaries = {name: CheckerSummary() for name in names}
        self.disagreements: list[CheckerDisagreement] = []
        self.pose_verdicts: list[dict[str, bool]] = []
        self.pose_obstacles: list[dict[str, bool]] = []
        self.touching_itself: set[tuple[str, str]] = set()
        self.contained: list[tuple[str, ...]] = []
        self.begin_pose()

    @property
    def number(self) -> int:
        """Of the pose that is compared."""
        return len(self.contained)

    def begin_pose(self) -> None:
        """Remembers how far it is, should the pose not be finished."""
        self._before = (dict(self.summaries), len(self.disagreements))
        self._finished = len(self.contained)

    def drop_unfinished(self) -> None:
        """Takes back what belongs to a pose that was interrupted."""
        if len(self.contained) > self._finished:
            return
        self.summaries, known = self._before
        del self.disagreements[known:], self.pose_verdicts[self._finished :]
        del self.pose_obstacles[self._finished :]

    def add(self, name: str, found: Found, total: int, seconds: float) -> None:
        """Adds what a checker found of one pair of surfaces."""
        summary = self.summaries[name]
        self.summaries[name] = replace(
            summary,
            triangle_pairs=summary.triangle_pairs + len(found.pairs),
            pairs_examined=summary.pairs_examined + found.examined,
            pairs_pruned=summary.pairs_pruned + total - found.examined,
            seconds=summary.seconds + seconds,
        )

    def close_pose(
        self, seen: dict[str, bool], around: dict[str, bool], contained: list[str]
    ) -> None:
        """Adds what was seen of all, and of the obstacles alone, by checker."""
        number = self.number
        for name in self.names:
            summary = self.summaries[name]
            self.summaries[name] = replace(
                summary,
                contact_poses=summary.contact_poses + (number,) * seen[name],
                obstacle_poses=summary.obstacle_poses + (number,) * around[name],
            )
        self.pose_obstacles.append(around)
        self.pose_verdicts.append(seen)
        self.contained.append(tuple(contained))


def judged(
    pose: int,
    where: tuple[str, str, int, int],
    verdicts: dict[str, bool],
    first: Array,
    second: Array,
) -> CheckerDisagreement:
    """One disputed pair of triangles with its cause, by exact arithmetic."""
    truth, cause = cause_of(first, second, verdicts)
    return CheckerDisagreement(
        pose=pose,
        link=where[0],
        obstacle=where[1],
        link_triangle=where[2],
        obstacle_triangle=where[3],
        verdicts=verdicts,
        exact=truth,
        cause=cause,
        corners=(_nested(first), _nested(second)),
    )


def _nested(triangle: Array) -> tuple[tuple[float, ...], ...]:
    return tuple(tuple(float(x) for x in point) for point in triangle)


def to_json(result: Comparison) -> dict[str, Any]:
    """Plain values for `json.dumps`, as the contract names them."""
    return {
        "interrupted": result.interrupted,
        "poses": [
            {
                "q": dict(zip(result.joint_names, q, strict=True)),
                "verdicts": verdicts,
                "obstacles": around,
                "contained": list(inside),
            }
            for q, verdicts, around, inside in zip(
                result.poses,
                result.pose_verdicts,
                result.pose_obstacles,
                result.contained,
                strict=True,
            )
        ],
        "pruning": result.pruning,
        "checkers": {
            name: {
                "contact_poses": list(summary.contact_poses),
                "obstacle_poses": list(summary.obstacle_poses),
                "triangle_pairs": summary.triangle_pairs,
                "pairs_examined": summary.pairs_examined,
                "pairs_pruned": summary.pairs_pruned,
                "seconds": summary.seconds,
            }
            for name, summary in result.checkers.items()
        },
        "disagreements": [
            {
                "pose": d.pose,
                "link": d.link,
                "obstacle": d.obstacle,
                "link_triangle": d.link_triangle,
                "obstacle_triangle": d.obstacle_triangle,
                "verdicts": d.verdicts,
                "exact": d.exact,
                "cause": d.cause,
                "corners": d.corners,
            }
            for d in result.disagreements
        ],
    }
