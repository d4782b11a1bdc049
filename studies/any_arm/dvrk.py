"""Two arms of the da Vinci Research Kit as URDFs, from their published DH parameters.

example-robot-data has none of them. Kinematics and limits are those of the kit's user
guide as its public controller holds them (github.com/jhu-dvrk/sawIntuitiveResearchKit,
share/kinematic/psm.json and mtmr.json; share/tool/LARGE_NEEDLE_DRIVER_400006.json).
Shapes are assumed: slender primitives along the links, since no meshes go with these.
"""

from dataclasses import dataclass
from math import pi

QUARTER = pi / 2.0


@dataclass(frozen=True)
class Row:
    """A row of a DH table: what is before the joint in the modified convention.

    Attributes:
        name: Of the joint and its link.
        kind: revolute, prismatic or fixed.
        alpha: [rad], as `theta`; `a` and `d` in [m].
        lower: Limit, [rad] or [m].
        upper: Likewise.
        shape: Collision elements of the link, in its frame.
    """

    name: str
    kind: str
    alpha: float
    a: float
    theta: float
    d: float
    lower: float
    upper: float
    shape: str = ""


def box(size: str, at: str) -> str:
    """A box as a collision element: edges and middle, [m]."""
    return _shape(f'<box size="{size}"/>', at)


def rod(radius: float, length: float, at: str, rpy: str = "0 0 0") -> str:
    """A cylinder along z as a collision element, [m]."""
    return _shape(f'<cylinder radius="{radius}" length="{length}"/>', at, rpy)


def _shape(geometry: str, at: str, rpy: str = "0 0 0") -> str:
    origin = f'<origin xyz="{at}" rpy="{rpy}"/>'
    return f"<collision>{origin}<geometry>{geometry}</geometry></collision>"


# Patient side manipulator, modified DH: the remote centre is the base's origin.
PSM = (
    Row("outer_yaw", "revolute", QUARTER, 0, QUARTER, 0, -4.71239, 4.71239),
    Row("outer_pitch", "revolute", -QUARTER, 0, -QUARTER, 0, -0.925025, 0.925025),
    Row(
        *("outer_insertion", "prismatic", QUARTER, 0, 0, -0.4318, 0.0, 0.24),
        box("0.06 0.06 0.08", "0 0 -0.04"),
    ),
    Row(
        *("roll", "revolute", 0, 0, 0, 0.4162, -4.53786, 4.53786),
        rod(0.0042, 0.39, "0 0 -0.2"),  # an 8 mm instrument
    ),
    Row("wrist_pitch", "revolute", -QUARTER, 0, -QUARTER, 0, -1.39626, 1.39626),
    Row("wrist_yaw", "revolute", -QUARTER, 0.0091, -QUARTER, 0, -1.39626, 1.39626),
    Row("gripper", "fixed", -QUARTER, 0, 0, 0.0102, 0, 0),
)
# Master tool manipulator, right, standard DH.
MTM = (
    Row(*("outer_yaw", "revolute", QUARTER, 0, -QUARTER, 0, -1.13446, 0.698132)),
    Row(
        *("shoulder_pitch", "revolute", 0, 0.2794, -QUARTER, 0, -0.261799, 0.872665),
        box("0.22 0.04 0.04", "-0.14 0 0"),
    ),
    Row(
        *("elbow_pitch", "revolute", -QUARTER, 0.3645, QUARTER, 0, -0.872665, 0.610865),
        box("0.30 0.03 0.03", "-0.18 0 0"),
    ),
    Row(
        *("wrist_platform", "revolute", QUARTER, 0, 0, 0.1506, -1.22173, 4.01426),
        box("0.02 0.09 0.02", "0 -0.06 0"),
    ),
    Row("wrist_pitch", "revolute", -QUARTER, 0, 0, 0, -1.5708, 3.14159),
    Row("wrist_yaw", "revolute", QUARTER, 0, -QUARTER, 0, -0.785398, 0.785398),
    Row("wrist_roll", "revolute", 0, 0, QUARTER, 0, -8.37758, 7.85398),
)


def urdf(name: str, rows: tuple[Row, ...], modified: bool) -> str:
    """A URDF of a DH table; the last row's link carries what is mounted."""
    lines = [f'<robot name="{name}">', '<link name="base"/>']
    above = "base"
    for row in rows:
        lines += _modified(row, above) if modified else _standard(row, above)
        above = f"{row.name}_link"
    return "\n".join([*lines, "</robot>"])


def _modified(row: Row, above: str) -> list[str]:
    """Rx(alpha) Tx(a), then Rz(theta) Tz(d): all before the joint, which is about z."""
    link = f"{row.name}_link"
    before = f'<joint name="{row.name}_at" type="fixed"><parent link="{above}"/>'
    origin = f'<origin xyz="{row.a} 0 0" rpy="{row.alpha} 0 0"/></joint>'
    return [
        f'<link name="{row.name}_foot"/><link name="{link}">{row.shape}</link>',
        f'{before}<child link="{row.name}_foot"/>{origin}',
        _joint(row, f"{row.name}_foot", link, f"0 0 {row.d}", f"0 0 {row.theta}"),
    ]


def _standard(row: Row, above: str) -> list[str]:
    """Rz(theta + q) Tz(d), then Tx(a) Rx(alpha) behind the joint."""
    link, head = f"{row.name}_link", f"{row.name}_head"
    behind = f'<joint name="{row.name}_behind" type="fixed"><parent link="{head}"/>'
    origin = f'<origin xyz="{row.a} 0 {row.d}" rpy="{row.alpha} 0 0"/></joint>'
    return [
        f'<link name="{head}"/><link name="{link}">{row.shape}</link>',
        _joint(row, above, head, "0 0 0", f"0 0 {row.theta}"),
        f'{behind}<child link="{link}"/>{origin}',
    ]


def _joint(row: Row, above: str, below: str, xyz: str, rpy: str) -> str:
    ends = f'<parent link="{above}"/><child link="{below}"/>'
    at = f'<origin xyz="{xyz}" rpy="{rpy}"/>'
    if row.kind == "fixed":
        return f'<joint name="{row.name}" type="fixed">{ends}{at}</joint>'
    limits = f'<limit lower="{row.lower}" upper="{row.upper}" effort="1" velocity="1"/>'
    return (
        f'<joint name="{row.name}" type="{row.kind}">{ends}{at}<axis xyz="0 0 1"/>'
        f"{limits}</joint>"
    )
