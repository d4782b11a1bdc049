import numpy as np
import pytest

from borecheck.errors import JointLimitError, UnknownNameError, UrdfError, UsageError
from borecheck.robots.model import RobotModel
from tests.places import ROBOTS

# a dozen float64 operations on numbers of size 1
ROUNDING = 1e-14


def model_of(name):
    return RobotModel((ROBOTS / f"{name}.urdf").read_text(), name)


def test_a_mimic_chain_is_resolved_to_its_leader():
    model = model_of("mimic_chain")
    assert model.joint_names == ("a",)
    positions = model.positions([0.4])
    assert positions == pytest.approx({"a": 0.4, "b": 1.05, "c": -0.55})


def test_placements_follow_the_chain():
    T = model_of("mimic_chain").placements([0.4])
    np.testing.assert_allclose(T["two"][:3, 3], [0.4, 1.05, 0.0], atol=ROUNDING)
    np.testing.assert_allclose(T["three"][:3, 3], [0.4, 1.05, 0.3], atol=ROUNDING)
    np.testing.assert_allclose(
        T["three"][:2, 0], [np.cos(-0.55), np.sin(-0.55)], atol=ROUNDING
    )


def test_placements_are_copies():
    model = model_of("two_link")
    first = model.placements([0.5])["arm"]
    kept = first.copy()
    model.placements([-0.5])
    assert np.array_equal(first, kept)


def test_limits_of_mimic_joints_count_too():
    text = (ROBOTS / "mimic_chain.urdf").read_text()
    model = RobotModel(text.replace('upper="5"', 'upper="1"'), "narrow")
    assert np.array_equal(model.check_limits([0.3]), [0.3])
    with pytest.raises(JointLimitError, match=r"b = 1\.25 m is outside"):
        model.check_limits([0.5])


def test_a_joint_beyond_its_limit_is_named_and_not_clipped():
    with pytest.raises(JointLimitError, match=r"j = 2\.5 rad is outside \[-2, 2\]"):
        model_of("two_link").check_limits([2.5])


@pytest.mark.parametrize("q", [[], [1.0, 2.0], [np.nan], [[1.0]]])
def test_q_that_is_none_is_refused(q):
    with pytest.raises(UsageError):
        model_of("two_link").check_limits(q)


def test_unknown_joint_lists_the_known_ones():
    with pytest.raises(UnknownNameError, match=r"known: j"):
        model_of("two_link").configuration({"elbow": 1.0})


def test_a_continuous_joint_takes_one_number():
    text = (ROBOTS / "two_link.urdf").read_text().replace("revolute", "continuous")
    model = RobotModel(text, "turning")
    T = model.placements([7.0])["arm"]
    np.testing.assert_allclose(T[0, 0], np.cos(7.0), atol=ROUNDING)


@pytest.mark.parametrize("kind", ["floating", "planar"])
def test_joints_without_a_single_position_are_refused(kind):
    text = (ROBOTS / "two_link.urdf").read_text().replace("revolute", kind)
    with pytest.raises(UrdfError, match=f"a {kind} joint has no single position"):
        RobotModel(text, "odd")


def test_random_configurations_are_within_limits_and_seeded():
    model = model_of("mimic_chain")
    drawn = model.random_configurations(np.random.default_rng(3), 40)
    again = model.random_configurations(np.random.default_rng(3), 40)
    assert np.array_equal(drawn, again)
    assert np.ptp(drawn) > 0.5
    for q in drawn:
        model.check_limits(q)
