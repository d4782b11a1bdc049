import os
from pathlib import Path

import pytest

from borecheck.robots.urdf.package_paths import find_package, resolve
from borecheck.robots.urdf.reach import NO_ROOTS, Roots

NOWHERE: dict[str, str] = {}


@pytest.fixture
def tree(tmp_path):
    """A package in a workspace: ws/src/arm/{package.xml,urdf,meshes/a.stl}."""
    package = tmp_path / "ws" / "src" / "arm_v2"
    (package / "urdf").mkdir(parents=True)
    (package / "meshes").mkdir()
    (package / "meshes" / "a.stl").write_text("x")
    (package / "package.xml").write_text("<package><name>arm</name></package>")
    return tmp_path


def _package(tree: Path) -> Path:
    return tree / "ws" / "src" / "arm_v2"


def test_a_package_is_found_by_the_name_in_its_manifest(tree):
    package = _package(tree)
    found = resolve("package://arm/meshes/a.stl", package / "urdf", NO_ROOTS, NOWHERE)
    assert found.path == package / "meshes" / "a.stl"


@pytest.mark.parametrize("root", ["ws/src/arm_v2", "ws/src", "ws", "."])
def test_a_package_is_found_below_a_given_root(tree, root, tmp_path_factory):
    elsewhere = tmp_path_factory.mktemp("elsewhere")
    found = resolve(
        "package://arm/meshes/a.stl", elsewhere, Roots((tree / root,)), NOWHERE
    )
    assert found.path == _package(tree) / "meshes" / "a.stl"


def test_the_environment_is_searched(tree, tmp_path_factory):
    elsewhere = tmp_path_factory.mktemp("elsewhere")
    share = tree / "install" / "share" / "arm"
    share.mkdir(parents=True)
    (share / "b.stl").write_text("x")
    environment = {"AMENT_PREFIX_PATH": f"/nowhere{os.pathsep}{tree / 'install'}"}
    assert (
        resolve("package://arm/b.stl", elsewhere, NO_ROOTS, environment).path
        == share / "b.stl"
    )
    assert (
        resolve("model://arm/b.stl", elsewhere, NO_ROOTS, environment).path is not None
    )


def test_a_relative_base_means_the_working_directory(tree, monkeypatch):
    monkeypatch.chdir(_package(tree))
    found = resolve("../meshes/a.stl", Path("urdf"), NO_ROOTS, NOWHERE)
    assert found.path == _package(tree) / "meshes" / "a.stl"


def test_what_was_tried_is_told(tree):
    base = _package(tree) / "urdf"
    found = resolve("package://other/a.stl", base, Roots((tree / "ws",)), NOWHERE)
    assert found.path is None
    assert found.problem == "no such file"
    assert tree / "ws" / "other" / "a.stl" in found.tried


@pytest.mark.parametrize(
    "reference",
    [
        "package://arm/../../../secret.stl",
        "../../../../../../../../../../../../etc/passwd",
    ],
)
def test_what_leaves_the_package_is_not_followed(tree, reference):
    (tree / "secret.stl").write_text("x")
    found = resolve(reference, _package(tree) / "urdf", NO_ROOTS, NOWHERE)
    assert found.path is None
    assert found.problem is not None
    assert "leaves" in found.problem


@pytest.mark.parametrize("reference", ["../meshes/A.STL", "..\\meshes\\a.stl"])
def test_another_spelling_is_a_near_miss_not_a_match(tree, reference):
    found = resolve(reference, _package(tree) / "urdf", NO_ROOTS, NOWHERE)
    assert found.path is None
    assert found.near_miss == _package(tree) / "meshes" / "a.stl"


def test_three_slashes_are_a_near_miss(tree):
    found = resolve(
        "package:///arm/meshes/a.stl", _package(tree) / "urdf", NO_ROOTS, NOWHERE
    )
    assert found.path is None
    assert found.near_miss == _package(tree) / "meshes" / "a.stl"


def test_symlink_loops_and_directories_are_no_files(tree):
    base = _package(tree) / "urdf"
    (base / "loop.stl").symlink_to(base / "loop.stl")
    (base / "around").symlink_to(base)
    assert resolve("loop.stl", base, NO_ROOTS, NOWHERE).path is None
    assert (
        resolve("around", base, NO_ROOTS, NOWHERE).problem
        == f"{base / 'around'} is a directory"
    )
    assert resolve("package://none/x.stl", base, Roots((base,)), NOWHERE).path is None


@pytest.mark.parametrize(
    "reference", ["", "http://host/a.stl", "package://", "a\0b.stl"]
)
def test_odd_references_end_without_an_exception(tree, reference):
    found = resolve(reference, _package(tree), NO_ROOTS, NOWHERE)
    assert found.path is None
    assert found.problem


def test_find_package_tells_folder_and_tried_paths(tree):
    found = find_package("arm", _package(tree) / "urdf", NO_ROOTS, NOWHERE)
    assert found.path == _package(tree)
    assert found.path in found.tried
    assert find_package("none", _package(tree), NO_ROOTS, NOWHERE).path is None
