"""Probability of contact: against closed forms, against each other, and calibrated."""

import argparse
import json
import math
from pathlib import Path

import numpy as np
import pytest
from scipy.stats import norm

from borecheck.commands.uncertainty import add_probabilities, prepared
from borecheck.commands.uncertainty_options import add_options
from borecheck.errors import InputError, JointLimitError, UsageError
from borecheck.geometry.mesh.primitives import box
from borecheck.geometry.mesh.triangle_mesh import TriangleMesh
from borecheck.geometry.mesh_files.reading import write_stl
from borecheck.report.probability_words import lines
from borecheck.robots.robot import Robot, load_robot
from borecheck.robots.scene import Obstacle, Scene, load_scene
from borecheck.uncertainty.contact_probability import contact_probability
from borecheck.uncertainty.covariance import from_document, read_uncertainty
from borecheck.uncertainty.disturbed import Disturbed
from borecheck.uncertainty.linear import cuts, square_root

# A slide along x that carries a ball, which for distances along x is one point.
URDF = """<robot name="ball">
<link name="base"/><link name="ball"><collision><geometry>
<mesh filename="tip.stl"/></geometry></collision></link>
<joint name="s" type="prismatic"><parent link="base"/><child link="ball"/>
<axis xyz="1 0 0"/><limit lower="-1" upper="1" effort="1" velocity="1"/></joint>
</robot>"""

DOCUMENT = {
    "joints": {f"q{i}": "0.5mm" for i in (1, 2, 3)} | {"q4": "0.1deg", "q5": "0.1deg"},
    "dimensions": {"tip_offset_x": "1mm", "q4_offset": "0.1deg"},
    "registration": {"y": "1mm", "z": "1mm", "rx": "0.1deg"},
}


def octahedron(radius: float) -> TriangleMesh:
    points = radius * np.array(
        [[1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1]]
    )
    triangles = [
        [0, 2, 4], [2, 1, 4], [1, 3, 4], [3, 0, 4],
        [2, 0, 5], [1, 2, 5], [3, 1, 5], [0, 3, 5],
    ]  # fmt: skip
    return TriangleMesh("tip", points, np.array(triangles))


@pytest.fixture(scope="module")
def slide(tmp_path_factory: pytest.TempPathFactory) -> Robot:
    folder = tmp_path_factory.mktemp("slide")
    write_stl(folder / "tip.stl", octahedron(0.125))
    (folder / "ball.urdf").write_text(URDF)
    return load_robot(folder / "ball.urdf")


@pytest.fixture(scope="module")
def wall() -> Scene:
    """A large square at x = 0.25, seen by the ball from the left."""
    corners = np.array([[0.25, y, z] for y in (-5, 5) for z in (-5, 5)], dtype=float)
    mesh = TriangleMesh("wall", corners, np.array([[0, 1, 2], [1, 3, 2]]))
    obstacle = Obstacle("wall", "other", mesh, "made here")
    return Scene("wall", None, {}, "as given", (obstacle,), {}, (), ())


@pytest.fixture(scope="module")
def zerobot() -> Robot:
    return load_robot("zerobot")


@pytest.fixture(scope="module")
def gantry() -> Scene:
    return load_scene("ct_gantry", couch="no", patient="no")


def test_one_slide_before_a_wall_is_the_normal_distribution(
    slide: Robot, wall: Scene
) -> None:
    uncertainty = from_document({"joints": {"s": "3mm"}}, slide)
    for gap in (0.001, 0.004, 0.008):
        found = contact_probability(
            slide, wall, [0.125 - gap], uncertainty, samples=1500, risk=0.01
        )
        exact = norm.sf(gap / 0.003)
        assert found.clearance_m == pytest.approx(gap, abs=1e-9)
        assert found.sigma_m == pytest.approx(0.003, rel=1e-6)
        assert found.interval[0] < exact < found.interval[1]
        assert found.first_order == pytest.approx(exact, abs=3e-3)
        assert found.first_order_bounds == pytest.approx((exact, exact), rel=1e-4)
        assert found.margin_for_risk_m == pytest.approx(
            0.003 * norm.isf(0.01), rel=0.02
        )
        assert found.within_risk in ((False,) if exact > 0.01 else (True, None))


