"""What people type by mistake: one line that says what, where and how to mend.

A table for the command line and one for Python. None ends in a traceback, and none is
silent: every row names words that the line must hold.
"""

import re
from types import SimpleNamespace

import numpy as np
import pytest

import borecheck as bc
from borecheck.cli import main
from borecheck.errors import BorecheckError
from borecheck.geometry.mesh.primitives import box
from borecheck.geometry.mesh_files.reading import write_stl
from tests.places import ROBOTS

ARM = str(ROBOTS / "two_link.urdf")
PLAN = "name,entry_x,entry_y,entry_z,target_x,target_y,target_z\n"
FILES = {
    "bare.csv": "0\n0.5\n",
    "plans.csv": PLAN + "a,0,0,0.1,0,0,0.05\n",
    "mm_plans.csv": PLAN + "a,0,0,100,0,0,50\n",
    "same.csv": PLAN + "a,0,0,0.1,0,0,0.1\n",
    "one.csv": "j\n0\n",
    "semicolon.csv": "j;k\n0;1\n",
    "other.csv": "elbow\n0\n1\n",
    "words.csv": "j\nzero\n1\n",
    "ragged.csv": "j\n0,1\n1\n",
    "degrees.csv": "j\n0\n90\n",
    "path.csv": "j\n0\n0.5\n",
    "header.csv": "j\n",
    "empty.csv": "",
    "arm.srdf": '<robot name="two_link"/>\n',
    "notes.txt": "hello\n",
    "broken.urdf": '<robot name="x"><link name="a">\n',
    "result.json": "{}\n",
}
GIVEN = ("check", ARM, "wall.stl:m")

# What a fresh installation says meanwhile.
COMPILING = re.compile(r"compiling|\d kernels")

