"""The closed form against the paper's chain, differences, and its own inverse."""

import subprocess
import sys

import numpy as np
import pytest

from mri_arm import inverse as inverse_module
from mri_arm.dimensions import LIMITS, Dimensions, dimensions, sources
from mri_arm.kinematics import (
    BODIES,
    FRAMES,
    forward,
    inverse,
    inverse_pose,
    jacobian,
    singularity,
)
from mri_arm.parameters import NAMES, chain, nominal

ROUNDING = 1e-12  # a dozen products of numbers near 1
DIFFERENCES = 1e-7  # central differences with a step of 1e-6

LOWER = np.array([lower for lower, _ in LIMITS.values()])
UPPER = np.array([upper for _, upper in LIMITS.values()])
MOUNTS = ("along", "square")


def random_q(count, seed=0):
    return np.random.default_rng(seed).uniform(LOWER, UPPER, (count, 7))


def tool(mount, insertion):
    """T_6_E typed a second time: x_E = x_6, the needle along y_6 or -z_6."""
    T = np.eye(4)
    if mount == "along":
        T[:3, :3] = [[1, 0, 0], [0, 0, 1], [0, -1, 0]]
        T[:3, 3] = 0, 0.25 + insertion, 0
    else:
        T[:3, :3] = [[1, 0, 0], [0, -1, 0], [0, 0, -1]]
        T[:3, 3] = 0, 0.10, -0.15 - insertion
    return T


@pytest.mark.parametrize("mount", MOUNTS)
def test_closed_form_is_the_papers_chain(mount):
    place = {"base_x": 0.2, "base_y": 1.1, "base_yaw": 2.8, "needle_mount": mount}
    for q in random_q(100):
        T = forward(q, **place)
        T_W_6 = chain(q[:6], nominal())
        np.testing.assert_allclose(T["W"] @ T_W_6, T["6"], atol=ROUNDING)
        np.testing.assert_allclose(T["6"] @ tool(mount, q[6]), T["E"], atol=ROUNDING)


def test_frames_are_parallel_to_the_base_at_zero():
    T = forward(np.zeros(7))
    for name in FRAMES[:-1]:
        np.testing.assert_array_equal(T[name][:3, :3], np.eye(3), err_msg=name)
    assert set(T) == {*FRAMES, *BODIES}


def test_many_configurations_at_once_are_the_single_ones():
    q = random_q(5)
    together = forward(q)
    for i in range(len(q)):
        for name, T in forward(q[i]).items():
            np.testing.assert_array_equal(together[name][i], T)


def test_the_forearm_is_as_long_as_published():
    T = forward(random_q(1)[0])
    distance = np.linalg.norm(T["5"][:3, 3] - T["4"][:3, 3])
    assert distance == pytest.approx(1.0, abs=ROUNDING)


@pytest.mark.parametrize("mount", MOUNTS)
def test_jacobian_against_differences(mount):
    step = 1e-6
    for q in random_q(20):
        J = jacobian(q, needle_mount=mount)
        for j in range(7):
            after = forward(q + step * np.eye(7)[j], needle_mount=mount)["E"]
            before = forward(q - step * np.eye(7)[j], needle_mount=mount)["E"]
            rate = (after - before) / (2 * step)
            spin = rate[:3, :3] @ forward(q, needle_mount=mount)["E"][:3, :3].T
            np.testing.assert_allclose(J[:3, j], rate[:3, 3], atol=DIFFERENCES)
            turned = [spin[2, 1], spin[0, 2], spin[1, 0]]
            np.testing.assert_allclose(J[3:, j], turned, atol=DIFFERENCES)


def test_singularity_measures_multiply_to_the_determinant():
    d = Dimensions()
    for q in random_q(50):
        T = forward(q)
        J = jacobian(q)[:, :6]
        lever = T["5"][:3, 3] - T["E"][:3, 3]
        J[:3] += np.cross(J[3:].T, lever).T  # of the wrist centre
        measures = np.prod(list(singularity(q).values()))
        scale = d.upper_arm * d.forearm * (d.upper_arm + d.forearm)
        assert abs(np.linalg.det(J)) == pytest.approx(measures * scale, abs=ROUNDING)


