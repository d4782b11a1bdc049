"""Scans as they come: each slice where its position says, or one line of refusal."""

import gzip

import numpy as np
import pytest

from borecheck.cli import main
from borecheck.errors import BorecheckError
from borecheck.patients.dicom_headers import TAGS
from borecheck.patients.reading import list_series, read_volume
from borecheck.patients.volume import HOUNSFIELD, LABELS
from tests.patients.series import block, dataset, straight, write_series

# Positions are written with six decimals, [mm].
WRITTEN = 1e-5


def corners(positions, across, down, values):
    """Centres of the corner voxels, from what was written."""
    _, rows, columns = values.shape
    return np.array(
        [
            positions[k] + np.array(down) * j + np.array(across) * i
            for k in (0, -1)
            for j in (0, rows - 1)
            for i in (0, columns - 1)
        ]
    )


@pytest.mark.parametrize(
    ("turn", "tilt_deg"),
    [("HFS", 0.0), ("HFS", 20.0), ("FFS", -20.0), ("HFP", 0.0), ("HFDR", 20.0)],
)
def test_slices_stay_where_positions_say(tmp_path, turn, tilt_deg):
    """Any orientation, tilted or not; the step may be oblique to the slices."""
    row, column = {
        "HFS": ([1, 0, 0], [0, 1, 0]),
        "FFS": ([-1, 0, 0], [0, 1, 0]),
        "HFP": ([-1, 0, 0], [0, -1, 0]),
        "HFDR": ([0, 1, 0], [-1, 0, 0]),
    }[turn]
    row, column = np.array(row, float), np.array(column, float)
    normal = np.cross(row, column)
    angle = np.radians(tilt_deg)
    tilted = np.cos(angle) * column + np.sin(angle) * normal
    values, step = block(), 3.0 * normal
    positions = straight(len(values), step)
    folder = write_series(
        tmp_path / "s",
        values,
        positions,
        orientation=(*row, *tilted),
        PatientPosition=turn,
    )
    volume = read_volume(folder)
    wanted = corners(positions, 2.5 * row, 2.0 * tilted, values)
    assert np.abs(volume.corners - wanted).max() < WRITTEN
    assert np.abs(volume.step - step).max() < WRITTEN
    assert volume.position == turn
    assert any("shear" in note for note in volume.notes) == (tilt_deg != 0.0)
    assert np.array_equal(np.stack(list(volume.planes())), values)


def test_names_of_files_and_their_order_count_for_nothing(tmp_path):
    values = block() + np.arange(8, dtype=np.int16)[:, None, None]
    positions = straight(8)
    read_volume(write_series(tmp_path / "a", values, positions))
    order = np.random.default_rng(3).permutation(8)
    names = [f"x{k}" for k in range(8)]
    other = write_series(tmp_path / "b", values[order], positions[order], names=names)
    volume = read_volume(other)
    assert np.array_equal(volume.origins, positions)
    assert np.array_equal(np.stack(list(volume.planes())), values)


def test_uneven_steps_keep_their_planes(tmp_path):
    values, positions = block(), straight(8)
    positions[5:, 2] += 1.5
    volume = read_volume(write_series(tmp_path / "s", values, positions))
    assert volume.step is None
    assert np.array_equal(volume.origins, positions)
    assert volume.to_json()["origins_lps_mm"] == positions.tolist()
    assert any("uneven" in note and "4.5 mm" in note for note in volume.notes)


@pytest.mark.parametrize(
    ("change", "saying"),
    [
        ({"PixelSpacing": None}, "PixelSpacing"),
        ({"ImagePositionPatient": None}, "ImagePositionPatient"),
        ({"ImageOrientationPatient": None}, "ImageOrientationPatient"),
        ({"orientation": (1, 0, 0, 0.5, 0.5, 0)}, "right angles"),
        ({"RescaleIntercept": None}, "RescaleIntercept"),
        ({"RescaleSlope": "0"}, "RescaleSlope"),
        ({"PatientPosition": "SITTING"}, "SITTING"),
        ({"Modality": "MR"}, "modality MR"),
        ({"SamplesPerPixel": 3}, "colour"),
        ({"NumberOfFrames": "8"}, "frames"),
        ({"SOPClassUID": "1.2.840.10008.5.1.4.1.1.7"}, "secondary capture"),
        ({"ImageType": ["ORIGINAL", "PRIMARY", "LOCALIZER"]}, "localizer"),
    ],
)
def test_a_series_that_cannot_be_placed_is_one_line(tmp_path, capsys, change, saying):
    folder = write_series(tmp_path / "s", block(), straight(8), **change)
    assert main(["patient", str(folder), "--geometry-only"]) == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert err.count("\n") == 1
    assert saying in err
    assert str(folder) in err


