"""A defect of a stranger's description is one line: package, field, what is right."""

from dataclasses import replace
from importlib.metadata import EntryPoint
from pathlib import Path

import pytest

import borecheck as bc
from borecheck.errors import BorecheckError, UsageError
from borecheck.plugin import Argument, JointMap, RobotDescription, ScannerDescription
from borecheck.robots.description import hook, installed, plugin_hook, plugins
from borecheck.robots.from_description import build_installed, complete_arguments

URDF = """<robot name="arm" xmlns:xacro="http://www.ros.org/wiki/xacro">
<xacro:arg name="width" default="1"/><xacro:arg name="tray" default="no"/>
<link name="base"><collision><geometry><box size="$(arg width) 1 1"/></geometry>
</collision></link><link name="needle"/><link name="side"/>
<joint name="drive" type="prismatic"><parent link="base"/><child link="needle"/>
<axis xyz="0 0 1"/><limit lower="0" upper="1" effort="1" velocity="1"/></joint>
<joint name="turn" type="revolute"><parent link="needle"/><child link="side"/>
<origin rpy="0.00001 0 0"/><axis xyz="0 0 1"/>
<limit lower="0" upper="1" effort="1" velocity="1"/></joint>
<xacro:macro name="shelf" params="name"><link name="${name}_shelf"/>
<joint name="${name}_slide" type="prismatic"><parent link="base"/>
<child link="${name}_shelf"/><axis xyz="1 0 0"/>
<limit lower="0" upper="1" effort="1" velocity="1"/></joint></xacro:macro>
<xacro:property name="tray" value="$(arg tray)"/>
<xacro:if value="${tray == 'yes'}"><xacro:shelf name="tray"/></xacro:if>
<xacro:if value="${$(arg width) > 2}"><link name="beam"/>
<joint name="beam_fixed" type="fixed"><parent link="base"/><child link="beam"/></joint>
</xacro:if></robot>"""
COMMON = {"name": "arm", "title": "t", "not_modelled": ("cables",), "source": "s"}
WIDTH = {"width": Argument("1", "m", quantity="length")}
TRAY = {"tray": Argument("no", "whether it is there", choices=("no", "yes"))}


@pytest.fixture
def make(tmp_path, monkeypatch):
    """Builds a description with changed fields as if its package were installed."""
    file = tmp_path / "arm.urdf.xacro"
    file.write_text(URDF)
    monkeypatch.setenv("BORECHECK_CACHE", str(tmp_path / "cache"))

    def load(kind, entry="arm", given=None, **fields):
        group = "robots" if kind is RobotDescription else "scanners"
        description = kind(**{**COMMON, "xacro": file, **fields})
        point = EntryPoint(entry, "arm:THING", f"borecheck.{group}")
        monkeypatch.setattr(EntryPoint, "load", lambda _: description)
        monkeypatch.setattr(plugins, "_entries", lambda _: [point])
        found = installed(group, "thing", entry)
        arguments = complete_arguments(found, given or {})
        return found, build_installed(found, "coarse", arguments)

    return load


def test_sound_descriptions_load(make):
    robot, _ = make(
        RobotDescription,
        arguments=WIDTH,
        home={"drive": 0},
        needle_link="needle",
        tool_frame="needle",
        frames={"tip": "needle"},
        insertion_joint="drive",
        joints=(JointMap("drive"),),
        inverse="math:sin",
        closed_form_arguments=("width",),
    )
    assert robot.home == {"drive": 0}
    make(ScannerDescription, roles={"base": "couch"}, points={"side": "a point"})


@pytest.mark.parametrize("tray", ["no", "yes"])
def test_what_is_there_with_another_choice_may_be_named(make, tray):
    roles = {"base": "scanner", "tray_shelf": "couch"}
    more = {"points": {"tray_shelf": "p"}, "joints": {"tray_slide": 0.1}}
    given = {"tray": tray}
    _, (_, _, warnings) = make(
        ScannerDescription, arguments=TRAY, given=given, roles=roles, **more
    )
    assert warnings == ()
    wrong = {"tray_shelv": "couch"}
    with pytest.raises(UsageError, match="roles 'tray_shelv' is no link"):
        make(ScannerDescription, arguments=TRAY, given=given, roles=wrong)


def test_what_is_there_with_another_length_may_be_named(make):
    make(ScannerDescription, arguments=WIDTH, roles={"beam": "couch"})
    with pytest.raises(UsageError, match="'beem' is no link"):
        make(ScannerDescription, arguments=WIDTH, roles={"beem": "couch"})


