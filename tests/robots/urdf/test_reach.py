"""What a robot file may read: its own folder tree and the roots, links followed."""

from pathlib import Path

import pytest

from borecheck.robots.urdf.package_paths import find_package, resolve
from borecheck.robots.urdf.reach import NO_ROOTS, Roots, manifest_of, reach_of

NOWHERE: dict[str, str] = {}
MANIFEST = "<package><name>{}</name></package>"


@pytest.fixture
def ws(tmp_path, monkeypatch):
    """A workspace with two packages, and a folder that is none, beside a home."""
    monkeypatch.setenv("HOME", str(tmp_path / "home"))
    for name in ("arm", "tool", "secret"):
        (tmp_path / "ws" / name / "meshes").mkdir(parents=True)
        (tmp_path / "ws" / name / "meshes" / "a.stl").write_text("x")
    for name in ("arm", "tool"):
        (tmp_path / "ws" / name / "package.xml").write_text(MANIFEST.format(name))
    (tmp_path / "ws" / "arm" / "urdf").mkdir()
    return tmp_path / "ws"


def holds(base: Path, path: Path, roots: Roots = NO_ROOTS) -> bool:
    return reach_of(base, roots, NOWHERE).holds(path)


def test_a_package_holds_itself_and_the_packages_beside_it(ws):
    base = ws / "arm" / "urdf"
    assert holds(base, ws / "arm" / "meshes" / "a.stl")
    assert holds(base, ws / "tool" / "meshes" / "a.stl")
    assert not holds(base, ws / "secret" / "meshes" / "a.stl")
    assert not holds(base, ws / "notes.txt")
    assert not holds(base, Path("/etc/passwd"))


def test_without_a_package_it_is_the_own_folder_and_the_meshes_beside(tmp_path):
    base = tmp_path / "robot"
    assert holds(base, base / "parts" / "a.xacro")
    assert holds(base, tmp_path / "meshes" / "a.stl")
    assert not holds(base, tmp_path / "config" / "a.yaml")
    assert not holds(base, tmp_path / "a.stl")
    assert holds(tmp_path / "urdf", tmp_path / "config" / "a.yaml")


def test_a_home_is_no_folder_tree_of_a_robot(tmp_path, monkeypatch):
    monkeypatch.setenv("HOME", str(tmp_path))
    (tmp_path / "package.xml").write_text(MANIFEST.format("home"))
    assert not holds(tmp_path / "urdf", tmp_path / ".ssh" / "id")
    assert not holds(tmp_path / "a" / "b", tmp_path / ".ssh" / "id")


def test_roots_and_the_environment_are_within_reach(ws, tmp_path):
    file = ws / "secret" / "meshes" / "a.stl"
    base = tmp_path / "elsewhere"
    assert not holds(base, file)
    assert holds(base, file, Roots((ws,)))
    assert holds(base, file, Roots(allow_outside=True))
    assert reach_of(base, NO_ROOTS, {"ROS_PACKAGE_PATH": str(ws)}).holds(file)


def test_links_are_followed_before_it_is_asked(ws):
    base = ws / "arm" / "urdf"
    (base / "link.stl").symlink_to(ws / "secret" / "meshes" / "a.stl")
    (base / "around").symlink_to(ws)
    assert not holds(base, base / "link.stl")
    assert not holds(base, base / "around" / "secret" / "meshes" / "a.stl")
    found = resolve("link.stl", base, NO_ROOTS, NOWHERE)
    assert found.is_refused
    assert found.path is None


def test_a_workspace_installed_by_links_leads_back_to_its_sources(ws, tmp_path):
    share = tmp_path / "install" / "share" / "arm"
    (share / "meshes").mkdir(parents=True)
    for name in ("package.xml", "meshes/a.stl"):
        (share / name).symlink_to(ws / "arm" / name)
    assert holds(share / "urdf", share / "meshes" / "a.stl")


def test_a_manifest_is_a_manifest(tmp_path):
    (tmp_path / "package.xml").symlink_to("/etc/passwd")
    assert manifest_of(tmp_path) is None
    assert not holds(tmp_path / "urdf", Path("/etc/hostname"))


@pytest.mark.parametrize(
    "reference",
    [
        "../../secret/meshes/a.stl",
        "package://arm/../secret/meshes/a.stl",
        "package://secret/meshes/a.stl",
        "file://{ws}/secret/meshes/a.stl",
        "{ws}/secret/meshes/a.stl",
        "../../none/b.stl",
    ],
)
def test_references_beyond_are_refused_by_one_line(ws, reference):
    found = resolve(reference.format(ws=ws), ws / "arm" / "urdf", NO_ROOTS, NOWHERE)
    assert found.path is None
    assert found.is_refused
    assert found.problem is not None
    assert "--package-path" in found.problem
    assert "--allow-outside" in found.problem
    allowed = Roots(allow_outside=True)
    again = resolve(reference.format(ws=ws), ws / "arm" / "urdf", allowed, NOWHERE)
    assert not again.is_refused


def test_an_absolute_name_of_no_file_is_only_not_found(ws):
    found = resolve("/no/such/file.stl", ws / "arm", NO_ROOTS, NOWHERE)
    assert (found.is_refused, found.problem) == (False, "no such file")


def test_a_package_beyond_is_named_and_refused(ws):
    found = find_package("secret", ws / "arm", NO_ROOTS, NOWHERE)
    assert found.is_refused
    assert str(ws / "secret") in (found.problem or "")
    assert find_package("tool", ws / "arm", NO_ROOTS, NOWHERE).path == ws / "tool"