CLI = [
    (("chekc", ARM), "unknown command 'chekc'; did you mean 'check'?"),
    (("verfy", "a.json"), "did you mean 'verify'?"),
    (("help",), "unknown command 'help'"),
    ((ARM, "wall.stl"), "is a file, not a command: write for example"),
    (("wall.stl",), "'wall.stl' is a file, not a command"),
    (("--q", "home"), "--help"),
    (("check",), "required: robot, scene"),
    (("check", ARM), "required: scene"),
    (GIVEN, "--q --path --plan is required"),
    ((*GIVEN, "--q", "0", "--marginn", "2mm"), "did you mean '--margin'?"),
    ((*GIVEN, "--qq", "0"), "unknown option '--qq'; did you mean '--q'?"),
    ((*GIVEN, "-q", "0"), "unknown option '-q'; did you mean '--q'?"),
    ((*GIVEN, "--plans", "plans.csv"), "did you mean '--plan'?"),
    ((*GIVEN, "--q", "0", "--path", "path.csv"), "not allowed with argument --q"),
    ((*GIVEN, "--q"), "argument --q: expected one argument"),
    ((*GIVEN, "--q", "0", "--samples", "many"), "--samples: invalid int value"),
    ((*GIVEN, "--q", "0", "--format", "yaml"), "invalid choice: 'yaml'"),
    (("check", "wall.stl", ARM, "--q", "0"), "the robot comes first"),
    (("check", "ct_gantry", "zerobot", "--q", "0"), "the robot comes first"),
    (("check", ARM, "zerobot", "--q", "0"), "is a robot, not a scene"),
    (("check", "zerobott", "ct_gantry", "--q", "0"), "did you mean 'zerobot'?"),
    (("check", ARM, "ct_gantri", "--q", "0"), "did you mean 'ct_gantry'?"),
    (("check", ARM + "x", "wall.stl:m", "--q", "0"), "did you mean"),
    (("check", "arm.srdf", "wall.stl:m", "--q", "0"), "as --srdf arm.srdf"),
    (("check", "notes.txt", "wall.stl:m", "--q", "0"), "notes.txt"),
    (("check", "broken.urdf", "wall.stl:m", "--q", "0"), "broken.urdf"),
    (("check", ARM, "walls.stl:m", "--q", "0"), "walls.stl: there is no such file"),
    (("check", ARM, "wall.stl:feet", "--q", "0"), "feet"),
    (("check", ARM, "wall.stl:m@1,2", "--q", "0"), "not 3 or 6"),
    ((*GIVEN, "--q", "90"), "are these degrees?"),
    ((*GIVEN, "--q", "0,0"), "1 values in the order j"),
    ((*GIVEN, "--q", "hom"), "did you mean 'home'?"),
    ((*GIVEN, "--q", "j=20mm"), "joint j turns"),
    ((*GIVEN, "--q", "i=1"), "unknown joint 'i'"),
    ((*GIVEN, "--q", "j=1,j=2"), "j is given twice"),
    ((*GIVEN, "--q", "0", "--margin", "20"), "are these millimetres?"),
    ((*GIVEN, "--q", "0", "--margin", "5"), "for millimetres write 5mm"),
    ((*GIVEN, "--path", "degrees.csv", "--margin", "0.6"), "write 0.6mm"),
    ((*GIVEN, "--q", "0", "--margin", "20mn"), "unit 'mn' is none of"),
    ((*GIVEN, "--q", "0", "--margin", "-1mm"), "margin"),
    ((*GIVEN, "--q", "0", "--base", "800,0,0"), "are these millimetres?"),
    ((*GIVEN, "--q", "0", "--base", "0,0,0,0,0,90"), "are these degrees?"),
    ((*GIVEN, "--q", "0", "--checker", "exakt"), "did you mean 'exact'?"),
    ((*GIVEN, "--q", "0", "--allow", "base"), "base"),
    ((*GIVEN, "--q", "0", "--srdf", ARM), "this is a URDF, not an SRDF"),
    ((*GIVEN, "--q", "0", "--scene-arg", "bore"), "is not NAME=VALUE"),
    ((*GIVEN, "--q", "0", "--out", "none/a.json"), "no folder"),
    ((*GIVEN, "--q", "0", "--out", "wall.stl"), "wall.stl"),
    ((*GIVEN, "--path", "bare.csv"), "has no header; expected a header with"),
    ((*GIVEN, "--path", "plans.csv"), "give it as --plan"),
    ((*GIVEN, "--path", "one.csv"), "one waypoint"),
    ((*GIVEN, "--path", "semicolon.csv"), "separated by commas"),
    ((*GIVEN, "--path", "other.csv"), "unknown joint 'elbow'"),
    ((*GIVEN, "--path", "words.csv"), "line 2, j: 'zero' is no finite number"),
    ((*GIVEN, "--path", "ragged.csv"), "line 2: has 2 cells"),
    ((*GIVEN, "--path", "degrees.csv"), "waypoint 2"),
    ((*GIVEN, "--path", "header.csv"), "no waypoint"),
    ((*GIVEN, "--path", "empty.csv"), "is empty"),
    ((*GIVEN, "--path", "gone.csv"), "there is no such file"),
    ((*GIVEN, "--plan", "path.csv"), "path.csv"),
    ((*GIVEN, "--plan", "mm_plans.csv"), "mm_plans.csv"),
    ((*GIVEN, "--plan", "same.csv"), "same.csv"),
    (("compare", ARM, "wall.stl:m", "--random", "0"), "--random 0 is not from 1"),
    (("fk", "ct_gantry", "--random", "3"), "is a scanner, not a robot"),
    (("verify", "gone.json"), "REJECTED gone.json: cannot be read: No such file"),
    (("report", "result.json", "page.html"), "result.json"),
    (("explain", "J999"), "J999"),
    (("validate",), "no file given"),
    (("validate", "empty"), "holds no file that ends in"),
]


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    made = tmp_path_factory.mktemp("mistakes")
    (made / "empty").mkdir()
    write_stl(made / "wall.stl", box("wall", (0.2, 0.2, 0.2)))
    for name, text in FILES.items():
        (made / name).write_text(text)
    return made