def test_margin_shifts_the_question(slide: Robot, wall: Scene) -> None:
    uncertainty = from_document({"joints": {"s": "3mm"}}, slide)
    asked = contact_probability(
        slide, wall, [0.115], uncertainty, margin=0.007, samples=2000
    )
    exact = norm.sf(0.003 / 0.003)
    assert asked.interval[0] < exact < asked.interval[1]
    assert asked.first_order_bounds is not None
    assert asked.first_order_bounds[0] == pytest.approx(exact, rel=1e-4)


def test_joint_and_registration_errors_add_up(slide: Robot, wall: Scene) -> None:
    both = {"joints": {"s": 0.003}, "registration": {"x": 0.004, "y": 0.5}}
    found = contact_probability(
        slide, wall, [0.1], from_document(both, slide), samples=0
    )
    assert found.sigma_m == pytest.approx(0.005, rel=1e-6)
    assert found.probability is None
    assert found.interval == (0.0, 1.0)


def test_correlation_counts(slide: Robot, wall: Scene) -> None:
    """Errors of registration along x and z, fully correlated, are one error."""
    block = {"names": ["x", "z"], "covariance": [[4e-6, 4e-6], [4e-6, 4e-6]]}
    uncertainty = from_document({"registration": block}, slide)
    root = square_root(uncertainty.covariance)
    assert np.abs(root @ root.T - uncertainty.covariance).max() < 1e-18
    found = contact_probability(slide, wall, [0.1], uncertainty, samples=0)
    assert found.sigma_m == pytest.approx(0.002, rel=1e-6)


def test_nominal_contact_has_no_first_order(slide: Robot, wall: Scene) -> None:
    uncertainty = from_document({"joints": {"s": "1mm"}}, slide)
    found = contact_probability(slide, wall, [0.15], uncertainty, samples=100)
    assert found.probability == 1.0
    assert found.first_order is found.first_order_bounds is None
    assert found.within_risk is False
    json.dumps(found.to_json(), allow_nan=False)


def test_gradient_against_differences(zerobot: Robot) -> None:
    """Joints, dimensions and registration move a point as the linear model says."""
    uncertainty = from_document(DOCUMENT, zerobot)
    q = np.array([0.05, 0.02, -0.03, 0.3, 0.2, 0.01])
    disturbed = Disturbed(zerobot, q, uncertainty)
    rng = np.random.default_rng(0)
    for link in ("needle", "holder", "rod_a"):
        in_link = rng.uniform(-0.05, 0.05, 3)
        normal = rng.standard_normal(3)
        normal /= np.linalg.norm(normal)
        T = disturbed.nominal[link]
        point = T[:3, :3] @ in_link + T[:3, 3]
        gradient = disturbed.gradient(link, point, normal)
        for i in range(len(uncertainty.names)):
            x = np.zeros(len(uncertainty.names))
            x[i] = 1e-4
            T_off = disturbed.placements(x)[link]
            moved = T_off[:3, :3] @ in_link + T_off[:3, 3] - point
            # the curvature of a turn of 1e-4 rad on an arm of 1 m: 5e-9 m
            assert normal @ moved == pytest.approx(1e-4 * gradient[i], abs=1e-8)


def test_dimension_errors_are_those_of_a_robot_built_with_them(zerobot: Robot) -> None:
    document = {"dimensions": {"tip_offset_z": "1mm", "needle_length": "1mm"}}
    uncertainty = from_document(document, zerobot)
    q = np.array([0.05, 0.02, -0.03, 0.3, 0.2, 0.01])
    disturbed = Disturbed(zerobot, q, uncertainty)
    off = disturbed.placements([0.002, 0.001])
    built = load_robot("zerobot", tip_offset_z="2mm", needle_length="0.121")
    for link, T in built.placements(q).items():
        assert np.abs(T - off[link]).max() < 1e-9, link


def test_first_order_and_draws_agree_in_the_gantry(
    zerobot: Robot, gantry: Scene
) -> None:
    uncertainty = from_document(DOCUMENT, zerobot)
    checked = 0
    for z in (0.0995, 0.1015):
        found = contact_probability(
            zerobot, gantry, [z, 0, 0, 0, 0, 0], uncertainty, samples=300
        )
        assert found.first_order is not None
        low, high = found.interval
        slack = 0.25 * found.first_order  # curvature of the bore, polygon corners
        assert low - slack <= found.first_order <= high + slack
        checked += found.first_order > 0.01
    assert checked >= 1


