"""What a robot file leads to believe and no verdict about the robot looks at."""

from collections.abc import Iterator, Sequence
from pathlib import Path

from borecheck.robots.drawn import TOLERANCE, Beyond, drawn_beyond
from borecheck.robots.parts import Part
from borecheck.robots.urdf.reach import NO_ROOTS, Roots
from borecheck.robots.urdf.tree import UrdfTree

_LISTED = 3  # more are counted


def unseen(
    tree: UrdfTree,
    parts: Sequence[Part],
    file: Path,
    roots: Roots = NO_ROOTS,
) -> tuple[str, ...]:
    """A line for each kind of thing that was left out or taken by custom.

    Args:
        tree: The robot.
        parts: Its collision geometry.
        file: Where relative mesh names start.
        roots: Where its meshes may lie beside its own folder tree.
    """
    beyond = drawn_beyond(tree, parts, file, roots)
    return (
        *_lost(tree),
        *_remarks(parts),
        *_beyond(beyond),
    )


def _lost(tree: UrdfTree) -> Iterator[str]:
    if tree.lost:
        where = _listed([f"{place.path} (line {place.line})" for place in tree.lost])
        yield f"geometry that is no link's shape, so it is not read: {where}"


def _remarks(parts: Sequence[Part]) -> Iterator[str]:
    """What mesh files state and ROS does not apply: placements are made for it."""
    files: dict[str, dict[str, None]] = {}
    for part in parts:
        for remark in part.remarks:
            files.setdefault(remark, {})[part.file] = None
    for remark, names in files.items():
        yield f"that a mesh {remark}: {_listed(list(names))}"


def _beyond(found: Sequence[Beyond]) -> Iterator[str]:
    far = [f"{b.link} by {1e3 * b.distance:.0f} mm" for b in found if b.distance]
    if far:
        limit = f"more than {1e3 * TOLERANCE:g} mm"
        yield f"what is drawn beyond its <collision>, {limit}: {_listed(far)}"
    unread = [b.link for b in found if b.distance is None]
    if unread:
        yield f"what is drawn beside a <collision> and not readable: {_listed(unread)}"


def _listed(names: Sequence[str]) -> str:
    more = len(names) - _LISTED
    return ", ".join(names[:_LISTED]) + (f" and {more} more" if more > 0 else "")