def test_where_a_text_may_be_part_of_a_name_a_warning_tells(make):
    """Nobody can list the texts of an argument without choices."""
    text = {"tray": Argument("no", "a free text")}
    _, (_, _, warnings) = make(
        ScannerDescription, arguments=text, roles={"no_shelf": "couch"}
    )
    (warning,) = warnings
    assert "roles 'no_shelf' is no link" in warning


@pytest.mark.parametrize("zones", ["no", "yes"])
@pytest.mark.parametrize("phantom", ["head", "melon", "none"])
def test_our_own_scanners_load_with_every_choice(zones, phantom):
    scene = bc.load_scene("mri_open_magnet", zones=zones, phantom=phantom)
    assert scene.warnings == ()


def test_what_is_not_there_has_no_position(make):
    fields = {"arguments": TRAY, "joints": {"tray_slide": 0.1}}
    make(ScannerDescription, **fields, points={"tray_shelf": "p", "side": "q"})
    scene = bc.load_scene("arm")
    assert set(scene.points) == {"side"}
    assert set(scene.arguments) == {"tray"}
    with pytest.raises(BorecheckError, match="unknown joint 'tray_slide'"):
        bc.load_scene("arm", tray_slide="0.2m")
    moved = bc.load_scene("arm", tray="yes", tray_slide="0.2m")
    assert moved.points["tray_shelf"][0, 3] == 0.2
    make(RobotDescription, arguments=TRAY, home={"drive": 0.3, "tray_slide": 0.1})
    assert bc.load_robot("arm").home.tolist() == [0.3, 0.0]
    assert bc.load_robot("arm", tray="yes").home.tolist() == [0.3, 0.0, 0.1]


def test_a_home_that_leaves_joints_out_is_told(make):
    _, (_, _, warnings) = make(RobotDescription, home={"drive": 0.3})
    assert warnings == ("robot arm: home does not name turn: taken as 0",)
    _, (_, _, warnings) = make(RobotDescription, home={"drive": 0.3, "turn": 0})
    assert warnings == ()


def test_a_home_beyond_limits_is_told_with_the_usual_arguments(make):
    home = {"drive": 1.5, "turn": 0.0}
    with pytest.raises(UsageError, match="home is beyond limits: drive = "):
        make(RobotDescription, arguments=WIDTH, home=home)
    # other arguments may have other limits
    make(RobotDescription, arguments=WIDTH, home=home, given={"width": "2"})


@pytest.mark.parametrize(
    ("height", "said"),
    [
        (0.0, None),
        (0.0009, None),
        (0.012, "12.0 mm behind the end of needle_link 'needle'"),
        (-0.02, "20.0 mm beyond the end of needle_link 'needle'"),
    ],
)
def test_a_tool_frame_away_from_the_needles_end_is_told(tmp_path, make, height, said):
    shape = (
        f'<link name="needle"><collision><origin xyz="0 0 {height - 0.05}"/><geometry>'
        '<cylinder radius="0.001" length="0.1"/></geometry></collision></link>'
    )
    needle = {"needle_link": "needle", "tool_frame": "needle"}
    make(RobotDescription, **needle)
    file = tmp_path / "arm.urdf.xacro"
    file.write_text(URDF.replace('<link name="needle"/>', shape))
    warnings = bc.load_robot("arm").warnings
    assert len(warnings) == (said is not None)
    if said:
        assert warnings[0].startswith(f"robot arm: tool_frame 'needle' is {said}")


