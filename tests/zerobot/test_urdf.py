"""The xacro of Zerobot against Table 1, eq. (3) and the laws of its mechanism.

The references here are typed from [Matsuno2020] a third time: the product of the
table's rows, not the closed form that `borecheck fk` compares with.
"""

import subprocess
import sys

import numpy as np
import pytest

from borecheck.core.se3 import inverse
from borecheck.errors import UrdfError
from borecheck.robots.model import RobotModel
from borecheck.robots.robot import load_robot
from borecheck.robots.urdf.xacro import expand
from tests.places import PROJECT
from zerobot.description import DESCRIPTION
from zerobot.masses import part_masses

MOUNTS = {"+90": 1.0, "-90": -1.0}

# Chains of ten transforms of metre size: some ten rounding errors of 1e-16.
ROUNDING = 1e-14

# Assumed lengths, in metres, as the table in urdf/zerobot/README.md states them.
L1, L2, L3, L5, L6, L7, L9, LE = 0.90, 0.06, 0.10, 0.10, 0.26, 0.05, 0.08, 0.12


def model(**arguments):
    return RobotModel(expand(DESCRIPTION.xacro, arguments).text, "zerobot")


def craig(alpha, a, d, theta):
    """Eq. (1), element by element."""
    ca, sa, ct, st = np.cos(alpha), np.sin(alpha), np.cos(theta), np.sin(theta)
    return np.array(
        [
            [ct, -st, 0.0, a],
            [st * ca, ct * ca, -sa, -d * sa],
            [st * sa, ct * sa, ca, d * ca],
            [0.0, 0.0, 0.0, 1.0],
        ]
    )


def table_frames(q, s):
    """Frames W, 0..6 and E as products of the rows of Table 1."""
    quarter = np.pi / 2.0
    rows = [
        (0.0, 0.0, q[0], 0.0),
        (-quarter, 0.0, q[1], -quarter),
        (quarter, 0.0, q[2] - L3, 0.0),
        (s * quarter, 0.0, L1, np.pi + q[3]),
        (-quarter, L2, 0.0, quarter + q[4]),
        (quarter, 0.0, q[5], 0.0),
    ]
    l4 = s * L1 + s * L7
    T = np.array(
        [[0, -1, 0, -l4], [1, 0, 0, -L5], [0, 0, 1, L6], [0, 0, 0, 1]], dtype=float
    )
    frames = {"W": np.eye(4), "0": T}
    for i, row in enumerate(rows, start=1):
        T = T @ craig(*row)
        frames[str(i)] = T
    tool = np.eye(4)
    tool[:3, 3] = (-L7, 0.0, L9 + LE)
    frames["E"] = T @ tool
    return frames


def samples(robot, count, seed):
    rng = np.random.default_rng(seed)
    return rng.uniform(robot.lower, robot.upper, size=(count, 6))


@pytest.mark.parametrize("mount", MOUNTS)
def test_frames_are_those_of_table_1(mount):
    robot = model(mount=mount)
    tips = []
    for q in samples(robot, 50, seed=1):
        expected = table_frames(q, MOUNTS[mount])
        placed = robot.placements(q)
        for name, T in expected.items():
            np.testing.assert_allclose(placed[name], T, atol=ROUNDING, err_msg=name)
        tips.append(placed["E"][:3, 3])
    assert np.ptp(tips, axis=0).min() > 0.3  # premise: the tip went far in x, y and z


@pytest.mark.parametrize("mount", MOUNTS)
def test_tip_stands_at_the_isocentre_at_zero(mount):
    T_world_tip = model(mount=mount).placements(np.zeros(6))["E"]
    np.testing.assert_allclose(T_world_tip[:3, 3], 0.0, atol=ROUNDING)
    np.testing.assert_allclose(T_world_tip[:3, 2], (0, 0, -1), atol=ROUNDING)


@pytest.mark.parametrize("mount", MOUNTS)
def test_drives_stand_on_the_side_of_the_mount(mount):
    placed = model(mount=mount).placements(np.zeros(6))
    x = MOUNTS[mount] * placed["3"][0, 3]
    assert x == pytest.approx(-0.95)