@pytest.mark.parametrize(("words", "saying"), CLI, ids=lambda value: str(value)[:50])
def test_a_mistyped_command_is_one_line(capsys, monkeypatch, folder, words, saying):
    monkeypatch.chdir(folder)
    before = set(folder.iterdir())
    status = main(list(words))
    out, err = capsys.readouterr()
    lines = [line for line in (out + err).splitlines() if not COMPILING.search(line)]
    assert status == 2
    assert len(lines) == 1, lines
    assert saying in lines[0]
    assert set(folder.iterdir()) == before


@pytest.mark.parametrize(
    ("file", "saying"),
    [
        ("wall.stl", "is a mesh, not a URDF file: name the URDF"),
        ("arm.srdf", "is an SRDF, not a URDF file: name the URDF"),
        ("gone.urdf", "no such file"),
    ],
)
def test_what_validate_cannot_read_is_one_finding(
    capsys, monkeypatch, folder, file, saying
):
    monkeypatch.chdir(folder)
    status = main(["validate", file, "--brief"])
    first, *rest = capsys.readouterr().out.splitlines()
    assert status == 2
    assert saying in first
    assert len(rest) == 1  # how many there are
    main(["validate", file])
    assert capsys.readouterr().out.isascii()  # nothing of a binary file


def test_no_word_at_all_prints_the_help(capsys):
    assert main([]) == 0
    assert "check" in capsys.readouterr().out


@pytest.fixture(scope="module")
def door(folder):
    """What the Python table speaks of."""
    robot = bc.load_robot(ARM)
    scene = bc.load_scene(f"{folder / 'wall.stl'}:m@5,0,0")
    return SimpleNamespace(
        robot=robot,
        scene=scene,
        wall=str(folder / "wall.stl"),
        asked=bc.queries(robot, scene),
        mesh=robot.parts[0].mesh,
        srdf=str(folder / "arm.srdf"),
    )


