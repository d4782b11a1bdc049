"""Probability of contact: against closed forms, against each other, and calibrated."""

import argparse
import dataclasses
import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.stats import norm

from borecheck.commands.options.uncertainty import add_options
from borecheck.commands.uncertainty import add_probabilities, prepared
from borecheck.errors import InputError, JointLimitError, UsageError
from borecheck.geometry.mesh.primitives import box
from borecheck.geometry.mesh.triangle_mesh import TriangleMesh
from borecheck.geometry.mesh_files.reading import write_stl
from borecheck.report.probability_words import cells, lines
from borecheck.robots.robot import Robot, load_robot, robot_with
from borecheck.robots.scene import Obstacle, Scene, load_scene
from borecheck.uncertainty.contact_probability import contact_probability
from borecheck.uncertainty.covariance import (
    from_document,
    read_uncertainty,
    square_root,
)
from borecheck.uncertainty.disturbed import Disturbance, Disturbed
from borecheck.uncertainty.estimate import FirstOrder, first_order
from borecheck.uncertainty.intervals import upper_limit
from borecheck.uncertainty.linear import cuts

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


def estimated(*args: Any, **given: Any) -> FirstOrder:
    found = first_order(*args, **given)
    assert found is not None  # there is an obstacle
    return found


def test_one_slide_before_a_wall_is_the_normal_distribution(
    slide: Robot, wall: Scene
) -> None:
    uncertainty = from_document({"joints": {"s": "3mm"}}, slide)
    for gap in (0.001, 0.004, 0.008):
        q = [0.125 - gap]
        found = contact_probability(slide, wall, q, uncertainty, samples=600, risk=0.01)
        exact = norm.sf(gap / 0.003)
        share = exact / found.outside
        error = found.outside * math.sqrt(share * (1.0 - share) / 600)
        assert found.probability == pytest.approx(exact, abs=3.0 * error)
        assert found.within_risk in ((False,) if exact > 0.01 else (True, None))
        # nothing is drawn where the distance itself says that all is clear
        assert found.proven_radius == pytest.approx(gap / 0.003, rel=0.06)
        told = estimated(slide, wall, q, uncertainty, risk=0.01)
        assert told.clearance_m == pytest.approx(gap, abs=1e-9)
        assert told.sigma_m == pytest.approx(0.003, rel=1e-6)
        assert told.probability == pytest.approx(exact, abs=3e-3)
        assert told.span == pytest.approx((exact, exact), rel=1e-4)
        assert told.margin_for_risk_m == pytest.approx(0.003 * norm.isf(0.01), rel=0.02)


def test_margin_shifts_the_question(slide: Robot, wall: Scene) -> None:
    uncertainty = from_document({"joints": {"s": "3mm"}}, slide)
    asked = contact_probability(
        slide, wall, [0.115], uncertainty, margin=0.007, samples=400
    )
    exact = norm.sf(0.003 / 0.003)
    assert asked.lower < exact < asked.upper
    told = estimated(slide, wall, [0.115], uncertainty, margin=0.007)
    assert told.span is not None
    assert told.span[0] == pytest.approx(exact, rel=1e-4)


def test_joint_and_registration_errors_add_up(slide: Robot, wall: Scene) -> None:
    both = {"joints": {"s": 0.003}, "registration": {"x": 0.004, "y": 0.5}}
    told = estimated(slide, wall, [0.1], from_document(both, slide))
    assert told.sigma_m == pytest.approx(0.005, rel=1e-6)


def test_correlation_counts(slide: Robot, wall: Scene) -> None:
    """Errors of registration along x and z, fully correlated, are one error."""
    block = {"names": ["x", "z"], "covariance": [[4e-6, 4e-6], [4e-6, 4e-6]]}
    uncertainty = from_document({"registration": block}, slide)
    root = square_root(uncertainty.covariance)
    assert root.shape == (2, 1)
    assert np.abs(root @ root.T - uncertainty.covariance).max() < 1e-18
    told = estimated(slide, wall, [0.1], uncertainty)
    assert told.sigma_m == pytest.approx(0.002, rel=1e-6)