@pytest.mark.parametrize(
    ("keep", "saying"),
    [
        ([0, 1, 2, 4, 5, 6, 7], "a slice is missing: a step of 6 mm after slice 3"),
        ([0, 1, 2, 5, 6, 7], "2 slices are missing: a step of 9 mm"),
        ([0, 7], "a gap of 21 mm"),
        ([0, 1, 2], None),
        ([3], "one slice"),
    ],
)
def test_a_slice_that_is_missing_is_told_with_its_step(tmp_path, keep, saying):
    folder = write_series(tmp_path / "s", block()[keep], straight(8)[keep])
    if saying is None:
        assert read_volume(folder).slices == len(keep)
        return
    with pytest.raises(BorecheckError, match=saying):
        read_volume(folder)


def test_two_images_at_one_place_are_phases_unless_they_are_one_file(tmp_path):
    folder = write_series(tmp_path / "s", block(), straight(8))
    (folder / "copy.dcm").write_bytes((folder / "003.dcm").read_bytes())
    assert read_volume(folder).slices == 8
    again = dataset(block()[0] + 5, straight(8)[3], AcquisitionNumber="2")
    again.save_as(folder / "copy.dcm", enforce_file_format=True)
    with pytest.raises(BorecheckError, match=r"two images at one position.*copy\.dcm"):
        read_volume(folder)


def test_pixels_that_are_cut_short_are_told_with_their_file(tmp_path, capsys):
    folder = write_series(tmp_path / "s", block(), straight(8))
    whole = (folder / "004.dcm").read_bytes()
    (folder / "004.dcm").write_bytes(whole[:-400])
    assert main(["patient", str(folder), "--geometry-only"]) == 2
    err = capsys.readouterr().err
    assert "004.dcm" in err
    assert err.count("\n") == 1


def test_the_longest_series_is_read_and_the_rest_is_told(tmp_path):
    values = block()
    folder = write_series(tmp_path / "s", values, straight(8))
    names = [f"z{k}" for k in range(4)]
    write_series(folder, values[:4], straight(4), names=names, SeriesInstanceUID="2.5")
    write_series(
        folder,
        values[:1],
        straight(1),
        names=["scout"],
        ImageType=["ORIGINAL", "PRIMARY", "LOCALIZER"],
    )
    (folder / "README.txt").write_text("about")
    volume = read_volume(folder)
    assert volume.slices == 8
    assert any("of 2 series" in note for note in volume.notes)
    assert volume.dropped == (
        "scout: is a localizer (scout)",
        "README.txt: is not DICOM",
    )
    assert read_volume(folder, "2.5").slices == read_volume(folder, "2").slices == 4
    assert [one["slices"] for one in list_series(folder)] == [8, 4]
    with pytest.raises(BorecheckError, match="no series 9"):
        read_volume(folder, "9")


def test_empty_uids_are_told_and_padding_is_no_tissue(tmp_path):
    values = block()
    values[:, 0, :] = -1500
    empty = {"SeriesInstanceUID": "", "SOPInstanceUID": "", "FrameOfReferenceUID": ""}
    folder = write_series(
        tmp_path / "s", values, straight(8), PixelPaddingValue=-1500, **empty
    )
    volume = read_volume(folder)
    assert any("UIDs are empty" in note for note in volume.notes)
    for plane in volume.planes():
        assert np.isnan(plane[0]).all()
        assert np.isfinite(plane[1:]).all()


def test_no_tag_that_names_a_person_is_read(tmp_path, capsys):
    folder = write_series(tmp_path / "s", block(), straight(8))
    assert b"Doe^Jane" in (folder / "000.dcm").read_bytes()
    assert main(["patient", str(folder), "--geometry-only", "--format", "json"]) == 0
    assert "Doe" not in capsys.readouterr().out
    naming = ("Name", "Birth", "Address", "Physician", "Institution", "PatientID")
    assert not [tag for tag in TAGS if any(word in tag for word in naming)]


def nifti(path, values, affine, units="mm"):
    import nibabel

    image = nibabel.Nifti1Image(values, affine)
    image.header.set_xyzt_units(units)
    nibabel.save(image, path)


@pytest.mark.parametrize(("units", "scale"), [("mm", 1.0), ("meter", 1000.0)])
@pytest.mark.parametrize("suffix", [".nii", ".nii.gz"])
def test_nifti_is_turned_from_ras_and_scaled(tmp_path, suffix, units, scale):
    """A left-handed affine with a sheared third axis."""
    values = block().transpose(2, 1, 0)
    step = np.array([0.4, -0.6, 3.0])
    affine = np.eye(4)
    affine[:3, :3] = np.column_stack([[-2.5, 0, 0], [0, 2.0, 0], step])
    affine[:3, 3] = 40.0, 30.0, -100.0
    affine[:3] /= scale
    nifti(tmp_path / f"a{suffix}", values, affine, units)
    volume = read_volume(tmp_path / f"a{suffix}")
    assert volume.kind == HOUNSFIELD
    assert volume.position is None
    lps = np.diag([-1.0, -1.0, 1.0])
    ends = [(i, j, k) for k in (0, 7) for j in (0, 23) for i in (0, 31)]
    wanted = np.array(
        [lps @ (affine[:3, :3] @ e + affine[:3, 3]) * scale for e in ends]
    )
    assert np.abs(volume.corners - wanted).max() < 1e-4
    assert np.array_equal(np.stack(list(volume.planes())), block())


