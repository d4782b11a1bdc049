"""Rules of the tree: links and joints form one, with one root."""

from collections.abc import Iterator

from borecheck.robots.urdf.draft import UrdfDraft
from borecheck.robots.urdf.draft_elements import DraftJoint
from borecheck.robots.urdf.rules.defect import Defect
from borecheck.robots.urdf.rules.names import guess
from borecheck.robots.urdf.source import children, tag_of

DEEPEST = 1000  # joints between root and tip: libraries recurse, no arm has a tenth


def no_links(draft: UrdfDraft) -> Iterator[Defect]:
    """There is at least one link."""
    if tag_of(draft.root) == "robot" and not draft.links:
        yield Defect(draft.root, "the robot has no link")


def unknown_links(draft: UrdfDraft) -> Iterator[Defect]:
    """The links that joints name exist."""
    for joint in draft.joints:
        for role, name in (("parent", joint.parent), ("child", joint.child)):
            if name is not None and name not in draft.link_named:
                close = guess(name, draft.link_named)
                message = f"{role} link {name!r} does not exist{close}"
                yield Defect(children(joint.element, role)[0], message, "link")


def unnamed_links(draft: UrdfDraft) -> Iterator[Defect]:
    """Every joint says which links it connects."""
    for joint in draft.joints:
        for role, name in (("parent", joint.parent), ("child", joint.child)):
            if name is None:
                label = f"joint {joint.name!r}" if joint.name else "a joint"
                yield Defect(joint.element, f"{label} has no {role} link")


def several_roots(draft: UrdfDraft) -> Iterator[Defect]:
    """One link has no parent."""
    for link in draft.roots[1:]:
        below = len(list(draft.below(link.name)))
        also = f" and {below - 1} links below it" if below > 1 else ""
        first = draft.roots[0].name
        message = f"link {link.name!r}{also} is not connected to {first!r}"
        yield Defect(link.element, message)


def cycles(draft: UrdfDraft) -> Iterator[Defect]:
    """No way along joints leads back."""
    done: set[str] = set()
    for link in draft.links:
        at: dict[str, int] = {}
        joints: list[DraftJoint] = []
        name = link.name
        while name not in done and draft.joints_into.get(name):
            if name in at:
                road = list(at)
                circle = [*road[at[name] :], name]
                way = " -> ".join(reversed(circle))
                element = joints[at[name]].element
                yield Defect(element, f"links form a circle: {way}")
                break
            at[name] = len(at)
            joints.append(draft.joints_into[name][0])
            name = joints[-1].parent or ""
        done.update(at)


def two_parents(draft: UrdfDraft) -> Iterator[Defect]:
    """No link is the child of several joints."""
    for name, joints in draft.joints_into.items():
        for joint in joints[1:]:
            message = f"link {name!r} is already the child of joint {joints[0].name!r}"
            yield Defect(joint.element, message)


def unreachable(draft: UrdfDraft) -> Iterator[Defect]:
    """Every link is reached from a root."""
    reached = {name for root in draft.roots for name, _ in draft.below(root.name)}
    lost = [link for link in draft.links if link.name and link.name not in reached]
    if lost:
        names = ", ".join(link.name for link in lost[:5])
        more = f" and {len(lost) - 5} more" if len(lost) > 5 else ""
        yield Defect(lost[0].element, f"no root leads to {names}{more}")


def too_deep(draft: UrdfDraft) -> Iterator[Defect]:
    """No link is too many joints away from the root."""
    depths = draft.depths
    deepest = max(depths, key=lambda name: depths[name], default=None)
    if deepest is not None and depths[deepest] > DEEPEST:
        message = (
            f"link {deepest!r} is {depths[deepest]} joints away from the root; "
            f"more than {DEEPEST} are refused"
        )
        yield Defect(draft.link_named[deepest].element, message)
