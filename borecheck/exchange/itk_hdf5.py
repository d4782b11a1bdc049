"""Transforms that ITK wrote as HDF5; read with h5py, where it is installed."""

import io
from typing import Any

import numpy as np

from borecheck.errors import InputError

# Of a rigid transform; what a file claims beyond is not read.
_MOST_NUMBERS = 16
_MOST_PARTS = 20

# ITK before 4.6 misspelt two of the names; its files are still about.
_PARAMETERS = ("TransformParameters", "TranformParameters")
_FIXED = ("TransformFixedParameters", "TranformFixedParameters")


def hdf5_parts(content: bytes, file: str) -> list[tuple[str, list[float], list[float]]]:
    """Type, parameters and fixed parameters of each transform in a file.

    Raises:
        InputError: h5py is not installed, or the file holds no such thing.
    """
    try:
        import h5py
    except ImportError as error:
        raise InputError(
            file, "an .h5 transform needs h5py (pip install h5py), or save it as .tfm"
        ) from error
    try:
        with h5py.File(io.BytesIO(content), "r") as opened:
            group = opened["TransformGroup"]
            names = sorted((name for name in group if name.isdecimal()), key=int)
            if len(names) > _MOST_PARTS:
                raise InputError(file, f"holds {len(names)} transforms")
            return [_part(group[name], file) for name in names]
    except (OSError, KeyError, ValueError, RuntimeError, TypeError) as error:
        raise InputError(file, f"is no transform in HDF5: {error}") from error


def _part(group: Any, file: str) -> tuple[str, list[float], list[float]]:
    kind = np.asarray(group["TransformType"]).reshape(-1)
    if kind.size != 1:
        raise InputError(file, "TransformType is no single word")
    word = kind[0].decode("ascii", "replace") if isinstance(kind[0], bytes) else ""
    return word, _numbers(group, _PARAMETERS, file), _numbers(group, _FIXED, file)


def _numbers(group: Any, names: tuple[str, ...], file: str) -> list[float]:
    found = next((group[name] for name in names if name in group), None)
    if found is None:
        return []
    if found.size > _MOST_NUMBERS:
        raise InputError(file, f"{names[0]} holds {found.size} numbers: no rigid one")
    values = np.asarray(found, dtype=np.float64).reshape(-1)
    if not np.isfinite(values).all():
        raise InputError(file, f"{names[0]} holds a number that is not finite")
    return [float(value) for value in values]
