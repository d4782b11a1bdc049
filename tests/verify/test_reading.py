"""Files of certificates and meshes: what is read, and what is refused before it is."""

import io
import json
import zipfile
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from borecheck.verify import reading
from borecheck.verify.fields import Rejected
from borecheck.verify.reading import (
    Missing,
    _of_archive,
    mesh_hash,
    read_document,
    read_meshes,
)

Array = NDArray[np.float64]

VERTICES = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])
TRIANGLES = np.array([[0, 1, 2], [0, 2, 3]])


def packed(**arrays: Any) -> bytes:
    stream = io.BytesIO()
    np.savez_compressed(stream, **arrays)
    return stream.getvalue()


def unpacked(data: bytes) -> Any:
    with zipfile.ZipFile(io.BytesIO(data)) as archive:
        return _of_archive(archive)


def good(**more: Any) -> dict[str, Any]:
    return {"a.vertices": VERTICES, "a.triangles": TRIANGLES, **more}


def test_meshes_come_back_as_they_were(tmp_path: Path) -> None:
    file = tmp_path / "m.npz"
    other = {"b.vertices": VERTICES + 1.0, "b.triangles": TRIANGLES[:1]}
    file.write_bytes(packed(**good(**other)))
    found = read_meshes(file)
    assert len(found) == 2
    for vertices, triangles in ((VERTICES, TRIANGLES), (VERTICES + 1.0, TRIANGLES[:1])):
        back = found[mesh_hash(vertices, triangles)]
        assert np.array_equal(back[0], vertices)
        assert np.array_equal(back[1], triangles)


@pytest.mark.parametrize(
    "arrays",
    [
        {"a.vertices": VERTICES},
        {"a.triangles": TRIANGLES},
        good(note=VERTICES),
        {"a.vertices": VERTICES, "b.triangles": TRIANGLES},
        good(**{"a.vertices": VERTICES.astype(np.float32)}),
        good(**{"a.vertices": VERTICES.astype(">f8")}),
        good(**{"a.triangles": TRIANGLES.astype(np.int32)}),
        good(**{"a.triangles": TRIANGLES.astype(np.float64)}),
        good(**{"a.vertices": np.asfortranarray(VERTICES)}),
        good(**{"a.vertices": VERTICES[:, :2]}),
        good(**{"a.vertices": VERTICES.reshape(-1)}),
        good(**{"a.vertices": VERTICES[None]}),
        good(**{"a.triangles": TRIANGLES[:0]}),
        good(**{"a.triangles": TRIANGLES + 2}),
        good(**{"a.triangles": TRIANGLES - 1}),
        good(**{"a.vertices": VERTICES + np.nan}),
        good(**{"a.vertices": VERTICES + np.inf}),
        good(**{"a.vertices": VERTICES * 1e3 * (1 + 1e-12)}),
    ],
    ids=range(18),
)
def test_what_is_no_mesh_is_refused(arrays: dict[str, Any]) -> None:
    with pytest.raises(Rejected):
        unpacked(packed(**arrays))


def test_a_mesh_as_large_as_may_be_is_read() -> None:
    assert len(unpacked(packed(**good(**{"a.vertices": VERTICES * 1e3})))) == 1
    last = np.array([[1, 2, 3]])
    assert len(unpacked(packed(**good(**{"a.triangles": last})))) == 1


def test_an_array_of_another_length_than_it_says_is_refused() -> None:
    stream = io.BytesIO()
    np.save(stream, VERTICES)
    for data in (stream.getvalue()[:-8], stream.getvalue() + b"\0" * 24):
        out = io.BytesIO()
        with zipfile.ZipFile(out, "w") as archive:
            archive.writestr("a.vertices.npy", data)
            triangles = io.BytesIO()
            np.save(triangles, TRIANGLES)
            archive.writestr("a.triangles.npy", triangles.getvalue())
        with pytest.raises(Rejected, match="cut off"):
            unpacked(out.getvalue())


def test_a_name_given_twice_is_refused() -> None:
    out = io.BytesIO()
    with zipfile.ZipFile(out, "w") as archive:
        for name in ("a.vertices.npy", "a.triangles.npy", "a.triangles.npy"):
            stream = io.BytesIO()
            np.save(stream, VERTICES if "v" in name else TRIANGLES)
            if archive.namelist()[-1:] == [name]:
                archive.filelist.append(archive.getinfo(name))
            else:
                archive.writestr(name, stream.getvalue())
    with pytest.raises(Rejected, match="twice"):
        unpacked(out.getvalue())


def test_what_is_packed_closer_than_a_mesh_is_refused() -> None:
    """200 to 1 and 1,000 bytes: on both sides, as the zip's own table tells it."""
    seen = []
    for rows in range(900, 1300, 9):
        data = packed(**good(**{"a.vertices": np.zeros((rows, 3))}))
        with zipfile.ZipFile(io.BytesIO(data)) as archive:
            close = any(
                entry.file_size > 200 * entry.compress_size + 1_000
                for entry in archive.infolist()
            )
        if close:
            with pytest.raises(Rejected, match="unpacks to more"):
                unpacked(data)
        else:
            assert len(unpacked(data)) == 1
        seen.append(close)
    assert 5 < sum(seen) < len(seen) - 5


def test_far_too_much_is_refused_whatever_it_is_packed_to() -> None:
    """A table that claims 600 MB in all, each entry not packed too closely."""
    with zipfile.ZipFile(io.BytesIO(packed(**good()))) as archive:
        for entry in archive.filelist:
            entry.file_size, entry.compress_size = 300 << 20, 300 << 20
        with pytest.raises(Rejected, match="unpacks to more"):
            _of_archive(archive)


