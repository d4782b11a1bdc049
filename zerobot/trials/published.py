"""The experiment of [Matsuno2020] section 4 as printed: 64 trials, Tables 2 to 4.

The papers' table cells agree in both papers ([MatsunoConf] prints the same).
"""

from dataclasses import dataclass

POSTURES_DEG = ((0, 0), (30, 0), (-30, 0), (0, 15), (30, 15), (-30, -15))
"""(q4, q5) of the rows, [deg]."""

DISTANCES_MM = (25, 15)
"""Measured distances: clear is right at the first, contact at the second."""

MARGIN_MM = 20
"""Section 4.1: "enlarged with 20mm size along each axis"."""

AXES = {"P1": ("Y", "Z"), "P2": ("X", "Z"), "P3": ("Y", "Z")}
"""PublishedApproach axes of every goal point, section 4.1."""

# Table 3: "the condition that upper cover contacts point P2 is limited".
MEASURED_P2_X = ((0, 15), (30, 15))

# All failures are missed contacts at 15 mm: (point, axis, q4, q5).
MISSED_AT_15_MM = frozenset(
    {
        ("P1", "Y", -30, -15),
        ("P1", "Z", -30, -15),
        ("P2", "Z", -30, -15),
        ("P3", "Y", 30, 15),
        ("P3", "Z", 0, 15),
        ("P3", "Z", 30, 15),
        ("P3", "Z", -30, -15),
    }
)


@dataclass(frozen=True, order=True)
class Trial:
    """One cell of the tables.

    Attributes:
        point: P1, P2 or P3.
        axis: The axis of the gantry the robot moves along: X, Y or Z.
        q4_deg: Posture, [deg].
        q5_deg: Posture, [deg].
        distance_mm: Measured distance of end-effector and gantry, [mm].
    """

    point: str
    axis: str
    q4_deg: int
    q5_deg: int
    distance_mm: int

    @property
    def expected(self) -> str:
        """The right verdict: clear beyond the 20 mm margin, contact within it."""
        return "clear" if self.distance_mm > MARGIN_MM else "contact"

    @property
    def published_ok(self) -> bool:
        """Whether the papers' table marks the verdict as right."""
        if self.distance_mm != 15:
            return True
        cell = (self.point, self.axis, self.q4_deg, self.q5_deg)
        return cell not in MISSED_AT_15_MM

    @property
    def approach(self) -> "PublishedApproach":
        """The motion this trial is a stop of."""
        return PublishedApproach(self.point, self.axis, self.q4_deg, self.q5_deg)


@dataclass(frozen=True, order=True)
class PublishedApproach:
    """One motion towards the gantry: stops at 25 mm, then at 15 mm."""

    point: str
    axis: str
    q4_deg: int
    q5_deg: int

    def trial(self, distance_mm: int) -> Trial:
        """The trial at one of its stops."""
        return Trial(self.point, self.axis, self.q4_deg, self.q5_deg, distance_mm)


def approaches() -> tuple[PublishedApproach, ...]:
    """The 32 motions in the order of the tables."""
    return tuple(
        PublishedApproach(point, axis, *posture)
        for point, axes in AXES.items()
        for axis in axes
        for posture in POSTURES_DEG
        if (point, axis) != ("P2", "X") or posture in MEASURED_P2_X
    )


def trials() -> tuple[Trial, ...]:
    """The 64 trials in the order of the tables."""
    return tuple(a.trial(d) for a in approaches() for d in DISTANCES_MM)
