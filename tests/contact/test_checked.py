"""What was checked stands first: sizes, places, and what is odd about them."""

import json

import numpy as np
import pytest

import borecheck as bc
from borecheck.cli import main
from borecheck.contact.checked import checked
from borecheck.contact.margin import NO_MARGIN
from borecheck.core.se3 import transform
from borecheck.errors import UsageError
from borecheck.geometry.mesh.primitives import box
from borecheck.geometry.mesh.triangle_mesh import TriangleMesh
from borecheck.geometry.mesh_files.reading import write_stl
from borecheck.plans.corridor import Corridor
from tests.places import PROJECT, ROBOTS

ROBOT = str(ROBOTS / "two_link.urdf")
MOST_LINES = 6
CORRIDOR = Corridor(np.array([0, 0, 0.1]), np.array([0, 0, 0.04]), 0.0006)
VERDICTS = ("CLEAR", "CONTACT", "UNKNOWN")


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("scene")
    for name in "abcdef":
        write_stl(folder / f"{name}.stl", box(name, (0.2, 0.3, 0.4)))
    return folder


def head(capsys, *words):
    """The lines before the verdict, and the document."""
    main(["check", ROBOT, *map(str, words)])
    lines = capsys.readouterr().out.splitlines()
    verdict = next(k for k, line in enumerate(lines) if line.startswith(VERDICTS))
    main(["check", ROBOT, *map(str, words), "--format", "json"])
    return lines[:verdict], json.loads(capsys.readouterr().out)


def test_robot_obstacle_and_patient_are_told_with_size_and_place(capsys, folder):
    lines, document = head(
        capsys,
        f"{folder / 'a.stl'}:m@0.5,0,0.6,0,0,90deg",
        *("--patient", f"{folder / 'b.stl'}:m@-0.7,0.01,0"),
        *("--base", "0.1,0,0,0,0,45deg", "--q", "0", "--margin", "2mm"),
    )
    assert lines == [
        f"checked: robot {ROBOT}, base at (100, 0, 0) mm turned by (0, 0, 45) deg",
        "  patient b: 200 x 300 x 400 mm about (-700, 10, 0) mm",
        "  obstacle a: 300 x 200 x 400 mm about (500, 0, 600) mm",
        "  margin 2 mm",
    ]
    about = document["checked"]
    assert [body["role"] for body in about["bodies"]] == ["other", "patient"]
    np.testing.assert_allclose(about["bodies"][0]["size_m"], [0.3, 0.2, 0.4])
    np.testing.assert_allclose(about["bodies"][1]["centre_m"], [-0.7, 0.01, 0.0])
    assert about["margin_m"] == 0.002
    assert about["warnings"] == []


@pytest.mark.parametrize("count", [1, 4, 5, 6])
def test_of_many_bodies_the_rest_is_told_together(capsys, folder, count):
    files = [f"{folder / name}.stl:m@0,{k},0" for k, name in enumerate("abcdef")]
    lines, _ = head(capsys, *files[:count], "--q", "0")
    assert len(lines) <= MOST_LINES
    if count > 4:
        width = 1000 * (count - 4) + 300
        assert f"and {count - 3} more, within 200 x {width} x 400 mm" in lines[-2]


def test_the_paths_and_the_plans_verdicts_begin_so_too(capsys, folder, tmp_path):
    (tmp_path / "way.csv").write_text("j\n0\n0.1\n")
    lines, document = head(
        capsys, f"{folder / 'a.stl'}:m@1,0,0", "--path", tmp_path / "way.csv"
    )
    assert lines[0].startswith("checked: robot ")
    assert document["checked"]["corridor_m"] is None
    plans = PROJECT / "urdf" / "zerobot" / "examples" / "plans.csv"
    words = ["check", "zerobot", "ct_gantry", "--plan", str(plans), "--samples", "2"]
    main([*words, "--no-certificate"])
    lines = capsys.readouterr().out.splitlines()
    assert lines[0] == "checked: robot zerobot (mount=+90), base at (0, 0, 0) mm"
    assert "the needle may be in the patient only within 2.55 mm" in lines[5]
    assert lines[6].startswith("CONTACT")


def warnings_of(*files, **more):
    robot = bc.load_robot(ROBOT, **more)
    return checked(robot, bc.load_scene(list(files)), NO_MARGIN).warnings


@pytest.mark.parametrize("patient", [True, False])
@pytest.mark.parametrize("corridor", [None, CORRIDOR])
def test_a_needle_that_goes_into_nobody_is_told(folder, patient, corridor):
    robot = bc.load_robot(ROBOT)
    there = f"{folder / 'a.stl'}:m@0.9,0,0"
    given = {"patients": [there]} if patient else {}
    scene = bc.load_scene([] if patient else [there], **given)
    warnings = checked(robot, scene, NO_MARGIN, corridor=corridor).warnings
    told = [line for line in warnings if "there is no patient" in line]
    assert len(told) == (corridor is not None and not patient)


def test_a_robot_that_reaches_nothing_is_told(folder):
    near, far = f"{folder / 'a.stl'}:m@0.9,0,0", f"{folder / 'a.stl'}:m@4,0,0"
    assert warnings_of(near) == ()
    assert warnings_of(far, near) == ()
    (line,) = warnings_of(far)
    # from z = 0.2 its tip is 0.9 m away, at a radius of 50 mm; the box begins at 3.9
    out = int(line.partition("at least ")[2].partition(" mm")[0])
    assert 2990 <= out <= 3.9e3 - np.hypot(900, 50)
    assert len(warnings_of(near, base=transform([9.0, 0.0, 0.0]))) == 1


def test_warnings_stand_in_text_and_document(capsys, folder):
    words = [f"{folder / 'a.stl'}:m@4,0,0", "--q", "0"]
    main(["check", ROBOT, *words])
    assert "\nwarning: " in capsys.readouterr().out
    _, document = head(capsys, *words)
    assert document["warnings"] == document["checked"]["warnings"] != []


def test_a_base_in_millimetres_is_refused_in_python_too():
    with pytest.raises(UsageError, match="millimetres"):
        bc.load_robot(ROBOT, base=transform([800.0, 0.0, 0.0]))
    with pytest.raises(UsageError, match="millimetres"):
        bc.load_robot("zerobot", base=transform([0.0, 800.0, 0.0]))
    with pytest.raises(UsageError, match="degrees"):
        bc.load_scene(f"{ROBOT}@0,0,0,0,0,90")


def test_a_body_inside_out_has_a_word_and_the_same_verdict(capsys, tmp_path):
    whole = box("f", (0.2, 0.3, 0.4))
    for name, triangles in (
        ("right", whole.triangles),
        ("wrong", whole.triangles[:, ::-1]),
    ):
        mesh = TriangleMesh(name, whole.vertices, triangles)
        write_stl(tmp_path / f"{name}.stl", mesh)
    for at in ("1,0,0", "0,0,0.6"):
        told = [
            head(capsys, f"{tmp_path / name}.stl:m@{at}", "--q", "0")[1]
            for name in ("right", "wrong")
        ]
        assert told[0]["verdict"] == told[1]["verdict"]
        assert told[0]["checked"]["warnings"] == []
        (warning,) = told[1]["checked"]["warnings"]
        assert warning.startswith("wrong is inside out: its triangles face inwards")