@pytest.mark.parametrize("mount", MOUNTS)
def test_inverse_of_a_pose_gives_the_joints_back(mount):
    for q in random_q(300):
        T = forward(q, needle_mount=mount)["E"]
        solutions = inverse_pose(T, q[6], needle_mount=mount)
        branches = len(solutions.configurations) + len(solutions.rejected)
        assert branches == 8
        nearest = min(np.abs(s - q).max() for s in solutions.configurations)
        assert (
            nearest < 1e-7
        )  # near |q3| = 90 or q5 = 0 the inverse loses half the digits
        for s in solutions.configurations:
            np.testing.assert_allclose(
                forward(s, needle_mount=mount)["E"], T, atol=1e-11
            )


@pytest.mark.parametrize("mount", MOUNTS)
def test_inverse_of_a_needle_puts_the_needle_there(mount):
    found = 0
    for q in random_q(30, seed=3):
        T = forward(q, needle_mount=mount)["E"]
        solutions = inverse(T[:3, 3], 2.0 * T[:3, 2], q[6], needle_mount=mount)
        for s in solutions.configurations:
            placed = forward(s, needle_mount=mount)["E"]
            np.testing.assert_allclose(placed[:3, 2:], T[:3, 2:], atol=1e-11)
            assert ((s >= LOWER) & (s <= UPPER)).all()
            found += 1
    assert found > 30


def test_wrist_in_line_puts_all_the_roll_into_the_last_joint():
    q = np.array([0.1, 0.05, -0.1, 0.3, 0.0, 0.2, 0.0])
    solutions = inverse_pose(forward(q)["E"])
    best = min(solutions.configurations, key=lambda s: np.abs(s[:3] - q[:3]).max())
    np.testing.assert_allclose(best, [0.1, 0.05, -0.1, 0, 0, 0.5, 0], atol=1e-7)


def test_what_is_out_of_reach_says_so():
    solutions = inverse([5.0, 0, 0], [0, 0, -1], 0.0)
    assert not solutions.configurations
    assert "the wrist cannot get there" in solutions.rejected[0]


def test_rejected_branches_name_the_limit():
    q = np.array([0.2, 0.5, -0.2, 0.3, 0.6, 0.1, 0.0])
    rejected = inverse_pose(forward(q)["E"]).rejected
    assert any("q2 = 28.648 deg is above its limit 20.000 deg" in r for r in rejected)


@pytest.mark.parametrize(
    ("tip", "direction", "insertion"),
    [
        ([0, 0, np.nan], [0, 0, 1], 0.0),
        ([0, 0], [0, 0, 1], 0.0),
        ([0, 0, 0], [0, 0, 0], 0.0),
        ([0, 0, 0], [0, 0, 1], np.inf),
    ],
)
def test_numbers_that_mean_nothing_are_refused(tip, direction, insertion):
    with pytest.raises(ValueError, match=r"finite|shape|length|must be"):
        inverse(tip, direction, insertion)


def test_unknown_arguments_are_refused():
    with pytest.raises(ValueError, match="needle_mount 'up'"):
        forward(np.zeros(7), needle_mount="up")
    with pytest.raises(ValueError, match="unknown argument 'mount'"):
        forward(np.zeros(7), mount="along")


def test_every_dimension_and_parameter_is_seen():
    q = random_q(20, seed=5)
    before = forward(q)["E"]
    for name in dimensions():
        moved = forward(q, perturbed={name: 1e-4})["E"]
        assert np.abs(moved - before).max() > 1e-6, name
    tip = tool("along", 0.0) @ np.array([0.01, 0.02, 0, 1])
    before_chain = chain(q[:, :6], nominal()) @ tip
    assert len(NAMES) == 24
    for name in NAMES:
        moved_chain = chain(q[:, :6], nominal() | {name: nominal()[name] + 1e-4}) @ tip
        assert np.abs(moved_chain - before_chain).max() > 1e-6, name


def test_every_number_has_a_source():
    assert set(sources()) == set(dimensions())
    assert all(len(text) > 10 for text in sources().values())


def test_kinematics_stands_alone():
    code = (
        "import sys, mri_arm.kinematics, mri_arm.parameters;"
        "bad = {'borecheck', 'pinocchio', 'xacro', 'scipy'} & set(sys.modules);"
        "assert not bad, bad"
    )
    subprocess.run([sys.executable, "-c", code], check=True)


def test_limits_hold_the_published_ones():
    degrees = {name: np.degrees(pair) for name, pair in LIMITS.items()}
    np.testing.assert_allclose(degrees["q2"], (-20, 20))
    np.testing.assert_allclose(degrees["q3"], (-42, 42))
    np.testing.assert_allclose(degrees["q6"], (-75, 75))
    assert inverse_module.broken_limits(np.zeros(7)) == ()
