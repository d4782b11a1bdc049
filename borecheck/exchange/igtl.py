"""Messages of OpenIGTLink, versions 1 to 3: TRANSFORM, STRING and STATUS.

A header of 58 bytes (type, device, time, size, CRC64) and a body, big-endian; version 2
of the header puts an extended header before the content and metadata behind it. What
comes from a socket is not trusted: sizes are bounded, checksums asked, names cut.
"""

import struct
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from borecheck.errors import BorecheckError

Array = NDArray[np.float64]

# A transform has 48 bytes; whoever sends images here sends them to the wrong door.
MAX_BODY = 64 * 1024
MAX_NAME, MAX_TYPE = 20, 12

HEADER = struct.Struct(">H12s20sIIQQ")
_EXTENDED = struct.Struct(">HHII")
_ASCII, _UTF8 = 3, 106

# Of ECMA-182, as the protocol has it.
_POLYNOMIAL = 0x42F0E1EBA9EA3693
_ALL = (1 << 64) - 1

# Rows of R as float32 are of length 1 within this; beyond it is scaled or sheared.
_RIGID = 1e-4


class IgtlError(BorecheckError):
    """Bytes that are no message, after which nothing on that connection is sure."""


@dataclass(frozen=True)
class Message:
    """A message.

    Attributes:
        kind: TRANSFORM, STRING, STATUS or another type.
        name: Of the device.
        content: The body without extended header and metadata.
        seconds: When, since 1970, [s].
    """

    kind: str
    name: str
    content: bytes
    seconds: float = 0.0

    def packed(self) -> bytes:
        """As bytes with a header of version 1, which all versions read."""
        whole = int(self.seconds)
        header = HEADER.pack(
            1,
            self.kind.encode("ascii")[:MAX_TYPE],
            self.name.encode("ascii", "replace")[:MAX_NAME],
            whole,
            int((self.seconds - whole) * 2**32),
            len(self.content),
            crc64(self.content),
        )
        return header + self.content


def transform(name: str, T: Array, seconds: float = 0.0) -> Message:
    """A placement (4, 4), translation in [m], as a message, which counts in mm."""
    numbers = np.concatenate([T[:3, :3].T.reshape(-1), 1e3 * T[:3, 3]])
    return Message("TRANSFORM", name, numbers.astype(">f4").tobytes(), seconds)


def transform_of(message: Message) -> Array:
    """The placement (4, 4) of a TRANSFORM, translation in [m].

    Raises:
        IgtlError: It is no rigid transform.
    """
    if len(message.content) != 48:
        raise IgtlError(f"a TRANSFORM of {len(message.content)} bytes, not 48")
    numbers = np.frombuffer(message.content, dtype=">f4").astype(np.float64)
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = numbers[:9].reshape(3, 3).T, 1e-3 * numbers[9:]
    R = T[:3, :3]
    with np.errstate(all="ignore"):
        off = np.abs(R.T @ R - np.eye(3)).max() + abs(np.linalg.det(R) - 1.0)
    if not (np.isfinite(T).all() and off <= _RIGID):
        raise IgtlError("a TRANSFORM that is not rigid")
    u, _, v = np.linalg.svd(R)
    T[:3, :3] = u @ v
    return T


def string(name: str, text: str, seconds: float = 0.0) -> Message:
    """A text as a STRING message."""
    encoded = text.encode("utf-8")[: MAX_BODY // 2]
    head = struct.pack(">HH", _UTF8, len(encoded))
    return Message("STRING", name, head + encoded, seconds)


def text_of(message: Message) -> str:
    """The text of a STRING or STATUS message.

    Raises:
        IgtlError: Its length is not what it says.
    """
    if message.kind == "STATUS":
        return message.content[30:].rstrip(b"\0").decode("utf-8", "replace")
    if len(message.content) < 4:
        raise IgtlError("a STRING without a length")
    _, size = struct.unpack(">HH", message.content[:4])
    if len(message.content) != 4 + size:
        raise IgtlError("a STRING whose length is not what it says")
    return message.content[4:].decode("utf-8", "replace")


class Reader:
    """Takes bytes as they come and gives whole messages."""

    def __init__(self) -> None:
        self._bytes = bytearray()

    def feed(self, some: bytes) -> Iterator[Message]:
        """The messages that are whole with these bytes.

        Raises:
            IgtlError: They are no messages; the connection is to be closed.
        """
        self._bytes += some
        while len(self._bytes) >= 2:
            version = int.from_bytes(self._bytes[:2], "big")
            if version not in (1, 2):
                raise IgtlError(f"a header of version {version}")
            if len(self._bytes) < HEADER.size:
                return
            _, kind, name, whole, part, size, crc = HEADER.unpack_from(self._bytes)
            if size > MAX_BODY:
                raise IgtlError(f"a message of {size} bytes; {MAX_BODY} are read")
            if len(self._bytes) < HEADER.size + size:
                return
            body = bytes(self._bytes[HEADER.size : HEADER.size + size])
            del self._bytes[: HEADER.size + size]
            if crc64(body) != crc:
                raise IgtlError("a message whose checksum is wrong")
            content = body if version == 1 else _content(body)
            yield Message(_word(kind), _word(name), content, whole + part / 2**32)


def _content(body: bytes) -> bytes:
    """What stands between extended header and metadata."""
    if len(body) < _EXTENDED.size:
        raise IgtlError("an extended header that is cut short")
    start, index, meta, _ = _EXTENDED.unpack_from(body)
    end = len(body) - index - meta
    if not _EXTENDED.size <= start <= end:
        raise IgtlError("an extended header whose sizes do not fit")
    return body[start:end]


def _word(padded: bytes) -> str:
    text = padded.split(b"\0")[0].decode("ascii", "replace").strip()
    return "".join(c if c.isprintable() else "?" for c in text)


def crc64(data: bytes) -> int:
    """The checksum of a body."""
    crc = 0
    for byte in data:
        crc = _TABLE[(crc >> 56) ^ byte] ^ ((crc << 8) & _ALL)
    return crc


def _table() -> list[int]:
    rows = []
    for byte in range(256):
        row = byte << 56
        for _ in range(8):
            row = ((row << 1) ^ (_POLYNOMIAL if row >> 63 else 0)) & _ALL
        rows.append(row)
    return rows


_TABLE = _table()
