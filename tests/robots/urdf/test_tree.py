import re

import numpy as np
import pytest

from borecheck.core.se3 import transform
from borecheck.errors import UrdfError
from borecheck.robots.urdf.parse import parse
from borecheck.robots.urdf.tree import Box, Cylinder, Mesh

ARM = """<?xml version="1.0"?>
<robot name="arm">
  <material name="grey"><color rgba="1 1 1 1"/></material>
  <link name="base">
    <inertial>
      <origin xyz="0 0 0.1"/><mass value="2"/>
      <inertia ixx="1" ixy="0.1" ixz="0.2" iyy="2" iyz="0.3" izz="3"/>
    </inertial>
    <visual name="v"><geometry><cylinder radius="0.1" length="0.5"/></geometry></visual>
    <collision><origin xyz="1 2 3" rpy="0.1 0.2 0.3"/>
      <geometry><box size="1 2 3"/></geometry></collision>
  </link>
  <link name="tip">
    <collision><geometry><mesh filename="a.stl" scale="1 1 2"/></geometry></collision>
  </link>
  <joint name="j" type="revolute">
    <origin xyz="0 0 1" rpy="0 0.5 0"/>
    <parent link="base"/><child link="tip"/>
    <axis xyz="0 0 2"/>
    <limit lower="-1" upper="2" effort="3"/>
  </joint>
</robot>
"""


def test_records_hold_what_stands_in_the_file():
    tree = parse(ARM, "arm.urdf")
    base, tip = tree.links
    (joint,) = tree.joints
    assert (tree.name, tree.materials, tree.source) == ("arm", ("grey",), "arm.urdf")
    assert tree.root is base
    assert base.inertial is not None
    assert base.inertial.mass == 2.0
    assert np.array_equal(base.inertial.inertia, base.inertial.inertia.T)
    assert base.visuals[0].geometry == Cylinder(0.1, 0.5)
    assert base.collisions[0].geometry == Box((1.0, 2.0, 3.0))
    assert np.array_equal(
        base.collisions[0].origin, transform((1, 2, 3), (0.1, 0.2, 0.3))
    )
    assert tip.collisions[0].geometry == Mesh("a.stl", (1.0, 1.0, 2.0))
    assert np.array_equal(joint.origin, transform((0, 0, 1), (0, 0.5, 0)))
    assert joint.axis.tolist() == [0.0, 0.0, 1.0]
    assert joint.limits is not None
    assert (joint.limits.lower, joint.limits.upper) == (-1.0, 2.0)
    assert (joint.limits.effort, joint.limits.velocity) == (3.0, None)
    assert joint.place.line == 16


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ('name="arm"', "", "name is missing"),
        ('type="revolute"', 'type="hinge"', "'hinge' is not known"),
        ("<robot ", "<sdf ", "not well-formed"),
        ('xyz="0 0 1"', 'xyz="0 1"', "holds 2 numbers, not 3"),
        ('xyz="0 0 1"', 'xyz="0 0 a"', "not a number"),
        ('xyz="0 0 1"', 'xyz="0 0 nan"', "not finite"),
        ('<axis xyz="0 0 2"/>', '<axis xyz="0 0 0"/>', "axis is 0 0 0"),
        ('<limit lower="-1" upper="2" effort="3"/>', "", "has no <limit>"),
        ('lower="-1"', 'lower="3"', "above upper"),
        ('<child link="tip"/>', '<child link="tp"/>', "does not exist"),
        ('<child link="tip"/>', "", "has no child link"),
        ('<child link="tip"/>', '<child link="base"/>', "circle|no parent"),
        ('name="tip"', 'name="base"', "are called"),
        ("</robot>", '<link name="x"/></robot>', "'x' is not connected to 'base'"),
        ('<box size="1 2 3"/>', "", "holds no shape"),
        ('<box size="1 2 3"/>', '<box size="1 2 -3"/>', "not positive"),
        ('<box size="1 2 3"/>', "<bochs/>", "no shape"),
        ('scale="1 1 2"', 'scale="1 0 2"', "flat"),
        ("<axis", '<mimic joint="k"/><axis', "is no joint"),
        ("<axis", '<mimic joint="j"/><axis', "mimics itself"),
    ],
)
def test_what_no_robot_can_be_built_from_is_refused(old, new, words):
    assert old in ARM
    with pytest.raises(UrdfError, match=words) as error:
        parse(ARM.replace(old, new, 1), "arm.urdf")
    assert "\n" not in str(error.value)
    assert "arm.urdf" in str(error.value)


def test_the_place_of_a_refusal_is_named():
    with pytest.raises(UrdfError, match=r"arm\.urdf:19: robot/joint\[@name='j'\]/axis"):
        parse(ARM.replace("0 0 2", "0 0 0"), "arm.urdf")


def test_two_parents_are_refused():
    second = (
        '<joint name="k" type="fixed"><parent link="base"/><child link="tip"/></joint>'
    )
    with pytest.raises(UrdfError, match="already the child of joint 'j'"):
        parse(ARM.replace("</robot>", second + "</robot>"))


