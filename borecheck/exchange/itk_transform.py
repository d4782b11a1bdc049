"""Rigid transforms in files of ITK: `.tfm` and `.txt` (text), `.h5` (HDF5).

The file's sense is ITK's: it maps a point of the fixed space (what Slicer calls the
parent) to the moving space (the node), y = R (x - c) + c + t, in LPS and mm. A patient
that is *moved* by such a transform is moved by its inverse. Only rigid transforms are
read: an obstacle or a needle that is scaled, sheared or mirrored is another one.
"""

from collections.abc import Callable
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from borecheck.core.small_files import read_at_most
from borecheck.core.units import PLAIN_NUMBER
from borecheck.errors import InputError

Array = NDArray[np.float64]

SUFFIXES = (".tfm", ".txt", ".h5", ".hdf5")
MAX_BYTES = 1_000_000  # a rigid transform is below 1 kB, in HDF5 below 20 kB
HEAD = "#Insight Transform File"

# ITK writes 17 digits; files by hand have six or more.
RIGID_TOLERANCE = 1e-5

_HDF5_START = b"\x89HDF\r\n\x1a\n"


def read_transform(path: str | Path) -> Array:
    """T with y = T x, fixed to moving, (4, 4), LPS, translation in [m].

    Raises:
        InputError: It cannot be read, or is no rigid transform.
    """
    content = read_at_most(Path(path), MAX_BYTES)
    if content.startswith(_HDF5_START):
        from borecheck.exchange.itk_hdf5 import hdf5_parts

        parts = hdf5_parts(content, str(path))
    else:
        parts = _text_parts(content, str(path))
    T = _joined(parts, str(path))
    T[:3, 3] *= 1e-3
    return T


def transform_text(T: Array) -> str:
    """A rigid transform as the text of a `.tfm`, fixed to moving, LPS.

    Args:
        T: (4, 4), translation in [m].
    """
    numbers = [*T[:3, :3].reshape(-1), *(1e3 * T[:3, 3])]
    return (
        f"{HEAD} V1.0\n#Transform 0\nTransform: AffineTransform_double_3_3\n"
        f"Parameters: {' '.join(repr(float(x)) for x in numbers)}\n"
        "FixedParameters: 0 0 0\n"
    )


Part = tuple[str, list[float], list[float]]  # type, parameters, fixed parameters


def _text_parts(content: bytes, file: str) -> list[Part]:
    text = content.decode("utf-8-sig", "replace")
    if not text.startswith(HEAD):
        raise InputError(file, f"is no transform: it does not begin with {HEAD!r}")
    parts: list[Part] = []
    for number, line in enumerate(text.splitlines(), 1):
        word, colon, rest = line.partition(":")
        where = f"line {number}"
        if not line.strip() or line.startswith("#"):
            continue
        if colon and word == "Transform":
            parts.append((rest.strip(), [], []))
        elif colon and parts and word in ("Parameters", "FixedParameters"):
            _, given, fixed = parts[-1]
            kept = given if word == "Parameters" else fixed
            if kept:
                raise InputError(file, f"{word} stand twice", where)
            kept += _numbers(rest, file, where)
        else:
            raise InputError(file, "is no line of a transform", where)
    return parts


def _numbers(text: str, file: str, where: str) -> list[float]:
    words = text.split()
    for word in words:
        if PLAIN_NUMBER.fullmatch(word) is None or not abs(float(word)) < 1e9:
            raise InputError(file, f"{word[:40]!r} is no finite number", where)
    return [float(word) for word in words]


def _joined(parts: list[Part], file: str) -> Array:
    """All parts as one; in a composite the last is applied first, as ITK has it."""
    if not parts:
        raise InputError(file, "holds no transform")
    composite = parts[0][0].startswith("CompositeTransform")
    simple = parts[1:] if composite else parts
    if not composite and len(simple) > 1:
        raise InputError(
            file, f"holds {len(simple)} transforms that nothing joins: give one"
        )
    if not simple:
        raise InputError(file, "holds no transform")
    T = np.eye(4)
    for part in simple:
        T = T @ _matrix(part, file)
    return T


def _matrix(part: Part, file: str) -> Array:
    """One transform as a matrix, mm."""
    written, given, fixed = part
    kind = written.partition("_")[0]
    if kind not in _KINDS:
        known = ", ".join(_KINDS)
        raise InputError(file, f"{written[:60]!r} is no rigid transform of {known}")
    count, rotation = _KINDS[kind]
    if len(given) != count:
        raise InputError(file, f"{kind} has {len(given)} parameters, not {count}")
    if len(fixed) not in (0, 3, 4) or (len(fixed) == 4 and kind != "Euler3DTransform"):
        raise InputError(file, f"{kind} has {len(fixed)} fixed parameters, not 3")
    R = rotation(given, bool(fixed[3:] and fixed[3]))
    off = max(np.abs(R @ R.T - np.eye(3)).max(), abs(np.linalg.det(R) - 1.0))
    if not off <= RIGID_TOLERANCE:
        raise InputError(
            file, f"is not rigid (by {off:.2g}): it scales, shears or mirrors"
        )
    # to the nearest rotation: what is left is digits that the file does not have
    u, _, v = np.linalg.svd(R)
    R = u @ v
    centre = np.array(fixed[:3] or [0.0, 0.0, 0.0])
    shift = np.array(given[-3:]) if count >= 3 and kind not in _NO_SHIFT else 0.0
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = R, centre + shift - R @ centre
    return T


def _from_rows(given: list[float], _: bool) -> Array:
    return np.reshape(given[:9], (3, 3))


def _from_versor(given: list[float], _: bool) -> Array:
    """The vector part of a unit quaternion; the scalar part is not negative."""
    xyz = np.array(given[:3])
    square = float(xyz @ xyz)
    return _from_quaternion([*given[:3], float(np.sqrt(max(0.0, 1.0 - square)))], _)


def _from_quaternion(given: list[float], _: bool) -> Array:
    x, y, z, w = given[:4]
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    # of a quaternion that is not of unit length this is no rotation, and refused
    return np.eye(3) + 2.0 * w * cross + 2.0 * cross @ cross


def _from_angles(given: list[float], z_y_x: bool) -> Array:
    """Turns about x, y and z; applied y, x, z unless the file says x, y, z."""
    X, Y, Z = (_turn(axis, angle) for axis, angle in enumerate(given[:3]))
    return Z @ Y @ X if z_y_x else Z @ X @ Y


def _turn(axis: int, angle: float) -> Array:
    c, s = np.cos(angle), np.sin(angle)
    i, j = (axis + 1) % 3, (axis + 2) % 3
    R = np.eye(3)
    R[i, i], R[j, j], R[i, j], R[j, i] = c, c, -s, s
    return R


def _same(_: list[float], __: bool) -> Array:
    return np.eye(3)


_KINDS: dict[str, tuple[int, Callable[[list[float], bool], Array]]] = {
    "AffineTransform": (12, _from_rows),
    "MatrixOffsetTransformBase": (12, _from_rows),
    "Rigid3DTransform": (12, _from_rows),
    "VersorRigid3DTransform": (6, _from_versor),
    "QuaternionRigidTransform": (7, _from_quaternion),
    "Euler3DTransform": (6, _from_angles),
    "TranslationTransform": (3, _same),
    "VersorTransform": (3, _from_versor),
    "IdentityTransform": (0, _same),
}
_NO_SHIFT = ("VersorTransform", "IdentityTransform")