def test_nominal_contact_is_as_good_as_certain(slide: Robot, wall: Scene) -> None:
    uncertainty = from_document({"joints": {"s": "1mm"}}, slide)
    found = contact_probability(slide, wall, [0.15], uncertainty, samples=100)
    assert found.probability == 1.0
    assert found.within_risk is False
    assert estimated(slide, wall, [0.15], uncertainty).probability is None
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
        q = [z, 0, 0, 0, 0, 0]
        found = contact_probability(zerobot, gantry, q, uncertainty, samples=100)
        estimate = estimated(zerobot, gantry, q, uncertainty).probability
        assert estimate is not None
        slack = 0.25 * estimate  # curvature of the bore, polygon corners
        assert found.interval[0] - slack <= estimate <= found.interval[1] + slack
        checked += estimate > 0.01
    assert checked >= 1


def test_flat_part_has_a_cut_for_each_corner(zerobot: Robot, gantry: Scene) -> None:
    uncertainty = from_document({"joints": {"q4": "0.3deg", "q1": "1mm"}}, zerobot)
    disturbed = Disturbed(zerobot, [0.095, 0, 0, 0, 0, 0], uncertainty)
    found = cuts(disturbed, gantry)
    assert found is not None
    holder = [i for i, (link, _) in enumerate(found.names) if link == "holder"]
    turn = found.gradient[holder, uncertainty.names.index("q4")]
    assert turn.min() < -0.01 < 0.01 < turn.max()


def test_first_order_is_calibrated_before_a_wall(slide: Robot, wall: Scene) -> None:
    """As many cases end in contact as the stated probabilities add up to."""
    rng = np.random.default_rng(3)
    uncertainty = from_document({"joints": {"s": 0.003}}, slide)
    stated, happened = [], []
    for _ in range(80):
        q = 0.125 - rng.uniform(0.0005, 0.005)
        told = estimated(slide, wall, [q], uncertainty)
        assert told.probability is not None
        stated.append(told.probability)
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


def test_a_dimension_that_shapes_a_part_reshapes_it(zerobot: Robot) -> None:
    uncertainty = from_document({"dimensions": {"needle_length": "1mm"}}, zerobot)
    disturbance = Disturbance(zerobot, uncertainty)
    built = load_robot("zerobot", needle_length="0.1215")
    (needle,) = disturbance.dimensions.shapes
    mesh = zerobot.parts[needle].mesh
    reshaped = disturbance.dimensions.reshaped(needle, mesh, np.array([0.0015]))
    assert np.abs(reshaped.vertices - mesh.vertices).max() > 0.7e-3
    # both are files of float32
    assert np.abs(reshaped.vertices - built.parts[needle].mesh.vertices).max() < 2e-7


def test_a_dimension_that_bends_its_effect_is_refused(tmp_path: Path) -> None:
    file = tmp_path / "bent.urdf.xacro"
    text = URDF.replace(
        '<robot name="ball">',
        '<robot name="ball" xmlns:xacro="http://www.ros.org/wiki/xacro">'
        '<xacro:arg name="h" default="0"/><xacro:property name="h" value="$(arg h)"/>',
    )
    text = text.replace(
        '<axis xyz="1 0 0"/>', '<origin xyz="${h*h} 0 0"/><axis xyz="1 0 0"/>'
    )
    file.write_text(text)
    write_stl(tmp_path / "tip.stl", octahedron(0.125))
    robot = robot_with(file, {"h": "0.1"})
    uncertainty = from_document({"dimensions": {"h": "5mm"}}, robot)
    with pytest.raises(UsageError, match="in another way than in proportion"):
        Disturbance(robot, uncertainty)
    words = robot_with(file, {"h": "0.1"}, "as given")
    named = dataclasses.replace(words, arguments={"h": "long"})
    with pytest.raises(UsageError, match="'long', not a number"):
        Disturbance(named, from_document({"dimensions": {"h": "5mm"}}, named))


def test_nothing_uncertain_is_the_nominal_verdict(slide: Robot, wall: Scene) -> None:
    uncertainty = from_document({"joints": {"s": 0}}, slide)
    kept = contact_probability(slide, wall, [0.1], uncertainty)
    assert (kept.contacts, kept.answer) == (0, "kept")
    broken = contact_probability(slide, wall, [0.13], uncertainty)
    assert (broken.probability, broken.answer) == (1.0, "exceeded")


