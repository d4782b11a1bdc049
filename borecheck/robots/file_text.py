"""The text that names an obstacle: `FILE[:unit][:frame][@x,y,z[,r,p,y]]`."""

import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from borecheck.core.units import LENGTH_UNITS
from borecheck.errors import UsageError
from borecheck.geometry.mesh_files.frames import FRAMES, is_frame
from borecheck.robots.robot_file import exists


@dataclass(frozen=True)
class FileText:
    """What `FILE[:unit][:frame][@pose]` says.

    Attributes:
        path: The file.
        unit: As typed, or None.
        frame: As typed, or None.
        pose: As typed, or None.
    """

    path: Path
    unit: str | None = None
    frame: str | None = None
    pose: str | None = None

    def completed(self, unit: str | None, frame: str | None) -> str:
        """The same text with what it left out."""
        words = [word for word in (self.unit or unit, self.frame or frame) if word]
        at = f"@{self.pose}" if self.pose is not None else ""
        return f"{':'.join([str(self.path), *words])}{at}"


def split_file_text(text: str) -> FileText:
    """File, unit, frame and pose; a file whose name holds : or @ is taken whole.

    Raises:
        UsageError: A word behind the file that is neither unit nor frame.
    """
    if exists(Path(text)):
        return FileText(Path(text))
    whole, words = _words_behind(text)
    if words and exists(Path(whole)):
        return _file_text(whole, words, None)
    rest, at, pose = text.rpartition("@")
    path, words = _words_behind(rest if at else text)
    return _file_text(path, words, pose if at else None)


def _words_behind(text: str) -> tuple[str, list[str]]:
    """A file and the words behind its name; a file that is there is taken whole."""
    words: list[str] = []
    while len(words) < 2 and not exists(Path(text)):
        match = re.fullmatch(r"(.+):([A-Za-z-]+)", text)
        if match is None:
            break
        text = match[1]
        words.insert(0, match[2])
    return text, words


def _file_text(path: str, words: Sequence[str], pose: str | None) -> FileText:
    unit = frame = None
    for word in words:
        if word in LENGTH_UNITS and unit is None and frame is None:
            unit = word
        elif is_frame(word.lower()) and frame is None:
            frame = word.lower()
        elif len(words) == 2 and word in LENGTH_UNITS:
            raise UsageError(f"{path}: the unit comes first, FILE:{word}:FRAME")
        else:
            raise UsageError(
                f"unit {word!r} of {path} is none of {', '.join(LENGTH_UNITS)}, "
                f"and no frame ({', '.join(FRAMES)}, lps-hfs ...)"
            )
    return FileText(Path(path), unit, frame, pose)
