"""Strangers' files: what they reach for beyond their folder is refused."""

import pytest

from borecheck.cli import main
from borecheck.errors import InputError, UrdfError
from borecheck.geometry.mesh.primitives import box
from borecheck.geometry.mesh_files.reading import write_stl
from borecheck.robots.robot import load_robot
from borecheck.validation import Options, validate_file, validate_text
from studies import hostile_files
from studies.hostile_makers import MAKERS
from tests.places import DATA

BOX = "<collision><geometry><box size='1 1 1'/></geometry></collision>"
MESH = '<{0}><geometry><mesh filename="{1}"/></geometry></{0}>'


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """A robot's folder with a mesh outside."""
    monkeypatch.setenv("HOME", "/nobody")
    write_stl(tmp_path / "a.stl", box("a", (1, 1, 1)))
    (tmp_path / "robot").mkdir()
    return tmp_path / "robot"


def robot(folder, mesh="../a.stl", kind="collision"):
    path = folder / "r.urdf"
    shapes = MESH.format(kind, mesh) + (BOX if kind == "visual" else "")
    path.write_text(f'<robot name="r"><link name="l">{shapes}</link></robot>')
    return path


def codes(path, **more):
    found = validate_file(path, run=False, **more)
    return {(f.code, str(f.severity)) for f in found if f.code.startswith("G50")}


def test_a_mesh_outside_is_an_error_where_it_is_needed(folder):
    assert codes(robot(folder)) == {("G504", "error")}
    assert codes(robot(folder, kind="visual")) == {("G504", "warning")}
    assert codes(robot(folder), package_paths=[folder.parent]) == set()
    assert codes(robot(folder), allow_outside=True) == set()


def test_check_refuses_it_by_link_and_takes_it_when_allowed(folder, capsys):
    path, far = robot(folder), f"{folder.parent / 'a.stl'}:m@5,0,0"
    words = ["check", str(path), far, "--q", "home"]
    assert main(words) == 2
    told = capsys.readouterr().err
    assert "link 'l'" in told
    assert "--allow-outside" in told
    assert told.count("borecheck: error:") == 1
    assert told.endswith("--allow-outside\n")
    assert main([*words, "--allow-outside"]) == 0


@pytest.mark.parametrize("suffix", [".urdf", ".urdf.xacro"])
def test_a_robot_that_is_a_link_out_of_its_folder_is_not_followed(folder, suffix):
    secret = folder.parent / f"secret{suffix}"
    secret.write_text("<robot name='hunter2'><hunter2/></robot>")
    link = folder / f"r{suffix}"
    link.symlink_to(secret)
    (finding,) = validate_file(link, run=False)
    assert (finding.code, "hunter2" in finding.message) == ("D101", False)
    with pytest.raises(UrdfError, match="is a link"):
        load_robot(link)
    assert len(validate_file(link, run=False, allow_outside=True)) > 1
    link.unlink()
    (folder / f"s{suffix}").write_text("<robot name='s'><link name='l'/></robot>")
    link.symlink_to(f"s{suffix}")
    assert "D101" not in {f.code for f in validate_file(link, run=False)}


def test_settings_beside_a_robot_name_nothing_outside(folder):
    path = robot(folder, "a.stl")
    settings = folder / "borecheck.toml"
    for line in ('package-path = [".."]', 'srdf = "/etc/passwd"', 'reference = "../x"'):
        settings.write_text(f"[validate]\n{line}\n")
        with pytest.raises(InputError, match=r"borecheck.toml: .*--allow-outside"):
            validate_file(path, run=False)
        validate_file(path, run=False, configured=False)
    settings.write_text('[validate]\npackage-path = ["below"]\n')
    validate_file(path, run=False)


def test_settings_that_the_user_names_may(folder, capsys):
    named = folder.parent / "mine.toml"
    named.write_text(f'[validate]\npackage-path = ["{folder.parent.parent}"]\n')
    path = robot(folder, "../a.stl")
    main(["validate", str(path), "--no-run", "--brief", "--config", str(named)])
    assert "G504" not in capsys.readouterr().out


def test_a_path_that_find_made_is_not_absolute(folder):
    source = DATA / "cases" / "xacro_find_is_not_absolute" / "mypkg"
    found = validate_file(source / "r.urdf.xacro", run=False, configured=False)
    assert [f.code for f in found if f.code in ("G501", "G503", "G504")] == []
    absolute = robot(folder, str(source / "meshes" / "box.stl"))
    found = validate_file(absolute, run=False, allow_outside=True, configured=False)
    assert "G503" in {f.code for f in found}


@pytest.mark.parametrize(
    ("doctype", "is_refused"),
    [
        ("<!DOCTYPE robot>", False),
        ('<!DOCTYPE robot SYSTEM "x.dtd">', True),
        ('<!DOCTYPE robot PUBLIC "x" "y">', True),
        ("<!DOCTYPE robot []>", True),
        ('<!DOCTYPE robot [<!ATTLIST robot a CDATA "b">]>', True),
        ('<!-- <!DOCTYPE robot> --><!DOCTYPE robot [<!ENTITY a "b">]>', True),
    ],
)
def test_a_document_type_that_declares_is_refused(doctype, is_refused):
    text = f'{doctype}<robot name="r"><link name="l"/></robot>'
    found = validate_text(text, options=Options(run=False))
    assert any("DOCTYPE" in f.message for f in found) is is_refused


@pytest.mark.parametrize("kind", MAKERS)
def test_hostile_files_reach_nothing(kind, tmp_path):
    tally = hostile_files.run(kind, 0, 5, 3, tmp_path)
    assert [p for p in tally.problems if not p.endswith(" s")] == []
    assert sum(tally.counts.values()) >= 5