def test_as_much_as_may_be_is_read(monkeypatch: pytest.MonkeyPatch) -> None:
    with zipfile.ZipFile(io.BytesIO(packed(**good()))) as archive:
        total = sum(entry.file_size for entry in archive.filelist)
        monkeypatch.setattr(reading, "MOST_PACKED", total)
        assert len(_of_archive(archive)) == 1
        monkeypatch.setattr(reading, "MOST_PACKED", total - 1)
        with pytest.raises(Rejected, match="unpacks to more"):
            _of_archive(archive)


def test_no_more_arrays_than_twenty_thousand_are_read() -> None:
    """Told by the archive's table, before anything is unpacked."""
    with zipfile.ZipFile(io.BytesIO(packed(**good()))) as archive:
        for count, words in ((20_000, "unpacks to more|something"), (20_001, "many")):
            archive.filelist = [zipfile.ZipInfo(f"{k}.note.npy") for k in range(count)]
            with pytest.raises(Rejected, match=words):
                _of_archive(archive)


@pytest.mark.parametrize(
    ("vertices", "triangles", "words"),
    [
        (VERTICES, TRIANGLES[:, :2], "no triangles of three corners"),
        (VERTICES, np.array([[0, 1, 2, 3]]), "no triangles of three corners"),
        (VERTICES, TRIANGLES[:0], "no triangles of three corners"),
        (VERTICES, TRIANGLES[0], "no vertices or triangles of three"),
        (VERTICES[:, :2], TRIANGLES, "no vertices or triangles of three"),
        (VERTICES[0], TRIANGLES, "no vertices or triangles of three"),
        (VERTICES.astype(str), TRIANGLES, "not made of numbers"),
        (VERTICES, TRIANGLES.astype(float), "not made of numbers"),
        (VERTICES * -1e3 * (1 + 1e-12), TRIANGLES, "not within 1000 m"),
        (VERTICES + np.nan, TRIANGLES, "not within 1000 m"),
        (VERTICES, TRIANGLES + 1, "corner is no vertex"),
        (VERTICES, TRIANGLES + 2, "corner is no vertex"),
        (VERTICES, TRIANGLES - 1, "corner is no vertex"),
        (VERTICES.astype(int), TRIANGLES.astype(np.uint8), ""),
        (VERTICES * -1e3, TRIANGLES, ""),
    ],
)
def test_arrays_that_are_given(vertices: Any, triangles: Any, words: str) -> None:
    if words:
        with pytest.raises(Rejected, match=words):
            read_meshes([(vertices, triangles)])
        return
    ((points, corners),) = read_meshes({"any": (vertices, triangles)}).values()
    assert (points.dtype, corners.dtype) == (np.float64, np.int64)
    np.testing.assert_array_equal(points, vertices)
    np.testing.assert_array_equal(corners, triangles)


def test_hashes_cover_type_shape_and_data() -> None:
    hashes = {
        mesh_hash(VERTICES, TRIANGLES),
        mesh_hash(VERTICES[:3], TRIANGLES[:1]),
        mesh_hash(VERTICES, TRIANGLES[::-1]),
        mesh_hash(VERTICES + 1e-16, TRIANGLES),
        mesh_hash(VERTICES[:, [1, 0, 2]], TRIANGLES),
    }
    assert len(hashes) == 5
    assert mesh_hash(np.asfortranarray(VERTICES), TRIANGLES) in hashes
    # a triangle moved from one array to the other keeps the bytes and not the hash
    bits = TRIANGLES.view(np.float64)
    moved = mesh_hash(np.concatenate([VERTICES, bits[:1]]), TRIANGLES[1:])
    assert moved not in hashes


@pytest.mark.parametrize(
    ("text", "good"),
    [
        ('{"a": 1}', True),
        ('{"a": 1, "a": 1}', False),
        ('{"b": {"a": 1, "a": 2}}', False),
        ('{"a": NaN}', False),
        ('{"a": -Infinity}', False),
        ("[1]", False),
        ('"a"', False),
        ("", False),
        ("{", False),
        ("[" * 100_000, False),
    ],
)
def test_documents(tmp_path: Path, text: str, good: bool) -> None:
    file = tmp_path / "c.json"
    file.write_text(text)
    if good:
        assert read_document(file) == json.loads(text)
        return
    with pytest.raises(Rejected, match="not a certificate"):
        read_document(file)


def test_what_is_no_text_or_no_file_is_refused(tmp_path: Path) -> None:
    file = tmp_path / "c.json"
    file.write_bytes(b'{"a": "\xff"}')
    with pytest.raises(Rejected, match="no text"):
        read_document(file)
    for missing in (tmp_path, tmp_path / "none.json", Path("a\0b")):
        with pytest.raises(Rejected):
            read_document(missing)


def test_a_folder_is_no_ordinary_file(tmp_path: Path) -> None:
    with pytest.raises(Missing, match="is no ordinary file"):
        read_document(tmp_path)


def test_rows_of_two_numbers_are_no_points_though_there_are_none() -> None:
    with pytest.raises(Rejected, match="another type or shape"):
        unpacked(packed(**good(**{"a.vertices": np.zeros((0, 2))})))


def test_content_is_copied() -> None:
    given = {"a": [1, 2]}
    found = read_document(given)
    given["a"].append(3)
    assert found == {"a": [1, 2]}
