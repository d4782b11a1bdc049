import numpy as np
import pytest

from borecheck.core.se3 import transform
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
    with pytest.raises(JointLimitError, match=r"j = 2\.00000001 rad is outside"):
        model_of("two_link").check_limits([2.00000001])


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


FREE = """<robot name="r"><link name="world">{world}</link><link name="cart">
  <collision><geometry><box size="1 1 1"/></geometry></collision></link>
  <joint name="free" type="{kind}"><origin xyz="0.1 0.2 0.3" rpy="0 0 0.5"/>
  <parent link="world"/><child link="cart"/></joint></robot>"""


@pytest.mark.parametrize("kind", ["floating", "planar"])
def test_a_free_joint_that_carries_the_robot_stands_at_its_origin(kind):
    model = RobotModel(FREE.format(kind=kind, world=""), "mobile")
    assert model.standing == ("free",)
    assert model.joint_names == ()
    expected = transform((0.1, 0.2, 0.3), (0.0, 0.0, 0.5))
    np.testing.assert_allclose(model.placements([])["cart"], expected, atol=ROUNDING)


@pytest.mark.parametrize("kind", ["floating", "planar"])
def test_a_free_joint_that_carries_a_part_only_is_refused(kind):
    world = "<collision><geometry><box size='1 1 1'/></geometry></collision>"
    with pytest.raises(UrdfError, match="does not carry the whole robot"):
        RobotModel(FREE.format(kind=kind, world=world), "table and cart")


def test_a_chain_in_many_pieces_is_placed_as_one(rng, monkeypatch):
    links = "".join(f'<link name="l{i}"/>' for i in range(40))
    joints = "".join(
        f'<joint name="j{i}" type="continuous"><origin xyz="0.1 0 {i}" rpy="0.3 0 1"/>'
        f'<parent link="l{i // 2}"/><child link="l{i + 1}"/><axis xyz="0 1 1"/></joint>'
        for i in range(39)
    )
    text = f'<robot name="r">{links}{joints}</robot>'
    whole = RobotModel(text)
    monkeypatch.setattr("borecheck.robots.pinocchio_model.MOST_AT_ONCE", 5)
    pieced = RobotModel(text)
    q = rng.uniform(-3.0, 3.0, 39)
    expected, placed = whole.placements(q), pieced.placements(q)
    assert set(placed) == set(expected) == set(whole.link_names)
    for link, T in expected.items():
        # sums of up to 40 m over a dozen joints
        np.testing.assert_allclose(placed[link], T, atol=1e-12, err_msg=link)


def test_a_chain_of_a_thousand_moving_joints_is_placed():
    count = 1000
    links = "".join(f'<link name="l{i}"/>' for i in range(count + 1))
    joints = "".join(
        f'<joint name="j{i}" type="continuous"><origin xyz="1 0 0"/>'
        f'<parent link="l{i}"/><child link="l{i + 1}"/></joint>'
        for i in range(count)
    )
    model = RobotModel(f'<robot name="snake">{links}{joints}</robot>')
    tip = model.placements(np.full(count, 0.1))[f"l{count}"]
    np.testing.assert_allclose(tip[:3, 3], [count, 0.0, 0.0], atol=1e-9)
    np.testing.assert_allclose(tip[1, 1], np.cos(0.1 * count), atol=1e-9)


@pytest.mark.parametrize("name", ["universe", "a\nb", "<&>", "world"])
def test_pinocchio_is_not_troubled_by_names_and_shapes(name, capfd):
    from xml.sax.saxutils import quoteattr

    shape = "<collision><geometry><capsule radius='1' length='1'/></geometry>"
    text = (
        f"<robot name='r'><link name={quoteattr(name)}>{shape}</collision></link>"
        f"<link name='tip'/><joint name={quoteattr(name)} type='fixed'>"
        f"<parent link={quoteattr(name)}/><child link='tip'/></joint></robot>"
    )
    assert set(RobotModel(text).placements([])) == {name, "tip"}
    assert capfd.readouterr().err == ""


def test_random_configurations_are_within_limits_and_seeded():
    model = model_of("mimic_chain")
    drawn = model.random_configurations(np.random.default_rng(3), 40)
    again = model.random_configurations(np.random.default_rng(3), 40)
    assert np.array_equal(drawn, again)
    assert np.ptp(drawn) > 0.5
    for q in drawn:
        model.check_limits(q)
