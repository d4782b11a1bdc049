"""Files that are no certificate, or hold one that is damaged: text and archive."""

import io
import json
import zipfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from borecheck.motion.certificate import write_certificate
from studies.forged_certificates.problems import Case


def damaged(rng: np.random.Generator, case: Case, folder: Path) -> Iterator[str]:
    """Writes one damaged pair after the other as `c.json` and `c.npz`; yields what."""
    file = folder / "c.json"
    write_certificate(file, case.document, case.problem)
    text, packed = file.read_bytes(), file.with_suffix(".npz").read_bytes()
    for name, content in _texts(rng, text):
        file.write_bytes(content)
        file.with_suffix(".npz").write_bytes(packed)
        yield f"text: {name}"
    file.write_bytes(text)
    for name, content in _archives(rng, packed):
        file.with_suffix(".npz").write_bytes(content)
        yield f"meshes: {name}"
    file.with_suffix(".npz").unlink()
    yield "meshes: none"


def _texts(rng: np.random.Generator, text: bytes) -> Iterator[tuple[str, bytes]]:
    for k in range(12):
        yield "cut off", text[: int(rng.integers(len(text)))]
        place = int(rng.integers(len(text)))
        yield (
            "a bit",
            text[:place] + bytes([text[place] ^ (1 << k % 8)]) + text[place + 1 :],
        )
        yield "a digit", _other_digit(rng, text)
    yield "empty", b""
    yield "nothing but zeros", bytes(1000)
    yield "deep", b"[" * 100_000
    yield "deep record", b'{"a":' * 50_000 + b"1" + b"}" * 50_000
    yield "a list", b"[" + text + b"]"
    yield "twice", text + text
    yield "no text", b"\xff\xfe" + text
    yield "a mark first", b"\xef\xbb\xbf" + text
    yield "a key twice", text.replace(b'"margin_m"', b'"part_count": 1, "margin_m"', 1)
    yield "another format", text.replace(b"path certificate", b"certificate", 1)
    for word in (
        b"NaN",
        b"Infinity",
        b"-Infinity",
        b"1e999",
        b"1e30",
        b"true",
        b"null",
    ):
        yield f"part_count {word.decode()}", _with_field(text, b'"part_count": ', word)
        yield f"margin {word.decode()}", _with_field(text, b'"margin_m": ', word)
        yield f"moving {word.decode()}", _with_field(text, b'"moving": ', word)
    yield "a long number", _with_field(text, b'"margin_m": ', b"9" * 10_000)


def _other_digit(rng: np.random.Generator, text: bytes) -> bytes:
    digits = [k for k, c in enumerate(text) if chr(c).isdigit()]
    k = digits[int(rng.integers(len(digits)))]
    other = (text[k] - 48 + int(rng.integers(1, 10))) % 10
    return text[:k] + bytes([48 + other]) + text[k + 1 :]


def _with_field(text: bytes, name: bytes, value: bytes) -> bytes:
    before, _, after = text.partition(name)
    end = min(k for k, c in enumerate(after) if c in b",\n}")
    return before + name + value + after[end:]


def _archives(rng: np.random.Generator, packed: bytes) -> Iterator[tuple[str, bytes]]:
    for k in range(12):
        yield "cut off", packed[: int(rng.integers(len(packed)))]
        place = int(rng.integers(len(packed)))
        changed = bytes([packed[place] ^ (1 << k % 8)])
        yield "a bit", packed[:place] + changed + packed[place + 1 :]
    with np.load(io.BytesIO(packed)) as stored:
        arrays = {name: stored[name] for name in stored.files}
    one = next(name for name in arrays if name.endswith("triangles"))
    points = one.replace("triangles", "vertices")
    yield "empty", b""
    yield "an array missing", _packed({k: v for k, v in arrays.items() if k != one})
    yield (
        "a mesh missing",
        _packed({k: v for k, v in arrays.items() if k not in (one, points)}),
    )
    shift = np.concatenate([arrays[points], arrays[one][:1].view(np.float64)])
    yield (
        "a row moved, the bytes the same",
        _packed({**arrays, one: arrays[one][1:], points: shift}),
    )
    for name, values in _wrong_arrays(arrays[points], arrays[one]):
        yield name, _packed({**arrays, (points if "vert" in name else one): values})
    huge = io.BytesIO()
    np.lib.format.write_array_header_1_0(
        huge, {"descr": "<f8", "fortran_order": False, "shape": (10**12, 3)}
    )
    yield "a header of terabytes", _zipped({f"{points}.npy": huge.getvalue()})
    yield "a bomb", _zipped({f"{points}.npy": huge.getvalue() + bytes(1 << 28)})
    yield "something else beside", _zipped({"../../x": b"x"}, packed)


def _wrong_arrays(points: Any, corners: Any) -> Iterator[tuple[str, Any]]:
    yield "vertices thinned", points[:-1]
    yield "vertices in float32", points.astype(np.float32)
    yield "vertices in big-endian", points.astype(">f8")
    yield "vertices by columns", np.asfortranarray(points)
    yield "vertices not finite", np.where(points > 0, np.nan, points)
    yield "vertices as objects", points.astype(object)
    yield "vertices flat", points.reshape(-1)
    yield "vertices moved", points + 1e-12
    yield "triangles thinned", corners[:-1]
    yield "triangles none", corners[:0]
    yield "triangles beyond", corners + 10**6
    yield "triangles negative", corners - 1
    yield "triangles in int32", corners.astype(np.int32)
    yield "triangles as numbers", corners.astype(float)
    yield "triangles the other way", corners[:, ::-1]


def _packed(arrays: dict[str, Any]) -> bytes:
    stream = io.BytesIO()
    np.savez_compressed(stream, **arrays)
    return stream.getvalue()


def _zipped(entries: dict[str, bytes], before: bytes = b"") -> bytes:
    stream = io.BytesIO(before)
    with zipfile.ZipFile(stream, "a", zipfile.ZIP_DEFLATED) as archive:
        for name, data in entries.items():
            archive.writestr(name, data)
    return stream.getvalue()


def is_same(first: bytes, second: bytes) -> bool:
    """Whether two texts are the same record, written otherwise."""
    try:
        return bool(json.loads(first) == json.loads(second))
    except ValueError:
        return False
