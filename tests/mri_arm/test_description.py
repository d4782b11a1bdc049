"""The MRI arm as data: three sources agree, meshes are sound, home is clear."""

from dataclasses import fields

import numpy as np
import pytest

import borecheck as bc
from borecheck.geometry.mesh_files.reading import read_mesh
from borecheck.robots.description import hook
from borecheck.robots.kinematics.configurations import sample_configurations
from borecheck.robots.kinematics.cross_check import cross_check
from borecheck.robots.kinematics.perturbation import unseen_perturbations
from borecheck_models.shapes import signed_volume
from mri_arm.description import DESCRIPTION
from mri_arm.dimensions import LIMITS, Dimensions
from mri_arm.parameters import NAMES, nominal

STL_ROUNDING = 1e-6  # float32 near 1 m

ARGUMENTS = (
    {},
    {"needle_mount": "square"},
    {"base_x": "-0.2", "base_y": "1.3", "base_yaw": "3.0", "needle_length": "0.2"},
)


@pytest.fixture(scope="module")
def arm():
    return bc.load_robot("mri_arm")


@pytest.fixture(scope="module")
def magnet():
    return bc.load_scene("mri_open_magnet")


@pytest.mark.parametrize("arguments", ARGUMENTS)
def test_three_sources_agree(arguments):
    robot = bc.load_robot("mri_arm", **arguments)
    rng = np.random.default_rng(0)
    result = cross_check(robot, sample_configurations(robot.model, rng, 50))
    assert not result.disagreements


def test_every_wrong_number_would_be_noticed(arm):
    rng = np.random.default_rng(1)
    qs = sample_configurations(arm.model, rng, 20)
    study = unseen_perturbations(arm, qs)
    assert len(study.seen) > 100
    for unseen in study.unseen:  # the length of an axis means nothing
        assert "/axis" in unseen.number, unseen
        assert unseen.why.startswith("moves no link")


def test_limits_are_typed_twice_and_equal(arm):
    assert tuple(LIMITS) == arm.model.joint_names
    np.testing.assert_allclose(arm.model.lower, [a for a, _ in LIMITS.values()])
    np.testing.assert_allclose(arm.model.upper, [b for _, b in LIMITS.values()])


def test_description_names_what_exists(arm):
    assert {j.name for j in DESCRIPTION.joints} == set(arm.model.joint_names)
    assert set(DESCRIPTION.frames.values()) <= set(arm.model.link_names)
    assert DESCRIPTION.needle_link in arm.model.link_names
    assert {f.name for f in fields(Dimensions)} == set(hook(DESCRIPTION.dimensions)())


def test_calibration_of_the_urdf_has_the_papers_parameters():
    from borecheck.calibration.arm_source import read_subject

    subject = read_subject("mri_arm", {})
    assert subject.arm.forms.names == NAMES
    for name, value in nominal().items():
        assert subject.arm.nominal[name] == pytest.approx(value, abs=1e-15)


@pytest.mark.parametrize("mount", ["along", "square"])
def test_meshes_are_closed_and_outward(mount):
    arguments = {"needle_length": "0.15", "needle_mount": mount}
    counts = []
    for level in ("coarse", "middle", "fine"):
        meshes = hook(DESCRIPTION.meshes)(level, arguments)
        counts.append(sum(len(mesh.triangles) for mesh in meshes.values()))
        for mesh in meshes.values():
            assert mesh.is_closed, mesh.name
            assert signed_volume(mesh) > 0.0
    assert counts[0] < 4000 < 10_000 < counts[1] < 50_000 < counts[2]


def test_shipped_meshes_are_the_generated_ones():
    defaults = {name: a.default for name, a in DESCRIPTION.arguments.items()}
    for stem, mesh in hook(DESCRIPTION.meshes)("coarse", defaults).items():
        shipped = read_mesh(DESCRIPTION.shipped / f"{stem}.stl")
        np.testing.assert_allclose(shipped.corners, mesh.corners, atol=STL_ROUNDING)


def test_needle_tip_is_at_the_tool_frame(arm):
    meshes = {part.link: part.mesh for part in arm.parts}
    lowest, highest = meshes["needle"].bounds[:, 2]
    assert highest == pytest.approx(0.0, abs=STL_ROUNDING)
    assert lowest == pytest.approx(-0.122, abs=1e-3)
    q = arm.model.configuration({"q2": 0.1, "q5": 0.4, "insertion": 0.03})
    T = arm.placements(q)
    np.testing.assert_array_equal(T["needle"], T["E"])


def test_bodies_of_the_arm_keep_apart_within_the_limits(arm):
    """Links that are no neighbours never meet: the joints' travel leaves room."""
    scene = bc.load_scene("mri_open_magnet")
    rng = np.random.default_rng(2)
    for q in arm.model.random_configurations(rng, 20):
        verdict = bc.check(arm, scene, q)
        assert not verdict.self_contacts


def test_home_is_clear_and_the_patient_is_reached(arm, magnet):
    assert bc.check(arm, magnet, arm.home).verdict == "clear"
    into_the_head = arm.model.configuration({"q1": 0.2})
    found = hook(DESCRIPTION.inverse)([0.0, -0.02, 0.0], [0.0, 1.0, 0.0], 0.0)
    assert found.configurations
    verdict = bc.check(arm, magnet, found.configurations[0])
    assert verdict.verdict == "contact"
    assert into_the_head.shape == (7,)


def test_main_body_stands_outside_the_2_mT_line(arm):
    from borecheck_models.scanners.mri_open_magnet import zones_of

    base = arm.placements(arm.home)["W"][:3, 3]
    over_axis_1 = [base[0], base[1], 0.0]
    assert zones_of([over_axis_1]) == [("0.5 mT",)]