def test_flat_part_has_a_cut_for_each_corner(zerobot: Robot, gantry: Scene) -> None:
    uncertainty = from_document({"joints": {"q4": "0.3deg", "q1": "1mm"}}, zerobot)
    disturbed = Disturbed(zerobot, [0.095, 0, 0, 0, 0, 0], uncertainty)
    found = cuts(disturbed, gantry)
    assert found is not None
    holder = [i for i, (link, _) in enumerate(found.names) if link == "holder"]
    turn = found.gradient[holder, uncertainty.names.index("q4")]
    assert turn.min() < -0.01 < 0.01 < turn.max()


def test_stated_probabilities_are_calibrated(slide: Robot, wall: Scene) -> None:
    """As many cases end in contact as the stated probabilities add up to."""
    rng = np.random.default_rng(3)
    uncertainty = from_document({"joints": {"s": 0.003}}, slide)
    stated, happened = [], []
    for _ in range(80):
        q = 0.125 - rng.uniform(0.0005, 0.005)
        found = contact_probability(slide, wall, [q], uncertainty, samples=0)
        assert found.first_order is not None
        stated.append(found.first_order)
        happened.append(q + 0.003 * rng.standard_normal() >= 0.125)
    spread = math.sqrt(sum(p * (1 - p) for p in stated))
    assert abs(sum(happened) - sum(stated)) < 3.0 * spread
    assert sum(happened) > 5


def test_passing_through_a_thin_wall_counts_once(slide: Robot, wall: Scene) -> None:
    """Far-off draws see the wall from behind; that is no nearer cut."""
    uncertainty = from_document({"joints": {"s": 0.2}}, slide)
    disturbed = Disturbed(slide, [0.1], uncertainty)
    found = cuts(disturbed, wall)
    assert found is not None
    assert found.distance.min() == pytest.approx(0.025)


def test_more_draws_of_the_same_seed_repeat(slide: Robot, wall: Scene) -> None:
    uncertainty = from_document({"joints": {"s": "3mm"}}, slide)
    one, other = (
        contact_probability(slide, wall, [0.12], uncertainty, samples=200, seed=5)
        for _ in range(2)
    )
    assert one == other


def test_what_cannot_be_asked(slide: Robot, wall: Scene) -> None:
    uncertainty = from_document({"joints": {"s": "3mm"}}, slide)
    with pytest.raises(JointLimitError):
        contact_probability(slide, wall, [2.0], uncertainty)
    with pytest.raises(UsageError, match="risk"):
        contact_probability(slide, wall, [0.1], uncertainty, risk=0.0)
    with pytest.raises(UsageError, match="draws"):
        contact_probability(slide, wall, [0.1], uncertainty, samples=-1)
    empty = Scene("empty", None, {}, "as given", (), {}, (), ())
    with pytest.raises(UsageError, match="no obstacle"):
        contact_probability(slide, empty, [0.1], uncertainty)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "no JSON"),
        ("[]", "no JSON object"),
        ("{}", "no uncertainty is given"),
        ('{"joint": {}}', "unknown uncertainty 'joint'; did you mean 'joints'"),
        ('{"joints": {"t": 1}}', "unknown joint 't'"),
        ('{"joints": {"s": -1}}', "0 or more"),
        ('{"joints": {"s": "3deg"}}', "no length"),
        ('{"joints": {"s": NaN}}', "0 or more"),
        ('{"joints": {"s": true}}', "no standard deviation"),
        ('{"joints": 3}', "no object"),
        ('{"registration": {"roll": 1}}', "unknown direction 'roll'"),
        ('{"dimensions": {"l1": 1}}', "unknown argument 'l1'"),
        ('{"registration": {"names": ["x"], "covariance": [[-1]]}}', "negative"),
        (
            '{"registration": {"names": ["x", "y"], "covariance": [[1, 0], [1, 1]]}}',
            "not symmetric",
        ),
        ('{"registration": {"names": ["x"], "covariance": [[1, 0]]}}', "1 names"),
        ('{"registration": {"names": ["x"], "covariance": "a"}}', "no matrix"),
        (
            '{"registration": {"names": ["x", "x"], "covariance": [[1,0],[0,1]]}}',
            "twice",
        ),
        ('{"registration": {"names": 1, "covariance": [[1]]}}', "no list"),
        (
            '{"registration": {"names": ["x"], "covariance": [[1]], "y": 1}}',
            "nothing else",
        ),
    ],
)
def test_bad_files_give_one_line(
    text: str, words: str, slide: Robot, tmp_path: Path
) -> None:
    file = tmp_path / "u.json"
    file.write_text(text)
    with pytest.raises(InputError, match=words) as error:
        read_uncertainty(file, slide)
    assert "\n" not in str(error.value)


