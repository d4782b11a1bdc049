"""The arms of the study: whose they are, where they stand, and the needle each gets."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from xml.etree import ElementTree

from borecheck.robots.robot import load_robot
from studies.any_arm import dvrk
from studies.any_arm.hulls import with_hulls
from studies.one_judge import example_robot_data

HERE = Path(__file__).parent
GENERIC = HERE.parents[1] / "tests" / "data" / "robots" / "needle_arm.urdf"
NEEDLE = ("--needle", "needle_link", "--tip", "needle_tip:z")
# A 16 G needle in a mount that the arm's flange carries, [m]; assumed.
NEEDLE_RADIUS, MOUNT = 0.0008, 0.02


@dataclass(frozen=True)
class Arm:
    """One arm of the study.

    Attributes:
        name: For the table.
        urdf: Gives its URDF without a needle; None if it is not installed.
        flange: The link that carries the needle.
        at: Where the needle is mounted on it: x, y, z [m], roll, pitch, yaw [rad].
        length: Of the needle, [m].
        base: Where it stands in the scanner's frame.
        plan: Entry and target, scanner's frame, [m].
        srdf: Below `share`: which of its links may touch each other.
        hulls: Whether links with open meshes get their convex hulls.
    """

    name: str
    urdf: Callable[[], str | None]
    flange: str
    at: str
    length: float
    base: str
    plan: tuple[tuple[float, float, float], tuple[float, float, float]]
    srdf: str | None = None
    hulls: bool = False

    def written(self, folder: Path) -> Path | None:
        """Its URDF with the needle, written there; None if it is not installed."""
        text = self.urdf()
        if text is None:
            return None
        file = folder / f"{self.name.replace(' ', '_')}.urdf"
        if self.hulls:
            file.write_text(text)
            folders = [one for one in (share(),) if one is not None]
            text = with_hulls(text, load_robot(file, package_paths=folders), folder)
        file.write_text(text if self.flange == "" else self._with_needle(text))
        return file

    def _with_needle(self, text: str) -> str:
        root = ElementTree.fromstring(text)
        x, y, z, *rpy = self.at.split()
        middle = MOUNT + 0.5 * (self.length - MOUNT)
        shaft = dvrk.rod(NEEDLE_RADIUS, self.length - MOUNT, f"0 0 {middle}")
        parts = [
            f'<link name="needle_mount">{dvrk.rod(0.012, MOUNT, f"0 0 {MOUNT / 2}")}'
            "</link>",
            f'<link name="needle_link">{shaft}</link>',
            '<link name="needle_tip"/>',
            _fixed("mount_on", self.flange, "needle_mount", f"{x} {y} {z}", rpy),
            _fixed("needle_in", "needle_mount", "needle_link", "0 0 0"),
            _fixed("tip_at", "needle_link", "needle_tip", f"0 0 {self.length}"),
        ]
        for part in parts:
            root.append(ElementTree.fromstring(part))
        return ElementTree.tostring(root, encoding="unicode")


def _fixed(
    name: str, above: str, below: str, xyz: str, rpy: list[str] | None = None
) -> str:
    turn = " ".join(rpy or ["0", "0", "0"])
    return (
        f'<joint name="{name}" type="fixed"><parent link="{above}"/>'
        f'<child link="{below}"/><origin xyz="{xyz}" rpy="{turn}"/></joint>'
    )


def share() -> Path | None:
    """The folder that `package://example-robot-data` is found below."""
    for folder in example_robot_data():
        return folder.parents[1]
    return None


def _example(path: str) -> Callable[[], str | None]:
    def read() -> str | None:
        for folder in example_robot_data():
            if (folder / path).is_file():
                return (folder / path).read_text()
        return None

    return read


SRDF = "example-robot-data/robots/panda_description/srdf/panda.srdf"
# Points on the torso's skin and below, in directions that the gantry's mouth leaves.
SLANTED = ((0.2457, 0.0, 0.0193), (0.18, 0.0, -0.03))
SHALLOW = ((0.27991, 0.0, -0.00007), (0.24, 0.0, -0.03))
STEEP = ((0.2694, 0.0, 0.0092), (0.24, 0.0, -0.03))
NEAR_VERTICAL = ((0.1989, 0.0, 0.0208), (0.18, 0.0, -0.03))

BESIDE = "0.95,0,-0.3,0,0,180deg"

ARMS = (
    Arm(
        name="generic 6R",
        urdf=GENERIC.read_text,
        flange="",
        at="",
        length=0.18,
        base="0.65,0,-0.2,0,0,180deg",
        plan=STEEP,
    ),
    Arm(
        name="Panda",
        urdf=_example("panda_description/urdf/panda.urdf"),
        flange="panda_hand",
        at="0 0 0.115 0 0 0",  # in front of its fingers
        length=0.2,
        base=BESIDE,
        plan=SLANTED,
        srdf=SRDF,
    ),
    Arm(
        name="UR5",
        urdf=_example("ur_description/urdf/ur5_robot.urdf"),
        flange="tool0",
        at="0 0 0 0 0 0",
        length=0.2,
        base=BESIDE,
        plan=SLANTED,
    ),
    Arm(
        name="xArm7",
        urdf=_example("xarm_description/urdf/xarm7.urdf"),
        flange="link_eef",
        at="0 0 0 0 0 0",
        length=0.2,
        base=BESIDE,
        plan=SLANTED,
        hulls=True,
    ),
    Arm(
        name="dVRK PSM",
        urdf=lambda: dvrk.urdf("psm", dvrk.PSM, modified=True),
        flange="gripper_link",
        at="0 0 0 0 0 0",
        length=0.1,
        base="0.34,0,0.18",
        plan=NEAR_VERTICAL,
    ),
    Arm(
        name="dVRK MTM",
        urdf=lambda: dvrk.urdf("mtm", dvrk.MTM, modified=False),
        flange="wrist_roll_link",
        at="0 0 0 0 0 0",
        length=0.15,
        base="0.75,0,0.3,90deg,0,0",
        plan=SHALLOW,
    ),
)
# Named where arms were asked for, and not to be had here.
MISSING = (
    "UR5e and xArm6 with gripper are not in example-robot-data: UR5 and xArm7 stand in",
    "open meshes of the xArm7 (drawn ones, it has no others) are given as their hulls",
    "no arm of the dVRK is in it: kinematics from the published DH parameters",
)
