"""What a file that should be a mesh really is: said in one line, or nothing."""

_SAID_BY_FIRST_BYTES: tuple[tuple[bytes, str], ...] = (
    (b"version https://git-lfs", "a Git LFS pointer, not the mesh: run `git lfs pull`"),
    (b"<!doctype html", "an HTML page, not a mesh: was a download refused?"),
    (b"<html", "an HTML page, not a mesh: was a download refused?"),
    (b"pk\x03\x04", "a ZIP archive, not a mesh: unpack it first"),
    (b"\x1f\x8b", "gzip-compressed: unpack it first"),
    (b"off\n", "an OFF file under another name"),
    (b"gltf", "a binary glTF file under another name"),
    (b"iso-10303-21", "a STEP file: export a triangle mesh from it first"),
    (b"# vtk datafile", "a VTK file: export a triangle mesh from it first"),
)
_TEXT = frozenset(b"\t\n\r" + bytes(range(32, 127)))
_START = 512  # enough for every signature, and never a scan of a whole large file


def diagnose(data: bytes, suffix: str) -> str | None:
    """What these bytes are instead of the mesh its suffix names, or None if unknown."""
    if suffix != ".dae" and _is_utf16(data[:_START]):
        return "text in UTF-16, not in ASCII or UTF-8: save it again as plain text"
    start = data[:_START].lstrip(b"\xef\xbb\xbf \t\r\n").lower()
    for signature, meaning in _SAID_BY_FIRST_BYTES:
        if start.startswith(signature):
            return meaning
    if start.startswith((b"ply\n", b"ply\r")) and suffix != ".ply":
        return "a PLY file under another name"
    if start.startswith(b"<") and b"collada" in start and suffix != ".dae":
        return "a Collada file under another name"
    if start and not any(data):
        return "nothing but zero bytes: the copy was interrupted"
    return None


def _is_utf16(start: bytes) -> bool:
    """Whether every second byte of what looks like words is zero."""
    if start.startswith((b"\xff\xfe", b"\xfe\xff")):
        return True
    words = start[:32]
    halves = words[0::2], words[1::2]
    return any(
        len(words) == 32 and not any(zeros) and all(c in _TEXT for c in text)
        for zeros, text in (halves, halves[::-1])
    )