def test_missing_file_is_one_line(slide: Robot, tmp_path: Path) -> None:
    with pytest.raises(InputError, match="No such file"):
        read_uncertainty(tmp_path / "none.json", slide)
    with pytest.raises(InputError, match="directory"):
        read_uncertainty(tmp_path, slide)


def asked(file: Path, risk: float = 0.001) -> argparse.Namespace:
    parser = argparse.ArgumentParser()
    add_options(parser)
    return parser.parse_args(["--uncertainty", str(file), "--risk", str(risk)])


def test_clear_becomes_unknown_where_the_risk_is_not_kept(
    slide: Robot, wall: Scene, tmp_path: Path
) -> None:
    file = tmp_path / "u.json"
    file.write_text('{"joints": {"s": "3mm"}}')
    for gap, kept in ((0.004, False), (0.03, True)):
        block = {
            "verdict": "clear",
            "reason": "nearest",
            "q": {"s": 0.125 - gap},
            "margin_m": 0.0,
        }
        args = asked(file, 0.01)
        add_probabilities(block, slide, wall, prepared(args, slide), args)
        assert block["verdict"] == ("clear" if kept else "unknown")
        assert ("exceeds the accepted" in str(block["reason"])) is not kept
        told = lines(block)
        assert told[0].startswith("probability of contact")
        assert "a clearance of" in told[1]
        json.dumps(block, allow_nan=False)


def test_plans_are_judged_one_by_one_with_their_corridor(
    slide: Robot, wall: Scene, tmp_path: Path
) -> None:
    file = tmp_path / "u.json"
    file.write_text('{"registration": {"x": "3mm"}}')
    points = {"entry": [0.0, 0.0, 0.1], "target": [0.0, 0.0, 0.0]}
    far = {"verdict": "clear", "reason": "far", "q": {"s": 0.0}, "path": {}, **points}
    near = far | {"q": {"s": 0.121}}
    document = {"verdict": "clear", "plans": [far, near, {"verdict": "unknown"}]}
    args = asked(file)
    add_probabilities(document, slide, wall, prepared(args, slide), args)
    assert [plan["verdict"] for plan in document["plans"]] == [
        "clear",
        "unknown",
        "unknown",
    ]
    assert "lower bound" in document["plans"][0]["uncertainty"]["note"]
    assert document["verdict"] == "unknown"
    assert lines({"verdict": "clear"}) == []


def test_inside_a_solid_contact_is_certain(slide: Robot) -> None:
    """Far from any surface: the distance of surfaces alone would call it safe."""
    mesh = box("room", (3.0, 3.0, 3.0))
    uncertainty = from_document({"joints": {"s": "1mm"}}, slide)
    found = []
    for triangles in (mesh.triangles, mesh.triangles[1:]):
        room = TriangleMesh("room", mesh.vertices, triangles)
        obstacle = Obstacle("room", "other", room, "made here")
        scene = Scene("room", None, {}, "as given", (obstacle,), {}, (), ())
        found.append(
            contact_probability(
                slide, scene, [0.0], uncertainty, risk=0.1, samples=50, seed=1
            )
        )
    closed, opened = found
    assert (closed.clearance_m, closed.probability) == (0.0, 1.0)
    assert closed.first_order is None
    assert closed.within_risk is False
    assert opened.within_risk is None  # nobody knows what an open surface holds
