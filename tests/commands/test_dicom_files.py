"""A result as DICOM: by pydicom, in the series' own space, bit for bit."""

import hashlib
import io
import struct

import numpy as np
import pydicom
import pytest
from pydicom.dataset import Dataset, FileMetaDataset
from pydicom.uid import CTImageStorage, ExplicitVRLittleEndian, generate_uid

from borecheck.cli import main
from borecheck.geometry.mesh_files.reading import read_mesh_file
from borecheck.patients.dicom_out import encapsulated_stl, new_uid, read_reference

CHECK = [
    *["check", "arm.urdf", "gantry.stl:mm", "--base", "0.55,0,-0.35,0,0,180deg"],
    *["--patient", "torso.stl:mm@0,0,-0.1", "--samples", "3"],
    *["--needle", "needle_link", "--tip", "needle_tip:z", "--plan", "line.mrk.json"],
    *["--isocentre", "12mm,-40mm,-750mm", "--position", "HFS"],
]


def image(**changes):
    """One image of a series, without pixels."""
    made = Dataset()
    made.SOPClassUID, made.SOPInstanceUID = CTImageStorage, generate_uid()
    made.PatientName, made.PatientID = "Doe^Jane", "17"
    made.PatientBirthDate, made.PatientSex = "19700101", "F"
    made.StudyInstanceUID, made.SeriesInstanceUID = generate_uid(), generate_uid()
    made.FrameOfReferenceUID, made.Modality = generate_uid(), "CT"
    for name, value in changes.items():
        setattr(made, name, value)
    made.file_meta = FileMetaDataset()
    made.file_meta.TransferSyntaxUID = ExplicitVRLittleEndian
    made.file_meta.MediaStorageSOPClassUID = CTImageStorage
    made.file_meta.MediaStorageSOPInstanceUID = made.SOPInstanceUID
    return made


def saved(file, dataset):
    dataset.save_as(file, enforce_file_format=True)
    return file


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Examples, an image, and a result written beside it."""
    made = tmp_path_factory.mktemp("dicom") / "files"
    assert main(["examples", str(made)]) == 0
    saved(made / "slice.dcm", image())
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(made)
        words = ["--certificate", "plan.json", "--dicom", "out"]
        assert main([*CHECK, *words, "--dicom-from", "slice.dcm"]) == 0
    return made


def test_surfaces_are_in_the_space_of_the_series(folder, tmp_path):
    reference = pydicom.dcmread(folder / "slice.dcm")
    names = {file.name for file in (folder / "out").iterdir()}
    solids = {"patient_torso.dcm", "other_gantry.dcm", "robot_straight.dcm"}
    assert names == {*solids, "plan_1.dcm", "verdict.dcm"}
    for name in solids | {"plan_1.dcm"}:
        found = pydicom.dcmread(folder / "out" / name)
        for tag in ("FrameOfReferenceUID", "StudyInstanceUID", "PatientID"):
            assert found[tag].value == reference[tag].value
        assert found.SOPClassUID.name == "Encapsulated STL Storage"
        (unit,) = found.MeasurementUnitsCodeSequence
        assert (unit.CodeValue, unit.CodingSchemeDesignator) == ("mm", "UCUM")
        content = found.EncapsulatedDocument[: found.EncapsulatedDocumentLength]
        (tmp_path / "s.stl").write_bytes(content)
        read = read_mesh_file(tmp_path / "s.stl", 1e-3)
        assert read.frame == "lps"
        if name == "plan_1.dcm":  # from entry to target, 1 mm thick
            low, high = read.mesh.bounds
            np.testing.assert_allclose(low[1], -0.040, atol=1e-6)
            np.testing.assert_allclose(high[1], 0.020, atol=1e-6)
            middle = (low + high)[[0, 2]] / 2
            np.testing.assert_allclose(middle, [0.012, -0.75], atol=1e-6)


def test_the_text_says_the_verdict_and_the_certificates_hash(folder):
    found = pydicom.dcmread(folder / "out" / "verdict.dcm")
    assert found.SOPClassUID.name == "Basic Text SR Storage"
    said = {
        item.ConceptNameCodeSequence[0].CodeMeaning: item.TextValue
        for item in found.ContentSequence
    }
    assert said["Verdict"].startswith("clear: ")
    hashed = hashlib.sha256((folder / "plan.json").read_bytes()).hexdigest()
    assert hashed in said["Certificate"]
    assert found.VerificationFlag == "UNVERIFIED"  # no person has signed it


def test_stl_comes_back_bit_for_bit(folder):
    reference = read_reference(folder / "slice.dcm")
    for count in (0, 1, 2):  # of 50 bytes each: even and odd sizes
        stl = (
            b"x" * 80
            + struct.pack("<I", count)
            + bytes(range(50)) * count
            + b"!" * (count % 2)
        )
        made = encapsulated_stl(reference, stl, "t", new_uid(), 1)
        found = pydicom.dcmread(io.BytesIO(made))
        assert found.EncapsulatedDocument[: found.EncapsulatedDocumentLength] == stl
        assert len(found.EncapsulatedDocument) % 2 == 0


def refused(folder, monkeypatch, capsys, *words):
    monkeypatch.chdir(folder)
    capsys.readouterr()
    assert main([*CHECK, *map(str, words)]) == 2
    out, err = capsys.readouterr()
    assert (out, err.count("\n")) == ("", 1)
    return err


def test_what_is_no_image_is_told_in_a_line(folder, tmp_path, monkeypatch, capsys):
    bare = saved(tmp_path / "bare.dcm", image(FrameOfReferenceUID=""))
    cut = tmp_path / "cut.dcm"
    cut.write_bytes((folder / "slice.dcm").read_bytes()[:200])
    for file, said in (
        (bare, "FrameOfReferenceUID"),
        (cut, "cut.dcm"),
        (folder / "arm.urdf", "no DICOM image"),
        (folder / "nowhere.dcm", "cannot be read"),
    ):
        words = ["--dicom", tmp_path / "new", "--dicom-from", file]
        assert said in refused(folder, monkeypatch, capsys, *words)
    assert not (tmp_path / "new").exists()
    err = refused(folder, monkeypatch, capsys, "--dicom", tmp_path / "new")
    assert "go together" in err
    words = ["--dicom", folder / "out", "--dicom-from", folder / "slice.dcm"]
    assert "no empty folder" in refused(folder, monkeypatch, capsys, *words)
