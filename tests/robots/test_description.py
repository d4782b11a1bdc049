"""Everything that is installed: it loads with every argument, and starts out clear."""

from importlib import import_module

import pytest

import borecheck as bc
from borecheck.errors import UnknownNameError, UsageError
from borecheck.robots.description import (
    ROLES,
    Argument,
    hook,
    installed,
    installed_names,
)

KINDS = {"robots": "robot", "scanners": "scanner"}
ALL = [(group, name) for group in KINDS for name in installed_names(group)]
ROBOTS = installed_names("robots")
CHOICES = [
    (group, name, argument, choice)
    for group, name in ALL
    for argument, a in installed(group, KINDS[group], name).arguments.items()
    for choice in a.choices
]


def load(group, name, **arguments):
    loader = bc.load_robot if group == "robots" else bc.load_scene
    return loader(name, **arguments)


def test_premise_what_the_papers_need_is_installed():
    assert "zerobot" in ROBOTS
    assert "ct_gantry" in installed_names("scanners")
    assert len(CHOICES) > 10


@pytest.mark.parametrize(("group", "name"), ALL)
def test_a_description_names_what_is_there(group, name):
    description = installed(group, KINDS[group], name)
    assert description.name == name
    assert description.xacro.is_file()
    assert any(description.shipped.glob("*.stl"))
    assert description.source
    assert description.not_modelled
    for argument in description.arguments.values():
        assert argument.meaning
        assert not argument.choices or argument.default in argument.choices
    module, _, function = description.meshes.partition(":")
    assert callable(getattr(import_module(module), function))


@pytest.mark.parametrize("name", ROBOTS)
def test_a_robots_names_exist_in_its_urdf(name):
    robot = bc.load_robot(name)
    description = robot.description
    links, joints = set(robot.model.link_names), set(robot.model.joint_names)
    for frame in (
        description.needle_link,
        description.tool_frame,
        description.base_frame,
        *description.frames.values(),
    ):
        assert frame is None or frame in links
    assert set(description.home) <= joints
    assert {joint.name for joint in description.joints} == joints
    assert description.insertion_joint is None or description.insertion_joint in joints
    assert set(description.closed_form_arguments) <= set(description.arguments)
    for reference in (description.forward, description.inverse, description.dimensions):
        assert reference is None or callable(hook(reference))


@pytest.mark.parametrize("name", ROBOTS)
def test_home_is_within_limits_and_clear_of_its_own_scanner(name):
    robot = bc.load_robot(name)
    assert robot.description.scanner in installed_names("scanners")
    robot.model.check_limits(robot.home)
    verdict = bc.check(robot, bc.load_scene(robot.description.scanner), robot.home)
    assert verdict.verdict == "clear", verdict.reason
    assert verdict.clearance_m > 1e-3


@pytest.mark.parametrize("name", installed_names("scanners"))
def test_every_link_of_a_scanner_with_a_shape_has_a_role(name):
    scene = bc.load_scene(name)
    description = scene.description
    assert {o.name.partition("[")[0] for o in scene.obstacles} <= set(description.roles)
    assert set(description.roles.values()) <= set(ROLES)
    assert set(description.points) == set(scene.points)
    assert all(o.mesh.is_closed for o in scene.obstacles)


@pytest.mark.parametrize(("group", "name", "argument", "choice"), CHOICES)
def test_every_choice_loads(group, name, argument, choice):
    loaded = load(group, name, **{argument: choice})
    assert loaded.arguments[argument] == choice
    if group == "robots":
        loaded.model.check_limits(loaded.home)
        assert all(part.mesh.is_closed for part in loaded.parts)
    else:
        assert loaded.obstacles


@pytest.mark.parametrize(("group", "name"), ALL)
def test_every_other_argument_takes_a_quantity(group, name):
    description = installed(group, KINDS[group], name)
    for argument, a in description.arguments.items():
        if a.quantity is None:
            continue
        given = a.default + ("m" if a.quantity == "length" else "rad")
        loaded = load(group, name, **{argument: given})
        assert float(loaded.arguments[argument]) == pytest.approx(float(a.default))
        with pytest.raises(UsageError):
            load(group, name, **{argument: "wide"})


def test_a_choice_is_found_by_its_number():
    argument = Argument("+90", "a side", choices=("+90", "-90"))
    assert argument.value("mount", "90") == "+90"
    assert argument.value("mount", "-90.0") == "-90"
    for wrong in ("45", "", "nan", "left"):
        with pytest.raises(UsageError):
            argument.value("mount", wrong)


def test_a_quantity_reaches_xacro_in_metres():
    argument = Argument("0.12", "a length", quantity="length")
    assert argument.value("l", "150mm") == "0.15"
    with pytest.raises(UsageError):
        argument.value("l", "3deg")


def test_unknown_names_list_the_known_ones():
    with pytest.raises(UnknownNameError, match="ct_gantry"):
        installed("scanners", "scanner", "ct")
