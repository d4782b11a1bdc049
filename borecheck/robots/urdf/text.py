"""Bytes of a URDF file, and the text in them: refused where they could hurt.

What parsers disagree about (stray bytes, an odd XML version) is read leniently and kept
as a defect.
"""

import re
from difflib import get_close_matches
from pathlib import Path
from typing import Any, NamedTuple

from borecheck.errors import UrdfError
from borecheck.robots.urdf.reach import ANYWHERE, Roots, reach_of

MAX_BYTES = 50_000_000  # the largest public URDF is below 2 MB
_MARK = b"\xef\xbb\xbf"  # of UTF-8
_BLANK = b" \t\r\n"

# UTF-32 and UTF-16, with a mark or without: how a file in it begins.
_WIDE = {
    b"\xff\xfe\0\0": "utf-32",
    b"\0\0\xfe\xff": "utf-32",
    b"\xff\xfe": "utf-16",
    b"\xfe\xff": "utf-16",
    b"<\0": "utf-16-le",
    b"\0<": "utf-16-be",
}

_DECLARED = re.compile(rb"""^(\s*<\?xml[^>]*?)\s+encoding\s*=\s*["'][^"']*["']""")
_CODING = re.compile(rb"""<\?xml[^>]*?\sencoding\s*=\s*["']([^"']*)["']""")
_VERSION = re.compile(rb"""(<\?xml[^>]*?version\s*=\s*["'])([^"']*)(["'])""")


class SourceDefect(NamedTuple):
    """What other parsers refuse although the tree could be read.

    `kind` is "prefix" (undeclared namespace prefix), "version" (XML version) or
    "stray" (white space before the XML declaration, zeros behind the end).
    """

    kind: str
    line: int
    message: str


def is_xacro(path: Path) -> bool:
    """Whether a file is to be expanded: its name says so, or nobody evaluates it."""
    return path.suffix == ".xacro"


def read_bytes(path: Path, roots: Roots = ANYWHERE) -> bytes:
    """The bytes of a file, refused with one line if that is not possible.

    Args:
        path: The file.
        roots: Where it may lie if it is a link: a folder of strangers' files may hold
            links to the user's own.

    Raises:
        UrdfError: Missing, a directory, no permission, not a file, too large, a link
            that leads out of its folder tree and the roots.
    """
    try:
        if path.is_symlink() and not reach_of(path.parent, roots).holds(path):
            raise UrdfError(
                path, f"is a link to {path.resolve()}: name that, or --allow-outside"
            )
        if path.is_dir():
            raise UrdfError(path, "is a directory, not a URDF file")
        if not path.exists():
            raise UrdfError(path, f"no such file{_nearest(path)}")
        if not path.is_file():
            raise UrdfError(path, "is not a regular file")
        if path.stat().st_size > MAX_BYTES:
            raise UrdfError(path, f"is larger than {MAX_BYTES // 10**6} MB; refused")
        return path.read_bytes()
    except OSError as error:
        raise UrdfError(path, error.strerror or str(error)) from error


def _nearest(path: Path) -> str:
    """A file beside that may have been meant, as the end of "no such file"."""
    try:
        beside = [entry.name for entry in path.parent.iterdir()]
    except OSError:
        return ""
    close = get_close_matches(path.name, sorted(beside), 1, 0.75)
    return f"; did you mean {str(path.with_name(close[0]))!r}?" if close else ""


def as_utf8(data: bytes | str, file: str) -> bytes:
    """The text in UTF-8; bytes stay in the coding they declare, but for wide ones."""
    if isinstance(data, bytes):
        wide = next((c for mark, c in _WIDE.items() if data.startswith(mark)), None)
        if wide is None:
            return data
        try:
            data = data.decode(wide)
        except UnicodeDecodeError as error:
            problem = f"not well-formed XML: no text in {wide}: {error.reason}"
            raise UrdfError(file, problem) from error
    raw = _encoded(data.removeprefix("\ufeff"), file)
    return _DECLARED.sub(rb"\1", raw, count=1)


def _encoded(text: str, file: str) -> bytes:
    try:
        return text.encode()
    except UnicodeEncodeError as error:
        line = text.count("\n", 0, error.start) + 1
        problem = "not well-formed XML: half of a character (a lone surrogate)"
        raise UrdfError(file, problem, f"line {line}") from error


def text_of(raw: bytes) -> str:
    """A file's text for showing: what is no text in its coding is replaced."""
    wide = next((c for mark, c in _WIDE.items() if raw.startswith(mark)), None)
    declared = _CODING.match(raw[:200].lstrip(_MARK + _BLANK))
    coding = wide or (declared[1].decode("ascii", "replace") if declared else "utf-8")
    try:
        return raw.removeprefix(_MARK).decode(coding, "replace")
    except (LookupError, UnicodeError):
        return raw.decode("utf-8", "replace")


def without_stray(raw: bytes) -> tuple[bytes, tuple[SourceDefect, ...]]:
    """The text without what no parser of XML takes around it, and what that was.

    Editors and generators leave white space before `<?xml`, and zeros of a buffer
    behind the end. Lines keep their numbers.
    """
    found = []
    if raw.startswith(tuple(_WIDE)):
        return raw, ()  # zeros are half of its characters
    body = raw.removeprefix(_MARK)
    start = body.lstrip(_BLANK + _MARK)
    if start.startswith(b"<?xml") and len(start) < len(body):
        blank = body[: len(body) - len(start)].replace(_MARK, b"")
        declaration, end, rest = start.partition(b"?>")
        raw = declaration + end + blank + rest
        message = "white space or a byte-order mark before the XML declaration"
        found.append(SourceDefect("stray", 1, message))
    whole = raw.rstrip(_BLANK + b"\0")
    if b"\0" in raw[len(whole) :]:
        line = whole.count(b"\n") + 1
        raw = whole
        found.append(SourceDefect("stray", line, "zeros (NUL) behind the end"))
    return raw, tuple(found)


def mend_version(raw: bytes) -> tuple[bytes, tuple[SourceDefect, ...]]:
    """The text as XML 1.0, if it says another version, and that it did."""
    match = _VERSION.match(raw.lstrip()[:200])
    if match is None or match.group(2).startswith(b"1."):
        return raw, ()
    version = match.group(2).decode("ascii", "replace")
    message = f"XML version {version!r}; only 1.0 and 1.1 exist"
    mended = _VERSION.sub(rb"\g<1>1.0\g<3>", raw, count=1)
    return mended, (SourceDefect("version", 1, message),)


def decoded(raw: bytes, root: Any) -> str:
    """The text; without the coding it declares, which a text no longer has."""
    raw = _DECLARED.sub(rb"\1", raw, count=1)
    coding = root.getroottree().docinfo.encoding or "utf-8"
    try:
        return raw.removeprefix(_MARK).decode(coding, "replace")
    except LookupError:  # libxml2 knows codings that Python does not
        return raw.decode("utf-8", "replace")
