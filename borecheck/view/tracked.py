"""A robot that follows needle and table as they are tracked: answers, no sockets.

A needle's placement is asked back to a configuration, from the last one on; a glance at
it is the first answer, the full check the second. Only the full check ever says clear.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from borecheck.core.patient_frame import LPS_FROM_RAS
from borecheck.core.se3 import inverse
from borecheck.exchange.igtl import MAX_NAME, Message, string, transform
from borecheck.geometry.triangles.placing import place_mesh
from borecheck.plans.patient_place import PatientPlace
from borecheck.robots.kinematics.needle_inverse import NumericalInverse
from borecheck.view.session import Session, Shown

Array = NDArray[np.float64]

NEEDLE, TABLE, VERDICT = "Needle", "Table", "Verdict"

# What lies on the table.
_CARRIED = ("couch", "patient")


@dataclass(frozen=True, eq=False)
class Answer:
    """What is told of a pose.

    Attributes:
        shown: Configuration, placements and state; None where there is none.
        reason: In a sentence.
    """

    shown: Shown | None
    reason: str


class Tracked:
    """Robot and scene as the trackers say.

    Args:
        session: Robot and scene to begin with; the table stands as it does there.
        place: Where the patient's coordinates lie: what is received and sent is in
            them (RAS, as 3D Slicer has it). None: in the scanner's frame.

    Raises:
        UsageError: The robot has no needle with a tip.
    """

    def __init__(self, session: Session, place: PatientPlace | None = None) -> None:
        self.first = session
        self.session = session
        self.q: Array = session.robot.home.copy()
        self._inverse = NumericalInverse.of(session.robot)
        self._axis = self._inverse.needle.axis
        self._T_scanner_world = np.eye(4)
        if place is not None:
            self._T_scanner_world = place.T_scanner_lps.copy()
            self._T_scanner_world[:3, :3] @= LPS_FROM_RAS
        self._T_world_scanner = inverse(self._T_scanner_world)

    def needle(self, T_world_needle: Array) -> Answer:
        """The robot with its needle there, at a glance."""
        T = self._T_scanner_world @ T_world_needle
        tip, direction = T[:3, 3], T[:3, :3] @ self._axis
        q = self._inverse.near(self.q, tip, direction)
        if q is None:
            found = self._inverse.solutions(tip, direction)
            if not found.configurations:
                return Answer(None, f"out of reach: {found.rejected[0]}")
            q = found.configurations[0]
        self.q = q
        shown = self.session.glance(q)
        return Answer(shown, shown.reason)

    def judged(self) -> Answer:
        """The full check of where the robot stands."""
        shown = self.session.judge(self.q)
        return Answer(shown, shown.reason)

    def table(self, T_world_table: Array) -> Answer:
        """The couch and who lies on it, moved by that from where they were."""
        T = self._T_scanner_world @ T_world_table @ self._T_world_scanner
        scene = self.first.scene
        moved = tuple(
            replace(o, mesh=place_mesh(T, o.mesh)) if o.role in _CARRIED else o
            for o in scene.obstacles
        )
        self.session = replace(self.session, scene=replace(scene, obstacles=moved))
        shown = self.session.glance(self.q)
        return Answer(shown, shown.reason)

    def messages(self, answer: Answer, seconds: float) -> Iterator[Message]:
        """The verdict, and where every link stands.

        Args:
            answer: What is told.
            seconds: The time of what it answers, by which a client knows it.
        """
        shown = answer.shown
        state = "unknown" if shown is None else shown.state
        yield string(VERDICT, f"{state}: {answer.reason}", seconds)
        if shown is None:
            return
        for name, link in self._names.items():
            T = self._T_world_scanner @ shown.placements[link]
            yield transform(name, T, seconds)

    @property
    def _names(self) -> dict[str, str]:
        """Links by what they are called in messages, which have little room."""
        found: dict[str, str] = {}
        for k, link in enumerate(self.session.robot.model.link_names):
            short = link[:MAX_NAME]
            found[short if short not in found else f"{link[: MAX_NAME - 5]}~{k}"] = link
        return found