@pytest.mark.parametrize("mount", MOUNTS)
@pytest.mark.parametrize("offset", ["0", "0.02"])
def test_loops_close_for_every_q5(mount, offset):
    robot = model(mount=mount, q5_offset=offset)
    moved = []
    for q in samples(robot, 30, seed=2):
        placed = robot.placements(q)
        for loop in "ab":
            rod, holder = placed[f"loop_{loop}_rod"], placed[f"loop_{loop}_holder"]
            np.testing.assert_allclose(rod, holder, atol=ROUNDING)
        moved.append((inverse(placed["4"]) @ placed["loop_a_rod"])[:3, 3])
    assert np.ptp(moved, axis=0).max() > 0.03  # premise: the rod did move


def test_rods_keep_the_orientation_of_frame_4():
    robot = model()
    for q in samples(robot, 20, seed=3):
        placed = robot.placements(q)
        for rod in ("rod_a", "rod_b"):
            np.testing.assert_allclose(
                placed[rod][:3, :3], placed["arm"][:3, :3], atol=ROUNDING
            )


def test_literal_reading_misses_the_holder_by_13_mm():
    q = np.array([0.0, 0.0, 0.0, 0.0, np.radians(15.0), 0.0])
    placed = model(level_parts="frame4").placements(q)
    miss = np.linalg.norm(placed["loop_a_rod"][:3, 3] - placed["loop_a_holder"][:3, 3])
    lever = 0.05
    assert miss == pytest.approx(2.0 * lever * np.sin(np.radians(7.5)), abs=ROUNDING)
    assert miss == pytest.approx(0.01305, abs=1e-5)
    at_zero = model(level_parts="frame4").placements(np.zeros(6))
    parallelogram = model().placements(np.zeros(6))
    for link in ("rod_a", "rod_b"):
        np.testing.assert_allclose(at_zero[link], parallelogram[link], atol=ROUNDING)


def test_joint_offset_is_a_shift_of_the_joint():
    shift = np.array([0.003, -0.002, 0.004, 0.01, -0.02, 0.005])
    arguments = {f"q{i + 1}_offset": repr(float(v)) for i, v in enumerate(shift)}
    q = np.array([0.1, -0.05, 0.02, 0.3, -0.2, 0.04])
    shifted, plain = model(**arguments).placements(q), model().placements(q + shift)
    for name in plain:
        np.testing.assert_allclose(
            shifted[name], plain[name], atol=ROUNDING, err_msg=name
        )


def test_tip_offset_is_along_frame_6():
    offset = np.array([0.002, -0.001, 0.003])
    names = ("tip_offset_x", "tip_offset_y", "tip_offset_z")
    arguments = dict(zip(names, map(repr, offset.tolist()), strict=True))
    q = np.array([0.1, -0.05, 0.02, 0.3, -0.2, 0.04])
    with_offset, plain = model(**arguments).placements(q), model().placements(q)
    moved = with_offset["E"][:3, 3] - plain["E"][:3, 3]
    np.testing.assert_allclose(moved, plain["6"][:3, :3] @ offset, atol=ROUNDING)


def test_longer_needle_moves_the_tip_only():
    q = np.array([0.1, -0.05, 0.02, 0.3, -0.2, 0.04])
    long, short = model(needle_length="0.15"), model()
    moved = long.placements(q)["E"][:3, 3] - short.placements(q)["E"][:3, 3]
    np.testing.assert_allclose(
        moved, 0.03 * short.placements(q)["E"][:3, 2], atol=ROUNDING
    )
    np.testing.assert_allclose(long.placements(q)["6"], short.placements(q)["6"])


def test_stages_share_the_frame_of_the_base_at_zero():
    for mount in MOUNTS:
        placed = model(mount=mount).placements(np.zeros(6))
        for part in ("lift", "slide", "cross"):
            np.testing.assert_allclose(placed[part], placed["base"], atol=ROUNDING)
        for part in ("arm", "holder", "carriage", "needle", "crank", "rod_a"):
            np.testing.assert_allclose(
                placed[part][:3, :3], placed["base"][:3, :3], atol=ROUNDING
            )


def test_limits_are_those_of_the_readme():
    robot = model()
    assert robot.joint_names == ("q1", "q2", "q3", "q4", "q5", "q6")
    degrees = np.radians([45.0, 30.0])
    np.testing.assert_allclose(robot.upper, [0.25, 0.25, 0.25, *degrees, 0.15])
    np.testing.assert_allclose(robot.lower, [-0.25, -0.25, -0.25, *-degrees, 0.0])


