"""A defect of a stranger's description is one line: package, field, value, allowed."""

from dataclasses import replace
from importlib.metadata import EntryPoint
from pathlib import Path

import pytest

from borecheck.errors import BorecheckError, UsageError
from borecheck.plugin import Argument, JointMap, RobotDescription, ScannerDescription
from borecheck.robots import installed as installed_module
from borecheck.robots.from_description import build_installed, complete_arguments
from borecheck.robots.installed import installed, plugin_hook

URDF = """<robot name="arm" xmlns:xacro="http://www.ros.org/wiki/xacro">
<xacro:arg name="width" default="1"/>
<link name="base"><collision><geometry><box size="$(arg width) 1 1"/></geometry>
</collision></link><link name="needle"/><link name="side"/>
<joint name="drive" type="prismatic"><parent link="base"/><child link="needle"/>
<axis xyz="0 0 1"/><limit lower="0" upper="1" effort="1" velocity="1"/></joint>
<joint name="turn" type="revolute"><parent link="needle"/><child link="side"/>
<origin rpy="0.00001 0 0"/><axis xyz="0 0 1"/>
<limit lower="0" upper="1" effort="1" velocity="1"/></joint></robot>"""
COMMON = {"name": "arm", "title": "t", "not_modelled": ("cables",), "source": "s"}


@pytest.fixture
def make(tmp_path, monkeypatch):
    """Builds a description with changed fields as if its package were installed."""
    file = tmp_path / "arm.urdf.xacro"
    file.write_text(URDF)
    monkeypatch.setenv("BORECHECK_CACHE", str(tmp_path / "cache"))

    def load(kind, entry="arm", **fields):
        group = "robots" if kind is RobotDescription else "scanners"
        description = kind(**{**COMMON, "xacro": file, **fields})
        point = EntryPoint(entry, "arm:THING", f"borecheck.{group}")
        monkeypatch.setattr(EntryPoint, "load", lambda _: description)
        monkeypatch.setattr(installed_module, "_entries", lambda _: {entry: point})
        found = installed(group, "thing", entry)
        build_installed(found, "coarse", complete_arguments(found, {}))
        return found

    return load


def test_sound_descriptions_load_and_numbers_become_text(make):
    width = Argument(2, "width", choices=(1, 2, 0.5))
    robot = make(
        RobotDescription,
        arguments={"width": width},
        home={"drive": 0},
        needle_link="needle",
        tool_frame="needle",
        frames={"tip": "needle"},
        insertion_joint="drive",
        joints=(JointMap("drive"),),
        inverse="m:f",
        closed_form_arguments=("width",),
    )
    assert robot.arguments["width"].default == "2"
    assert robot.arguments["width"].choices == ("1", "2", "0.5")
    make(ScannerDescription, roles={"base": "couch"}, points={"side": "a point"})


ROBOT_DEFECTS = [
    ({"arguments": {"width": Argument(None, "")}}, "'width'] default None"),
    ({"arguments": {"width": Argument(True, "")}}, "'width'] default True"),
    (
        {"arguments": {"width": Argument("3", "", ("1",))}},
        "default '3' is none of",
    ),
    (
        {"arguments": {"width": Argument("a", "", "ab")}},
        "choices is the bare text",
    ),
    ({"arguments": {"width": Argument("1", "", quantity="mm")}}, "quantity 'mm'"),
    ({"arguments": {"widht": Argument("1", "")}}, "argument widht: no <xacro:arg"),
    ({"arguments": {"width": "1"}}, "'1', not an Argument"),
    ({"needle_link": "nedle"}, "needle_link 'nedle' .*did you mean 'needle'"),
    ({"tool_frame": "tip"}, "tool_frame 'tip' is no link"),
    ({"base_frame": "bas"}, "base_frame 'bas' .*did you mean 'base'"),
    ({"frames": {"F": "nedle"}}, r"frames\['F'\] 'nedle' .*did you mean 'needle'"),
    ({"allowed_contacts": (("base", "nedle", "r"),)}, "allowed_contacts 'nedle'"),
    ({"home": {"drvie": 0.0}}, "home 'drvie' .*did you mean 'drive'"),
    ({"home": {"drive": "0mm"}}, "home.'drive'. is '0mm'"),
    ({"joints": (JointMap("x"),)}, "joints 'x' is no free joint"),
    ({"joints": (JointMap("drive", sign=2.0),)}, "sign is 1 or -1"),
    ({"insertion_joint": "drvie"}, "insertion_joint 'drvie' .*did you mean 'drive'"),
    ({"insertion_joint": "turn"}, "insertion_joint 'turn' is revolute, not prismatic"),
    ({"insertion_joint": "drive", "tool_frame": "side"}, "not along the needle"),
    ({"inverse": "m:f"}, "inverse needs joints"),
    ({"forward": "m.f"}, "forward 'm.f' is not of the form"),
    ({"closed_form_arguments": ("w",)}, "closed_form_arguments 'w' is no argument"),
    ({"not_modelled": "cables"}, r"not a tuple: \('cables',\)"),
    ({"needle_radius": -1.0}, "needle_radius is -1.0"),
    ({"xacro": "arm.xacro"}, "xacro is 'arm.xacro', not a pathlib.Path"),
    ({"xacro": Path("gone.xacro")}, "is no file"),
    ({"entry": "leg"}, "name 'arm' is not the entry point's name, 'leg'"),
]
SCANNER_DEFECTS = [
    ({"roles": {}}, "roles has no 'base', a link with geometry: scanner, couch"),
    ({"roles": {"base": "bed"}}, r"roles\['base'\] 'bed' is no role"),
    ({"roles": {"base": "couch", "bas": "couch"}}, "roles 'bas' is no link"),
    ({"roles": {"base": "couch"}, "points": {"p": ""}}, "points 'p' is no link"),
    ({"roles": {"base": "couch"}, "joints": {"j": 0.0}}, "joints 'j' is no free"),
]


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
        ("math:pi", "is no function"),
        ("math:log", "failed, which is the plug-in's: ValueError"),
        ("math:cos", "returned float: wrong"),
    ],
)
def test_a_hook_that_fails_is_the_plug_ins(make, reference, line):
    robot = replace(make(RobotDescription), forward=reference)
    with pytest.raises(UsageError, match=f"package of arm: forward .*{line}"):
        plugin_hook(robot, "forward", lambda _: "wrong")(0.0)