def test_a_circle_beside_the_tree_is_refused():
    links = '<link name="p"/><link name="q"/>'
    joints = "".join(
        f'<joint name="{a}{b}" type="fixed"><parent link="{a}"/><child link="{b}"/>'
        "</joint>"
        for a, b in (("p", "q"), ("q", "p"))
    )
    with pytest.raises(UrdfError, match="circle"):
        parse(ARM.replace("</robot>", f"{links}{joints}</robot>"))


def chain_of(count):
    links = "".join(f'<link name="l{i}"/>' for i in range(count))
    joints = "".join(
        f'<joint name="j{i}" type="fixed"><parent link="l{i}"/>'
        f'<child link="l{i + 1}"/></joint>'
        for i in range(count - 1)
    )
    return f'<robot name="r">{links}{joints}</robot>'


def test_a_chain_of_a_thousand_joints_is_read():
    assert len(parse(chain_of(1001)).joints) == 1000


@pytest.mark.parametrize("count", [1002, 5000])
def test_a_deeper_chain_is_refused_in_one_line(count):
    with pytest.raises(UrdfError, match="more than 1000 are refused") as error:
        parse(chain_of(count))
    assert "\n" not in str(error.value)


@pytest.mark.parametrize(
    "inside",
    [
        '<joint name="j" type="fixed"><parent link="a"/><child link="b"/>{}</joint>',
        "{}",
        '<group><link name="c">{}</link></group>',
        '<link name="c"><group>{}</group></link>'
        '<joint name="k" type="fixed"><parent link="a"/><child link="c"/></joint>',
    ],
)
@pytest.mark.parametrize("tag", ["collision", "Collision", "collison"])
def test_a_collision_outside_a_link_is_refused(inside, tag):
    lost = f'<{tag}><geometry><box size="1 1 1"/></geometry></{tag}>'
    links = "".join(
        f'<link name="{n}"><collision><geometry><box size="1 1 1"/></geometry>'
        "</collision></link>"
        for n in "ab"
    )
    joint = ""
    if 'name="j"' not in inside:
        joint = (
            '<joint name="j" type="fixed"><parent link="a"/><child link="b"/></joint>'
        )
    text = f'<robot name="r">{links}{joint}{inside}</robot>'
    parse(text.format(""))
    with pytest.raises(UrdfError, match=r"collision"):
        parse(text.format(lost))


def test_a_collision_in_a_visual_is_refused():
    lost = '<collision><geometry><box size="1 1 1"/></geometry></collision>'
    drawn = '<visual><geometry><box size="1 1 1"/></geometry>{}</visual>'
    text = f'<robot name="r"><link name="a">{drawn}</link></robot>'
    parse(text.format(""))
    with pytest.raises(UrdfError, match="belongs to no link"):
        parse(text.format(lost))


def test_a_collision_that_a_sensor_names_is_no_shape():
    sensor = "<gazebo><sensor><contact><collision>a_shape</collision></contact>"
    text = f'<robot name="r"><link name="a"/>{sensor}</sensor></gazebo></robot>'
    assert len(parse(text).links) == 1


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("<collision>", "<colision>", "collision"),
        ("<collision>", "<shell>", "<shell> is not known in <link>"),
        ('rpy="0 0 1"', 'ryp="0 0 1"', "'ryp' is not known in <origin>"),
        ('rpy="0 0 1"', 'quat_xyzw="0 0 0 1"', "is not read"),
        ("<origin", "<orign", "origin"),
        ('<axis xyz="0 0 1"/>', "<axis/>", "xyz"),
        ("<mimic ", "<mimik ", "mimic"),
        ('multiplier="2"', 'multiplyer="2"', "multiplier"),
        ('scale="2 2 2"', 'scael="2 2 2"', "scale"),
        ("upper=", "uper=", "upper"),
    ],
)
def test_what_parsers_would_skip_without_a_word_is_refused(old, new, said):
    text = """<robot name="r"><link name="a"/><link name="b"><collision>
      <origin xyz="0 0 0" rpy="0 0 1"/>
      <geometry><mesh filename="m.stl" scale="2 2 2"/></geometry></collision></link>
      <link name="c"/>
      <joint name="j" type="revolute"><parent link="a"/><child link="b"/>
      <axis xyz="0 0 1"/><limit lower="0" upper="1" effort="1" velocity="1"/></joint>
      <joint name="k" type="revolute"><parent link="b"/><child link="c"/>
      <axis xyz="0 0 1"/><limit lower="0" upper="2" effort="1" velocity="1"/>
      <mimic joint="j" multiplier="2"/></joint></robot>"""
    assert parse(text).joints[1].mimic is not None
    closing = new.replace("<", "</").strip()
    broken = text.replace(old, new)
    if old == "<collision>":
        broken = broken.replace("</collision>", closing)
    assert broken != text
    with pytest.raises(UrdfError, match=re.escape(said)):
        parse(broken)


def test_extensions_are_left_alone():
    text = """<robot name="r"><link name="a"><verbose value="1"/><collision>
      <geometry><box size="1 1 1"/></geometry></collision>
      <self_filter><geometry><box size="1 1 1"/></geometry></self_filter></link>
      <gazebo reference="a"/></robot>"""
    assert len(parse(text).links[0].collisions) == 1