@pytest.mark.parametrize(
    ("name", "value", "says"),
    [("mount", "45", "mount must be"), ("level_parts", "x", "level_parts must be")],
)
def test_impossible_arguments_are_refused(name, value, says):
    with pytest.raises(UrdfError, match=says):
        model(**{name: value})


def test_masses_are_those_of_the_shapes():
    links = _inertials(expand(DESCRIPTION.xacro, {}).text)
    for name, expected in part_masses().items():
        mass, com, inertia = links[name]
        # Four digits are typed. The needle is typed as a full cylinder, without its
        # point (3 mm of 120 mm): 2 % heavier, its centre 1 mm lower.
        tolerance, place = (0.03, 1.1e-3) if name == "needle" else (2e-3, 2e-4)
        assert mass == pytest.approx(expected.mass, rel=tolerance)
        np.testing.assert_allclose(com, expected.com, atol=place)
        largest = np.abs(expected.inertia).max()
        np.testing.assert_allclose(
            inertia, expected.inertia, atol=2.0 * tolerance * largest
        )


def test_inertias_are_physical():
    links = _inertials(expand(DESCRIPTION.xacro, {}).text)
    assert len(links) == 13  # eleven parts and two pins
    for name, (mass, _, inertia) in links.items():
        moments = np.linalg.eigvalsh(inertia)
        assert mass > 0.0, name
        assert moments[0] > 0.0, name
        assert moments[0] + moments[1] >= moments[2] * (1.0 - 1e-9), name


def _inertials(text):
    from lxml import etree

    found = {}
    for link in etree.fromstring(text.encode()).iter("link"):
        inertial = link.find("inertial")
        if inertial is None:
            continue
        i = {k: float(v) for k, v in inertial.find("inertia").attrib.items()}
        tensor = np.array(
            [
                [i["ixx"], i["ixy"], i["ixz"]],
                [i["ixy"], i["iyy"], i["iyz"]],
                [i["ixz"], i["iyz"], i["izz"]],
            ]
        )
        com = np.array([float(v) for v in inertial.find("origin").get("xyz").split()])
        found[link.get("name")] = float(inertial.find("mass").get("value")), com, tensor
    return found


def test_compiled_urdf_is_up_to_date():
    script = PROJECT / "scripts" / "compile_urdf.py"
    run = subprocess.run(
        [sys.executable, script, "--check", "zerobot", "ct_gantry"],
        capture_output=True,
        text=True,
    )
    assert run.returncode == 0, run.stderr


def test_compiled_urdf_loads_in_pinocchio_with_mimic():
    pinocchio = pytest.importorskip("pinocchio")
    for name in ("zerobot.urdf", "zerobot_mount-90.urdf"):
        path = DESCRIPTION.xacro.parent / name
        assert pinocchio.buildModelFromUrdf(str(path), mimic=True).nq == 6


def test_allowed_contacts_name_links():
    links = set(model().link_names)
    assert DESCRIPTION.needle_link in links
    assert DESCRIPTION.tool_frame in links
    assert set(DESCRIPTION.frames.values()) <= links
    for first, second, reason in DESCRIPTION.allowed_contacts:
        assert {first, second} <= links
        assert reason


def test_no_part_touches_another_at_the_corners_of_the_workspace():
    """Neighbours in the chain are excepted; 64 corners and random poses between."""
    coal_contact = pytest.importorskip("borecheck.geometry.coal_engine.contact")
    robot = load_robot("zerobot")
    meshes = [coal_contact.CoalMesh(part.mesh) for part in robot.parts]
    assert len(robot.self_pairs) > 30  # premise: most pairs are looked at
    lower, upper = robot.model.lower, robot.model.upper
    corners = np.array(np.meshgrid(*zip(lower, upper, strict=True))).reshape(6, -1).T
    for q in [*corners, *samples(robot.model, 30, seed=4)]:
        placed = robot.placements(q)
        for i, j in robot.self_pairs:
            a, b = robot.parts[i].link, robot.parts[j].link
            touches = coal_contact.first_contact(
                meshes[i], placed[a], meshes[j], placed[b]
            )
            assert not touches, f"{a} touches {b} at {q}"
