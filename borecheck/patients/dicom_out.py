"""What was checked as DICOM objects beside the patient's series, for an archive.

Surfaces as Encapsulated STL, the verdict as Basic Text SR (DICOM PS3.3). Patient, study
and frame of reference are copied from an image of the series, so that a viewer shows
them in the same space. The objects name the patient: that is their use.
"""

import io
import re
import warnings
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from typing import Any

from borecheck.core.version import __version__
from borecheck.errors import InputError
from borecheck.patients.libraries import library

ENCAPSULATED_STL = "1.2.840.10008.5.1.4.1.1.104.3"
BASIC_TEXT_SR = "1.2.840.10008.5.1.4.1.1.88.11"

# A header is at the beginning; pixels behind it are not needed, [bytes].
_HEAD = 4_000_000

_PATIENT = ("PatientName", "PatientID", "PatientBirthDate", "PatientSex")
_STUDY = (
    *("StudyInstanceUID", "StudyDate", "StudyTime", "StudyID"),
    *("AccessionNumber", "ReferringPhysicianName"),
)
_FRAME = ("FrameOfReferenceUID", "PositionReferenceIndicator")
_NEEDED = ("StudyInstanceUID", "FrameOfReferenceUID")

_UID = re.compile(r"\d[\d.]{0,63}", re.ASCII)

_DATE, _TIME = "%Y%m%d", "%H%M%S"


@dataclass(frozen=True, eq=False)
class Reference:
    """An image of the series that the objects belong to.

    Attributes:
        tags: Patient, study and frame of reference, as pydicom has them.
    """

    tags: Any

    @property
    def frame(self) -> str:
        """UID of the frame of reference."""
        return str(self.tags.FrameOfReferenceUID)


def read_reference(file: Path) -> Reference:
    """Patient, study and frame of reference of a DICOM image.

    Raises:
        InputError: It is none, or has no study or frame of reference.
        UsageError: pydicom is not installed.
    """
    pydicom = library("pydicom")
    wanted = [*_PATIENT, *_STUDY, *_FRAME, "SpecificCharacterSet"]
    try:
        with file.open("rb") as opened:
            head = io.BytesIO(opened.read(_HEAD))
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # of what is odd about other tags
            tags = pydicom.dcmread(head, stop_before_pixels=True, specific_tags=wanted)
            lacking = [n for n in _NEEDED if not _UID.fullmatch(str(tags.get(n)))]
            str(tags)  # every value is read now, not when it is written
    except OSError as error:
        raise InputError(file, f"cannot be read: {error.strerror}") from error
    except Exception as error:  # pydicom raises what it meets
        raise InputError(file, f"is no DICOM image: {error}") from error
    if lacking:
        raise InputError(file, f"has no {' and no '.join(lacking)} to be put beside")
    return Reference(tags)


def encapsulated_stl(
    reference: Reference, stl: bytes, title: str, series: str, number: int
) -> bytes:
    """A surface as a DICOM file.

    Args:
        reference: Whose it is.
        stl: Binary STL in the patient's LPS coordinates, mm.
        title: What it is.
        series: UID of the series that the surfaces of one result make.
        number: Of the object in it.
    """
    made = _begun(reference, ENCAPSULATED_STL, "M3D", series, number)
    made.DocumentTitle = title[:1024]
    made.BurnedInAnnotation = "NO"
    made.MIMETypeOfEncapsulatedDocument = "model/stl"
    made.EncapsulatedDocumentLength = len(stl)
    made.EncapsulatedDocument = stl + b"\0" * (len(stl) % 2)
    made.ModelModification, made.ModelMirroring = "NO", "NO"
    made.ConceptNameCodeSequence = []
    made.MeasurementUnitsCodeSequence = [_code("mm", "UCUM", "millimeter")]
    return _written(made)


def text_report(
    reference: Reference, items: Sequence[tuple[str, str]], series: str
) -> bytes:
    """A structured text as a DICOM file.

    Args:
        reference: Whose it is.
        items: Heading and text of each entry.
        series: UID of its series.
    """
    made = _begun(reference, BASIC_TEXT_SR, "SR", series, 1)
    made.SpecificCharacterSet = "ISO_IR 192"
    made.CompletionFlag, made.VerificationFlag = "COMPLETE", "UNVERIFIED"
    made.PreliminaryFlag = "FINAL"
    made.ReferencedPerformedProcedureStepSequence = []
    made.PerformedProcedureCodeSequence = []
    made.ValueType, made.ContinuityOfContent = "CONTAINER", "SEPARATE"
    made.ConceptNameCodeSequence = [_heading("Contact check")]
    made.ContentSequence = list(_entries(items))
    return _written(made)


def new_uid() -> str:
    """A UID that nothing else has."""
    return str(library("pydicom.uid", "pydicom").generate_uid())


def _begun(
    reference: Reference, kind: str, modality: str, series: str, number: int
) -> Any:
    """A data set with patient, study, frame of reference, equipment and identity."""
    dataset = library("pydicom.dataset", "pydicom")
    uid = library("pydicom.uid", "pydicom")
    made = dataset.Dataset()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # odd dates and names are the series' own
        for name in (*_PATIENT, *_STUDY, *_FRAME, "SpecificCharacterSet"):
            found = reference.tags.get(name)
            if found is not None or name != "SpecificCharacterSet":
                setattr(made, name, "" if found is None else found)
    now = datetime.now()
    made.SOPClassUID, made.SOPInstanceUID = kind, new_uid()
    made.Modality, made.SeriesInstanceUID = modality, series
    made.SeriesNumber, made.InstanceNumber = None, number
    made.SeriesDescription = "borecheck"
    made.Manufacturer, made.ManufacturerModelName = "borecheck", "borecheck"
    made.DeviceSerialNumber, made.SoftwareVersions = "none", __version__
    made.ContentDate, made.ContentTime = now.strftime(_DATE), now.strftime(_TIME)
    made.AcquisitionDateTime = ""
    meta = dataset.FileMetaDataset()
    meta.MediaStorageSOPClassUID = kind
    meta.MediaStorageSOPInstanceUID = made.SOPInstanceUID
    meta.TransferSyntaxUID = uid.ExplicitVRLittleEndian
    made.file_meta = meta
    return made


def _entries(items: Iterable[tuple[str, str]]) -> Iterable[Any]:
    dataset = library("pydicom.dataset", "pydicom")
    for heading, text in items:
        entry = dataset.Dataset()
        entry.RelationshipType, entry.ValueType = "CONTAINS", "TEXT"
        entry.ConceptNameCodeSequence = [_heading(heading)]
        entry.TextValue = text
        yield entry


def _heading(meaning: str) -> Any:
    return _code(meaning.upper().replace(" ", "_")[:16], "99BORECHECK", meaning)


def _code(value: str, scheme: str, meaning: str) -> Any:
    code = library("pydicom.dataset", "pydicom").Dataset()
    code.CodeValue, code.CodingSchemeDesignator = value, scheme
    code.CodeMeaning = meaning
    return code


def _written(made: Any) -> bytes:
    out = io.BytesIO()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        made.save_as(out, enforce_file_format=True)
    return out.getvalue()
