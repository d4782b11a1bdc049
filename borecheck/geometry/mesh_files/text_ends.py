"""What editors and copies add to a text file's ends, and that changes nothing in it."""

_BYTE_ORDER_MARK = b"\xef\xbb\xbf"


def without_mark(data: bytes) -> bytes:
    """A file without the byte-order mark of UTF-8 at its begin."""
    return data.removeprefix(_BYTE_ORDER_MARK)


def trimmed(data: bytes) -> tuple[bytes, tuple[str, ...]]:
    """A text file without byte-order mark and zero bytes at its end, and warnings."""
    data = without_mark(data)
    bare = data.rstrip(b"\0")
    n_zeros = len(data) - len(bare)
    if not n_zeros:
        return data, ()
    return bare, (f"{n_zeros} zero bytes at its end are left out",)