ROBOT_DEFECTS = [
    ({"arguments": {"width": Argument(0.9, "")}}, "0.9 is not a text; write '0.9'"),
    ({"arguments": {"width": Argument(None, "")}}, "default None is not a text"),
    ({"arguments": {"width": Argument("3", "", ("1",))}}, "default '3' is none of"),
    ({"arguments": {"width": Argument("a", "", "ab")}}, "choices is the bare text"),
    ({"arguments": {"width": Argument("1", "", quantity="mm")}}, "quantity 'mm'"),
    ({"arguments": {"width": Argument("1mm", "", quantity="length")}}, "no number"),
    ({"arguments": {"widht": Argument("1", "")}}, "argument widht: no <xacro:arg"),
    ({"arguments": {"width": "1"}}, "'1', not an Argument"),
    ({"needle_link": "nedle"}, "needle_link 'nedle' .*did you mean 'needle'"),
    ({"needle_link": "drive"}, "needle_link 'drive' is no link"),
    ({"tool_frame": "tip", "arguments": WIDTH}, "tool_frame 'tip' is no link"),
    ({"base_frame": "bas"}, "base_frame 'bas' .*did you mean 'base'"),
    ({"frames": {"F": "nedle"}}, r"frames\['F'\] 'nedle' .*did you mean 'needle'"),
    ({"allowed_contacts": (("base", "nedle", "r"),)}, "allowed_contacts 'nedle'"),
    ({"allowed_contacts": ("base",)}, "'base' is not .link, link, reason."),
    ({"home": {"drvie": 0.0}}, "home 'drvie' .*did you mean 'drive'"),
    ({"home": {"drive": "0mm"}}, "home.'drive'. is '0mm'"),
    ({"joints": (JointMap("x"),)}, "joints 'x' is no free joint"),
    ({"joints": (JointMap("drive", sign=0.0),)}, "sign is 1 or -1"),
    ({"joints": ("drive",)}, "'drive' is not a JointMap"),
    ({"insertion_joint": "drvie"}, "insertion_joint 'drvie' .*did you mean 'drive'"),
    ({"insertion_joint": "turn", "tool_frame": "side"}, "'turn' turns; it must be"),
    ({"insertion_joint": "drive", "tool_frame": "side"}, "not along the needle"),
    ({"insertion_joint": "drive", "tool_frame": "base"}, r"tip along \[0.0, 0.0, 0.0"),
    ({"inverse": "math:sin"}, "inverse needs joints"),
    ({"forward": "m.f"}, "forward 'm.f' is not of the form"),
    ({"forward": "no_such:f"}, "forward 'no_such:f' cannot .*No module named"),
    ({"forward": "colorsys:sinus"}, "forward 'colorsys:sinus' cannot .*'sinus'"),
    ({"dimensions": "math:sinus"}, "dimensions 'math:sinus' cannot be loaded"),
    ({"closed_form_arguments": ("w",)}, "closed_form_arguments 'w' is no argument"),
    ({"not_modelled": "cables"}, r"not a tuple: \('cables',\)"),
    ({"needle_radius": -1.0}, "needle_radius is -1.0"),
    ({"xacro": "arm.xacro"}, "xacro is 'arm.xacro', not a pathlib.Path"),
    ({"xacro": Path("gone.xacro")}, "is no file: does the package ship it"),
    ({"shipped": Path("gone")}, "shipped gone is no folder"),
    ({"entry": "leg"}, "name 'arm' must be the entry point's, 'leg'"),
]
SCANNER_DEFECTS = [
    ({"roles": {"base": "bed"}}, r"roles\['base'\] 'bed' is no role"),
    ({"roles": {"bas": "couch"}}, "roles 'bas' is no link.*did you mean 'base'"),
    ({"roles": {"base": "couch"}, "points": {"p": ""}}, "points 'p' is no link"),
    ({"roles": {"base": "couch"}, "joints": {"j": 0.0}}, "joints 'j' is no free"),
    ({"arguments": WIDTH, "joints": {"beam_fixed": 0.0}, "given": {"width": "3m"}},
     "joints 'beam_fixed' is fixed, not free"),
]  # fmt: skip


@pytest.mark.parametrize(
    ("kind", "fields", "line"),
    [(RobotDescription, *case) for case in ROBOT_DEFECTS]
    + [(ScannerDescription, *case) for case in SCANNER_DEFECTS],
)
def test_a_defect_is_one_line(make, kind, fields, line):
    with pytest.raises(BorecheckError, match=line) as told:
        make(kind, **fields)
    assert "\n" not in str(told.value)
    assert "arm" in str(told.value)  # the package, or its file


@pytest.mark.parametrize(
    ("reference", "line"),
    [
        ("no_such_module:f", "cannot be loaded: ModuleNotFoundError"),
        ("math:sinus", "cannot be loaded: AttributeError"),
        ("math:pi", "is 3.14.*not a function"),
        ("math:log", "failed: ValueError"),
        ("math:cos", "returned float: wrong"),
    ],
)
def test_a_hook_that_fails_is_the_packages(make, reference, line):
    robot, _ = make(RobotDescription)
    robot = replace(robot, forward=reference)
    with pytest.raises(UsageError, match=f"robot arm: forward .*{line}"):
        plugin_hook(robot, "forward", hook, lambda _: "wrong")(0.0)
