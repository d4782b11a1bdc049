"""Transforms of ITK: files of our own against SimpleITK, both ways."""

import json

import numpy as np
import pytest
import SimpleITK as sitk  # noqa: N813 - its manual calls it so

from borecheck.errors import InputError
from borecheck.exchange.itk_transform import read_transform, transform_text
from tests.places import DATA

SLICER = DATA / "slicer"
EXPECTED = json.loads((SLICER / "manifest.json").read_text())["entries"]
SEEDED = np.random.default_rng(19)


def moved(T, points):
    return points @ T[:3, :3].T + T[:3, 3]


def by_itk(transform, points):
    """Points [m] as SimpleITK maps them, which counts in mm."""
    return 1e-3 * np.array(
        [transform.TransformPoint(p) for p in (1e3 * points).tolist()]
    )


def versor():
    made = sitk.VersorRigid3DTransform()
    made.SetRotation((0.3, -0.4, 0.87), 2.9)
    return made


def euler(z_y_x=False):
    made = sitk.Euler3DTransform()
    made.SetRotation(0.3, -1.1, 2.4)
    made.SetComputeZYX(z_y_x)
    return made


def affine():
    made = sitk.AffineTransform(3)
    made.SetMatrix(euler().GetMatrix())
    return made


def composite():
    return sitk.CompositeTransform(
        [versor(), affine(), sitk.TranslationTransform(3, (4, 5, 6))]
    )


KINDS = {
    "versor": versor,
    "euler": euler,
    "euler_zyx": lambda: euler(True),
    "affine": affine,
    "translation": lambda: sitk.TranslationTransform(3, (1.5, -2.5, 700.0)),
    "composite": composite,
}


@pytest.mark.parametrize("suffix", [".tfm", ".h5"])
@pytest.mark.parametrize("kind", KINDS)
def test_what_itk_writes_moves_points_as_itk_does(kind, suffix, tmp_path):
    if suffix == ".h5":
        pytest.importorskip("h5py")
    made = KINDS[kind]()
    if hasattr(made, "SetCenter"):
        made.SetCenter((5.0, -180.0, -747.0))
        made.SetTranslation((12.5, -7.25, 33.0))
    file = tmp_path / f"t{suffix}"
    sitk.WriteTransform(made, str(file))
    points = SEEDED.uniform(-1.0, 1.0, (20, 3))
    np.testing.assert_allclose(
        moved(read_transform(file), points), by_itk(made, points), atol=1e-9
    )


def test_itk_reads_what_we_write(tmp_path):
    T = read_transform(SLICER / "rigid_versor.tfm")
    file = tmp_path / "ours.tfm"
    file.write_text(transform_text(T))
    points = SEEDED.uniform(-1.0, 1.0, (20, 3))
    theirs = sitk.ReadTransform(str(file))
    np.testing.assert_allclose(by_itk(theirs, points), moved(T, points), atol=1e-12)
    np.testing.assert_allclose(read_transform(file), T, atol=1e-12)


@pytest.mark.parametrize(
    "name", ["rigid_affine.tfm", "rigid_versor.tfm", "rigid_affine.h5"]
)
def test_the_same_transform_in_three_files(name):
    if name.endswith(".h5"):
        pytest.importorskip("h5py")
    points = 1e-3 * np.array(EXPECTED[name]["points_in_lps_mm"])
    there = 1e-3 * np.array(EXPECTED[name]["file_maps_to_lps_mm"])
    # the manifest has six digits of a millimetre
    np.testing.assert_allclose(
        moved(read_transform(SLICER / name), points), there, atol=1e-9
    )


def scaled():
    made = sitk.Similarity3DTransform()
    made.SetScale(1.001)
    return made


def stretched(*factors):
    made = sitk.AffineTransform(3)
    made.SetMatrix(np.diag(factors).reshape(-1).tolist())
    return made


REFUSED = {
    "a scale": (scaled, "no rigid transform"),
    "a stretch": (lambda: stretched(1.0, 1.0, 1.001), "not rigid"),
    "a mirror": (lambda: stretched(1.0, 1.0, -1.0), "not rigid"),
}


@pytest.mark.parametrize("case", REFUSED)
def test_what_is_not_rigid_is_refused(case, tmp_path):
    made, said = REFUSED[case]
    sitk.WriteTransform(made(), str(tmp_path / "t.tfm"))
    with pytest.raises(InputError, match=said):
        read_transform(tmp_path / "t.tfm")


HEAD = "#Insight Transform File V1.0\n"
ONE = "Transform: AffineTransform_double_3_3\nParameters: 1 0 0 0 1 0 0 0 1 1 2 3\n"
BROKEN = {
    "another file": ("solid x\n", "no transform"),
    "nothing": (HEAD, "holds no transform"),
    "too few": (HEAD + ONE.replace(" 3\n", "\n"), "11 parameters"),
    "not a number": (HEAD + ONE.replace(" 3\n", " nan\n"), "no finite number"),
    "too large": (HEAD + ONE.replace(" 3\n", " 1e400\n"), "no finite number"),
    "two": (HEAD + ONE + ONE, "nothing joins"),
    "twice": (HEAD + ONE + "Parameters: 1\n", "twice"),
    "words": (HEAD + ONE + "hello\n", "no line of a transform"),
    "two-dimensional": (HEAD + ONE + "FixedParameters: 0 0\n", "fixed"),
}


@pytest.mark.parametrize("case", BROKEN)
def test_what_is_broken_is_told_in_a_line(case, tmp_path):
    text, said = BROKEN[case]
    (tmp_path / "t.tfm").write_text(text)
    with pytest.raises(InputError, match=said) as told:
        read_transform(tmp_path / "t.tfm")
    assert "\n" not in str(told.value)


def test_damaged_files_are_refused_or_rigid(tmp_path):
    """Bytes cut, swapped and overwritten in good files."""
    rng = np.random.default_rng(3)
    for name in ("rigid_affine.tfm", "rigid_affine.h5"):
        good = (SLICER / name).read_bytes()
        for _ in range(150):
            damaged = bytearray(good)
            for _ in range(rng.integers(1, 4)):
                damaged[rng.integers(len(damaged))] = rng.integers(256)
            file = tmp_path / "t"
            file.write_bytes(bytes(damaged[: rng.integers(1, len(damaged) + 1)]))
            try:
                R = read_transform(file)[:3, :3]
            except InputError:
                continue
            np.testing.assert_allclose(R @ R.T, np.eye(3), atol=1e-9)
