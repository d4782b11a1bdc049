"""Small scans, written as scanners write them, for tests."""

import numpy as np
from pydicom.dataset import Dataset, FileMetaDataset
from pydicom.uid import CTImageStorage, ExplicitVRLittleEndian, generate_uid

AXIAL = (1.0, 0.0, 0.0, 0.0, 1.0, 0.0)
SERIES, FRAME = "2.25.11", "2.25.12"


def block(slices=8, rows=24, columns=32, size=9):
    """Hounsfield units of a block of water in air, (slices, rows, columns)."""
    values = np.full((slices, rows, columns), -1000, dtype=np.int16)
    middle = rows // 2, columns // 2
    values[
        :, middle[0] - size : middle[0] + size, middle[1] - size : middle[1] + size
    ] = 40
    return values


def straight(slices, step=(0.0, 0.0, 3.0), first=(-40.0, -30.0, -100.0)):
    """Positions of a stack."""
    return np.array(first) + np.outer(np.arange(slices), step)


def dataset(values, position, orientation=AXIAL, spacing=(2.0, 2.5), **tags):
    """One slice; a tag given as None is left out."""
    image = Dataset()
    image.file_meta = FileMetaDataset()
    image.file_meta.TransferSyntaxUID = ExplicitVRLittleEndian
    image.file_meta.MediaStorageSOPClassUID = CTImageStorage
    instance = f"2.25.{abs(hash(tuple(np.round(position, 6)))) % 10**12}"
    image.file_meta.MediaStorageSOPInstanceUID = instance
    usual = {
        **{"SOPClassUID": CTImageStorage, "SOPInstanceUID": instance},
        **{"SeriesInstanceUID": SERIES, "FrameOfReferenceUID": FRAME},
        **{"Modality": "CT", "ImageType": ["ORIGINAL", "PRIMARY", "AXIAL"]},
        **{"PatientName": "Doe^Jane", "PatientPosition": "HFS"},
        "ImagePositionPatient": [f"{x:.6f}" for x in position],
        "ImageOrientationPatient": [f"{x:.9f}" for x in orientation],
        "PixelSpacing": [str(x) for x in spacing],
        **{"SamplesPerPixel": 1, "PhotometricInterpretation": "MONOCHROME2"},
        **{"Rows": values.shape[0], "Columns": values.shape[1]},
        **{"BitsAllocated": 16, "BitsStored": 16, "HighBit": 15},
        **{"PixelRepresentation": 1, "RescaleSlope": "1", "RescaleIntercept": "0"},
    }
    for name, value in {**usual, **tags}.items():
        if value is not None:
            setattr(image, name, value)
    image.PixelData = values.astype("<i2").tobytes()
    return image


def write_series(folder, values, positions, *, names=None, **tags):
    """A folder of slices; more tags as keywords."""
    folder.mkdir(parents=True, exist_ok=True)
    for k, (plane, position) in enumerate(zip(values, positions, strict=True)):
        name = f"{k:03d}.dcm" if names is None else names[k]
        image = dataset(plane, position, **tags)
        image.save_as(folder / name, enforce_file_format=True)
    return folder


def another_uid():
    """A UID that no other image has."""
    return generate_uid()
