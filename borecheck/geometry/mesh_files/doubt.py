"""What a mesh file leaves open and nobody has settled: one reason, one word to type.

A guess is good enough to show a scene and to find contact, never to call anything
clear. The unit of a file may be guessed from its size; a frame or an up axis that it
states may be unheard. Both end here.
"""

from dataclasses import dataclass
from typing import Protocol

from borecheck.geometry.mesh_files.frames import AS_IT_STANDS, PATIENT_FRAMES, spelt


class Doubt(Protocol):
    """Whatever says why nothing is clear of an obstacle."""

    @property
    def reason(self) -> str:
        """Why nothing is clear yet, and what to do about it."""


@dataclass(frozen=True)
class PlaceDoubt:
    """Why nothing is clear of an obstacle of which the place was assumed.

    Attributes:
        reason: What was assumed, and what to give instead.
    """

    reason: str


@dataclass(frozen=True)
class FileDoubt:
    """Why nothing is clear of what a file holds.

    Attributes:
        file: The mesh file.
        guessed_unit: What its numbers were taken for, when nobody stated the unit.
        frame: The frame or up axis that it states and nobody has acknowledged.
        frame_is_implied: Only its standard states it, not the file.
        typed: What to type to state all that, `FILE:mm:lps[@pose]`.
    """

    file: str
    guessed_unit: str | None
    frame: str | None
    frame_is_implied: bool
    typed: str

    @property
    def reason(self) -> str:
        """Why nothing is clear yet, and what to do about it."""
        open_questions = []
        if self.guessed_unit is not None:
            unit = f"the unit of {self.file} was guessed ({self.guessed_unit})"
            open_questions.append(unit)
        if self.frame is not None:
            open_questions.append(f"{self.file} {self._statement}")
        said = f"{' and '.join(open_questions)}: type {self.typed} if that is right"
        if self.frame is None:
            return said
        return f"{said} (:{AS_IT_STANDS} for :{self.frame} if it is not)"

    @property
    def _statement(self) -> str:
        word = str(self.frame)
        kind = "frame" if word in PATIENT_FRAMES else "up axis"
        verb = "implies" if self.frame_is_implied else "states"
        return f"{verb} the {kind} {spelt(word)}, which was not applied"