PYTHON = [
    (lambda d: bc.check(d.scene, d.robot, [0]), "robot and scene are swapped"),
    (lambda d: bc.check("zerobot", d.scene, [0]), "load_robot('zerobot') returns"),
    (lambda d: bc.check(d.robot, "ct_gantry", [0]), "load_scene('ct_gantry') returns"),
    (lambda d: bc.check(d.robot, d.scene, [0, 0]), "has 1 joints: j"),
    (lambda d: bc.check(d.robot, d.scene, [[0]]), "has 1 joints: j"),
    (lambda d: bc.check(d.robot, d.scene, None), "q"),
    (lambda d: bc.check(d.robot, d.scene, "hom"), "did you mean 'home'?"),
    (lambda d: bc.check(d.robot, d.scene, {"i": 0}), "unknown joint 'i'"),
    (lambda d: bc.check(d.robot, d.scene, ["a"]), "q is no list of numbers"),
    (lambda d: bc.check(d.robot, d.scene, [np.nan]), "not finite"),
    (lambda d: bc.check(d.robot, d.scene, [45]), "are these degrees?"),
    (lambda d: bc.check(d.robot, d.scene, {"j": "zero"}), "'zero'"),
    (lambda d: bc.check(d.robot, d.scene, [0], margin="20mn"), "unit 'mn'"),
    (lambda d: bc.check(d.robot, d.scene, [0], margin=None), "text such as '20mm'"),
    (lambda d: bc.check(d.robot, d.scene, [0], margin=-1), "margin"),
    (lambda d: bc.check(d.robot, d.scene, [0], margin=20), "are these millimetres?"),
    (lambda d: bc.check(d.robot, d.scene, [0], checker="coall"), "did you mean 'coal'"),
    (lambda d: bc.check_path(d.scene, d.robot, [[0], [1]]), "swapped"),
    (lambda d: bc.check_path(d.robot, d.scene, [0, 1]), "shape (2,)"),
    (lambda d: bc.check_path(d.robot, d.scene, "path.csv"), "a list of them"),
    (lambda d: bc.check_path(d.robot, d.scene, []), "shape (0,)"),
    (lambda d: bc.check_path(d.robot, d.scene, [[0], [1, 2]]), "rows of one length"),
    (lambda d: bc.check_path(d.robot, d.scene, None), "NoneType"),
    (lambda d: bc.first_contacts(d.scene, d.robot, [[0]]), "swapped"),
    (lambda d: bc.first_contacts(d.robot, d.scene, [0]), "shape (1,)"),
    (lambda d: bc.compare(d.robot, d.scene, [[0]], checkers="coal"), "['coal']"),
    (lambda d: bc.compare(d.scene, d.robot, [[0]]), "swapped"),
    (lambda d: bc.queries(d.scene, d.robot), "swapped"),
    (lambda d: d.asked.clearance([[0]], within=-1), "within is -1"),
    (lambda d: d.asked.touches([0]), "shape (1,)"),
    (lambda d: bc.load_robot(3), "give an installed name, or a file"),
    (lambda d: bc.load_robot("zerobott"), "did you mean 'zerobot'?"),
    (lambda d: bc.load_robot(ARM, base=[0.8, 0, 0]), "800mm,0,0"),
    (lambda d: bc.load_robot(ARM, base=np.eye(3)), "shape (3, 3)"),
    (lambda d: bc.load_robot(ARM, base="800,0,0"), "are these millimetres?"),
    (lambda d: bc.load_robot(ARM, allow="base:arm"), "['base:arm']"),
    (lambda d: bc.load_robot(ARM, package_paths="."), "['.']"),
    (lambda d: bc.load_robot(d.srdf), "is an SRDF, not a robot"),
    (lambda d: bc.load_scene(None), "give a scanner's name"),
    (lambda d: bc.load_scene("ct_gantry", obstacles="a.stl"), "['a.stl']"),
    (lambda d: bc.load_scene("ct_gantry", patients="a.stl"), "['a.stl']"),
    (lambda d: bc.load_scene(d.wall, patient="a.stl"), "did you mean 'patients'?"),
    (lambda d: bc.load_scene("ct_gantry", patient="a.stl"), "mean 'patients'?"),
    (lambda d: bc.load_robot(ARM, neddle="needle"), "did you mean 'needle'?"),
    (lambda d: bc.check_path(d.robot, d.scene, [[0], [1]], margin=5), "write 5mm"),
    (lambda d: bc.load_scene("zerobot"), "is a robot, not a scene"),
    (lambda d: bc.Pair("a.stl", d.mesh), "a of a Pair is a str"),
    (lambda d: bc.Pair(d.mesh, None), "b of a Pair is a NoneType"),
    (lambda d: bc.MeshTree([], []), "no triangles"),
    (lambda d: bc.MeshTree([[0, 0, 0]], [[0.5, 1, 2]]), "not vertex indices"),
    (lambda d: bc.MeshTree("a.stl", [[0, 1, 2]]), "vertices are no numbers"),
    (lambda d: bc.fk(d.scene, [0]), "swapped"),
    (lambda d: bc.fk(d.robot, [0, 1]), "has 1 joints: j"),
    (lambda d: bc.random_configurations(d.robot, 0), "n is 0"),
    (lambda d: bc.random_configurations(d.robot, 3, seed=-1), "seed is -1"),
    (lambda d: bc.inverse(d.robot, [0, 0, 0], [0, 0, 1]), "needle"),
    (lambda d: bc.check_plans(d.robot, d.scene, "gone.csv"), "gone.csv"),
    (lambda d: bc.check_plans(d.robot, d.scene, ["a"]), "NeedlePlans"),
    (lambda d: bc.report([1], "page.html"), "result is a list"),
    (lambda d: bc.verify("gone.json", d.robot), "scene"),
]


@pytest.mark.parametrize("row", range(len(PYTHON)))
def test_a_mistake_in_python_is_our_error_in_one_line(door, row):
    call, saying = PYTHON[row]
    with pytest.raises(BorecheckError) as raised:
        call(door)
    text = str(raised.value)
    assert "\n" not in text
    assert saying in text


def test_at_least_sixty_mistakes_are_held():
    assert len(CLI) + len(PYTHON) >= 60