def test_as_many_draws_as_the_risk_takes(slide: Robot, wall: Scene) -> None:
    """Nominal contact of another pair keeps the shell from being used."""
    uncertainty = from_document({"joints": {"s": "3mm"}}, slide)
    asked = contact_probability(slide, wall, [0.118], uncertainty, risk=0.02)
    p = norm.sf(0.007 / 0.003)
    assert p < 0.02
    assert asked.outside * upper_limit(0, asked.samples) <= 0.02
    few = contact_probability(
        slide, wall, [0.118], uncertainty, risk=0.02 * asked.outside, samples=100
    )
    assert few.answer != "kept"
    assert few.draws_needed is None or few.draws_needed > 100


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
        ('{"joints": {"s": true}}', "True is no number"),
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
        ('{"joints": {"s": "1mm", "s": "2mm"}}', "'s' stands twice"),
        ('{"joints": {"s": 1}, "joints": {"s": 2}}', "'joints' stands twice"),
        ('{"joints": {"s": 1' + 400 * "0" + "}}", "too large"),
        ('{"joints": {"s": 1e400}}', "0 or more"),
        ('{"joints": {"s": "1e400mm"}}', "too large"),
        ('{"joints": {"s": 3}}', "is its unit right"),
        ('{"registration": {"rx": 57}}', "is its unit right"),
        ('{"registration": {"names": ["rx"], "covariance": [[90]]}}', "its unit"),
        ('{"joints": {"s": [1]}}', "is no number"),
        ('{"registration": {"names": [["x"]], "covariance": [[1]]}}', "no list of"),
        ('{"registration": {"names": [null], "covariance": [[1]]}}', "no list of"),
        ('{"registration": {"names": ["x"], "covariance": [["1"]]}}', "no number"),
        ('{"registration": {"names": ["x"], "covariance": [[true]]}}', "no number"),
        ('{"registration": {"names": ["x"], "covariance": [[NaN]]}}', "not finite"),
        # in units of their own: a radian beside a micrometre hides nothing
        (
            '{"registration": {"names": ["x", "rx"], '
            '"covariance": [[-1e-8, 0], [0, 1]]}}',
            "negative variance",
        ),
        (
            '{"registration": {"names": ["x", "y", "rx"], "covariance": '
            "[[1e-8, 2e-8, 0], [2e-8, 1e-8, 0], [0, 0, 1]]}}",
            "correlation beyond 1",
        ),
        (
            '{"registration": {"names": ["x", "y", "rx"], "covariance": '
            "[[1e-8, 5e-9, 0], [-5e-9, 1e-8, 0], [0, 0, 1]]}}",
            "not symmetric",
        ),
        (
            '{"registration": {"names": ["x", "y", "z"], "covariance": '
            "[[1, 0.9, 0.9], [0.9, 1, -0.9], [0.9, -0.9, 1]]}}",
            "negative eigenvalue",
        ),
        (
            '{"registration": {"names": ["x", "y"], "covariance": [[0, 1], [1, 1]]}}',
            "variance 0 varies",
        ),
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
    args = parser.parse_args(["--uncertainty", str(file), "--risk", str(risk)])
    return argparse.Namespace(
        **vars(args), margin="0", checker="exact", margin_kind=None
    )


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
        assert f"risk of 0.01 {'kept' if kept else 'exceeded'}" in told[1]
        assert "a clearance of" in told[-1]
        json.dumps(block, allow_nan=False)


def test_plans_are_judged_one_by_one_with_their_corridor(
    slide: Robot, wall: Scene, tmp_path: Path
) -> None:
    file = tmp_path / "u.json"
    file.write_text('{"registration": {"x": "3mm"}}')
    points = {"entry": [0.0, 0.0, 0.1], "target": [0.0, 0.0, 0.0]}

    def plan(s: float) -> dict[str, Any]:
        path = {"waypoints": [{"s": s}, {"s": s - 0.05}]}
        return {
            **points,
            "name": f"to {s}",
            "verdict": "clear",
            "reason": "far",
            "q": {"s": s},
            "path": path,
        }

    far, near = plan(0.0), plan(0.121)
    document: dict[str, Any] = {
        "verdict": "clear",
        "plans": [far, near, {"verdict": "unknown"}],
    }
    args = asked(file)
    add_probabilities(document, slide, wall, prepared(args, slide), args)
    assert [plan["verdict"] for plan in document["plans"]] == [
        "clear",
        "unknown",
        "unknown",
    ]
    assert [cells(block)[1] for block in document["plans"]] == [
        "0.001 kept",
        "0.001 exceeded",
        "-",
    ]
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
    assert closed.probability == 1.0
    assert closed.within_risk is False
    assert opened.undecided == 50  # nobody knows what an open surface holds
    assert opened.within_risk is None