def nrrd_file(path, values, lines, encoding="gzip"):
    data = np.ascontiguousarray(values.transpose()).tobytes(order="F")
    data = values.tobytes() if values.ndim == 3 else data
    packed = gzip.compress(data) if encoding == "gzip" else data
    kind = {"int16": "short", "uint8": "uchar"}[str(values.dtype)]
    sizes = " ".join(map(str, values.shape[::-1]))
    head = (
        f"NRRD0004\ntype: {kind}\ndimension: {values.ndim}\nsizes: {sizes}\n"
        f"endian: little\nencoding: {encoding}\n{lines}\n\n"
    )
    path.write_bytes(head.encode() + packed)


@pytest.mark.parametrize("encoding", ["gzip", "raw"])
@pytest.mark.parametrize(
    ("space", "flip"),
    [("left-posterior-superior", 1.0), ("right-anterior-superior", -1.0)],
)
def test_nrrd_has_its_space_and_two_negative_axes(tmp_path, space, flip, encoding):
    values = block()
    lines = (
        f"space: {space}\nspace directions: (-2.5,0,0) (0,-2,0) (0,0,3)\n"
        "space origin: (40,30,-100)"
    )
    nrrd_file(tmp_path / "a.nrrd", values, lines, encoding)
    volume = read_volume(tmp_path / "a.nrrd")
    wanted = np.array([40.0 - 2.5 * 31, 30.0, -100.0]) * (flip, flip, 1.0)
    assert np.allclose(volume.corners[1], wanted)
    assert np.array_equal(np.stack(list(volume.planes())), values)


def test_a_segmentation_has_names_and_is_no_ct(tmp_path):
    values = (block() > 0).astype(np.uint8)
    lines = (
        "space: LPS\nspace directions: (2.5,0,0) (0,2,0) (0,0,3)\n"
        "space origin: (0,0,0)\nSegment0_ID:=a\nSegment0_Name:=skin\n"
        "Segment0_LabelValue:=1"
    )
    nrrd_file(tmp_path / "a.seg.nrrd", values, lines)
    volume = read_volume(tmp_path / "a.seg.nrrd")
    assert volume.kind == LABELS
    assert volume.segments == {1: "skin"}


@pytest.mark.parametrize(
    ("lines", "saying"),
    [
        ("space: LPS\nspace origin: (0,0,0)", "space directions"),
        ("space directions: (1,0,0) (0,1,0) (0,0,1)\nspace origin: (0,0,0)", "space"),
        ("space: LPS\nspace directions: (1,0,0) (0,1,0) (0,0,1)", "space origin"),
        (
            "space: LPS\nspace directions: (1,0,0) (0.5,1,0) (0,0,1)\n"
            "space origin: (0,0,0)",
            "right angles",
        ),
        (
            "space: LPS\nspace directions: (1,0,0) (0,1,0) (0,0,1)\n"
            "space origin: (0,0,0)\ndata file: other.raw",
            "another file",
        ),
    ],
)
def test_an_nrrd_without_a_place_is_refused(tmp_path, lines, saying):
    nrrd_file(tmp_path / "a.nrrd", block(), lines)
    with pytest.raises(BorecheckError, match=saying):
        read_volume(tmp_path / "a.nrrd")


@pytest.mark.parametrize(
    ("values", "saying"),
    [
        (np.full((8, 24, 32), 3000, np.int16), "neither Hounsfield"),
        (np.arange(8 * 24 * 32, dtype=np.int16).reshape(8, 24, 32), "neither"),
    ],
)
def test_numbers_that_are_neither_units_nor_labels_are_refused(
    tmp_path, values, saying
):
    nifti(tmp_path / "a.nii", values.transpose(2, 1, 0), np.diag([2.0, 2.0, 3.0, 1.0]))
    with pytest.raises(BorecheckError, match=saying):
        read_volume(tmp_path / "a.nii")


def test_a_file_that_ends_early_is_one_line(tmp_path):
    noise = np.random.default_rng(1).integers(-9, 9, block().shape, dtype=np.int16)
    nifti(tmp_path / "a.nii.gz", block() + noise, np.diag([2.0, 2.0, 3.0, 1.0]))
    whole = (tmp_path / "a.nii.gz").read_bytes()
    (tmp_path / "a.nii.gz").write_bytes(whole[: len(whole) // 2])
    with pytest.raises(BorecheckError, match="cut short"):
        read_volume(tmp_path / "a.nii.gz")


def test_without_the_extra_one_line_says_what_to_install(tmp_path, monkeypatch, capsys):
    import sys

    monkeypatch.setitem(sys.modules, "pydicom", None)
    folder = tmp_path / "s"
    folder.mkdir()
    (folder / "a.dcm").write_bytes(b"x")
    assert main(["patient", str(folder)]) == 2
    assert "pip install 'borecheck[ct]'" in capsys.readouterr().err
