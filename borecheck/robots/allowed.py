"""Who may touch whom: pairs of links that a user, an SRDF or a description allows.

A pair is two links of the robot. No obstacle is ever one of them: what stands around
the robot must not be touched, whatever a file says.
"""

import shlex
from collections import Counter
from collections.abc import Collection, Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from borecheck.errors import UsageError
from borecheck.robots.srdf import (
    ADJACENT,
    NO_REASON,
    Srdf,
    StatedPair,
    kind_of,
    no_link,
    read_srdf,
)
from borecheck.robots.urdf.reach import NO_ROOTS, Roots

Request = str | Sequence[str]

# By the user's own word, on the command line or in a call.
ASKED = "by request"
OPTION = "--allow"
# Pairs that are named one by one in a phrase.
NAMED = 3
# Options that are written out, at most: a line of a terminal must hold them.
MOST_OPTIONS = 20
# Files beside a robot's that are named as a proposal, at most.
MOST_PROPOSED = 3


@dataclass(frozen=True)
class AllowedPair:
    """Two links that may touch.

    Attributes:
        first: One link.
        second: The other.
        reason: Why they may.
        source: Who says so: an option, a file with its line, the robot's description.
    """

    first: str
    second: str
    reason: str
    source: str

    @property
    def links(self) -> frozenset[str]:
        """The two links, in no order."""
        return frozenset((self.first, self.second))

    @property
    def says_adjacent(self) -> bool:
        """Whether they may touch because they are said to be neighbours."""
        return kind_of(self.reason) == ADJACENT

    @property
    def odd(self) -> str:
        """What to say where they are not."""
        return (
            f"{self.source}: {self.first} and {self.second} are called adjacent, but "
            "other links stand between them; they may touch all the same"
        )

    def __str__(self) -> str:
        return f"{self.first} with {self.second} ({self.reason}; {self.source})"


@dataclass(frozen=True)
class Allowances:
    """What a user gave: who may touch whom beyond the robot's own description.

    Attributes:
        srdf: A file with pairs.
        pairs: Pairs, `LINK:LINK` or two names each.
        trust_never: Whether the file's pairs are taken that rest on statistics or on
            no reason that is known.
    """

    srdf: Path | None = None
    pairs: tuple[Request, ...] = ()
    trust_never: bool = False

    def of(
        self, links: Collection[str], roots: Roots = NO_ROOTS, robot: str = ""
    ) -> "Found":
        """Pairs for a robot of these links, and what its user should know of them.

        Args:
            links: All links of the robot.
            roots: Where the SRDF may lie if it is a link.
            robot: The robot's own name.

        Raises:
            UrdfError: The SRDF cannot be used.
            UsageError: A pair that is none, or `trust_never` without a file.
        """
        found = [
            AllowedPair(*_asked(pair, links), ASKED, OPTION) for pair in self.pairs
        ]
        if self.srdf is None:
            if self.trust_never:
                raise UsageError("--trust-never goes with --srdf FILE")
            return Found(_each_once(found))
        srdf = read_srdf(self.srdf, links, roots)
        taken = srdf.pairs if self.trust_never else srdf.taken
        found += [_from_file(pair, srdf) for pair in taken]
        notes = tuple(_notes(srdf, self.trust_never, robot))
        return Found(_each_once(found), notes, srdf.sha256)


NONE = Allowances()


@dataclass(frozen=True)
class Found:
    """What allowances are for one robot.

    Attributes:
        pairs: Who may touch whom, each pair once.
        notes: What the user should know of the SRDF.
        srdf_sha256: Its hash.
    """

    pairs: tuple[AllowedPair, ...]
    notes: tuple[str, ...] = ()
    srdf_sha256: str | None = None


def allowances_of(
    srdf: str | Path | None = None,
    pairs: Sequence[Request] = (),
    trust_never: bool = False,
) -> Allowances:
    """Allowances from what was given.

    Raises:
        UsageError: A text where a list of pairs is meant.
    """
    if isinstance(pairs, str):
        raise UsageError(f"allow is a list of pairs: give [{pairs!r}]")
    path = None if srdf is None else Path(srdf)
    return Allowances(path, tuple(pairs), trust_never)


def _each_once(pairs: Iterable[AllowedPair]) -> tuple[AllowedPair, ...]:
    found: dict[frozenset[str], AllowedPair] = {}
    for pair in pairs:
        found.setdefault(pair.links, pair)
    return tuple(found.values())


def _from_file(pair: StatedPair, srdf: Srdf) -> AllowedPair:
    source = f"{Path(srdf.file).name}, line {pair.line}"
    return AllowedPair(pair.first, pair.second, pair.reason or NO_REASON, source)


def _asked(request: Request, links: Collection[str]) -> tuple[str, str]:
    """The two links of a request; a name may hold a colon itself.

    Raises:
        UsageError: Not two links of the robot, or one with itself.
    """
    if not isinstance(request, str | Sequence):
        raise UsageError(f"{OPTION} {request!r}: give two links of the robot")
    told = request if isinstance(request, str) else ":".join(map(str, request))
    splits = list(_splits(request))
    found = [pair for pair in splits if all(name in links for name in pair)]
    if len(found) == 1:
        first, second = found[0]
        if first == second:
            raise UsageError(f"{OPTION} {told}: {first} with itself is no pair")
        return first, second
    if not splits:
        raise UsageError(f"{OPTION} {told}: give two links of the robot, LINK:LINK")
    if found:
        ways = " or ".join(f"{a} and {b}" for a, b in found)
        raise UsageError(f"{OPTION} {told} can be read as {ways}: give them by --srdf")
    unknown = next(name for name in splits[0] if name not in links)
    raise UsageError(f"{OPTION} {told} {no_link(unknown, links)}")


def _splits(request: Request) -> Iterator[tuple[str, str]]:
    """Every way to read a request as two names."""
    if not isinstance(request, str):
        if len(request) == 2:
            yield str(request[0]), str(request[1])
        return
    words = request.split(":")
    for k in range(1, len(words)):
        first, second = ":".join(words[:k]), ":".join(words[k:])
        if first and second:
            yield first, second


def _notes(srdf: Srdf, trust_never: bool, robot: str) -> Iterator[str]:
    """What is odd about an SRDF, and what was left out of it."""
    if robot and srdf.name not in ("", robot):
        yield f"{srdf.file}: is for a robot called {srdf.name!r}, not {robot!r}"
    if not srdf.pairs:
        yield f"{srdf.file}: lets no pair of links touch"
    if not srdf.left:
        return
    kinds = Counter(pair.kind for pair in srdf.left)
    listed = ", ".join(f"{count} {kind}" for kind, count in kinds.most_common(4))
    listed += ", ..." if len(kinds) > 4 else ""
    count = len(srdf.left)
    pairs = "1 pair" if count == 1 else f"{count} pairs"
    if trust_never:
        yield f"{srdf.file}: {pairs} taken on trust ({listed})"
    else:
        yield (
            f"{srdf.file}: {pairs} left out and examined all the same ({listed}): "
            "--trust-never takes them"
        )


def unasked(pairs: Sequence[AllowedPair]) -> tuple[str, ...]:
    """Pairs that nothing is asked about, as one phrase; none without such."""
    if not pairs:
        return ()
    listed = ", ".join(f"{pair.first} with {pair.second}" for pair in pairs[:NAMED])
    more = f" and {len(pairs) - NAMED} more" if len(pairs) > NAMED else ""
    return (f"contact of links that may touch: {listed}{more}",)


def hints(
    file: Path, given: Allowances, touching: Sequence[tuple[str, str]]
) -> list[str]:
    """How to let links touch that do: the options to type.

    Args:
        file: The robot's file.
        given: What the user let touch already.
        touching: Pairs of links in contact.
    """
    if not touching:
        return []
    pairs = ", ".join(f"{a} with {b}" for a, b in touching[:MOST_OPTIONS])
    words = " ".join(_option(a, b) for a, b in touching[:MOST_OPTIONS])
    more = len(touching) - MOST_OPTIONS
    if more > 0:
        pairs += f" and {more} more (all are in the JSON, under itself)"
        words += " ..."
    found = [f"the robot touches itself: {pairs}; if they may touch: {words}"]
    if given.srdf is None and (beside := proposed(file)):
        files = " or ".join(f"--srdf {shlex.quote(str(path))}" for path in beside)
        found.append(f"an SRDF lies by the robot's file and may say so: {files}")
    return found


def _option(first: str, second: str) -> str:
    return f"{OPTION} {shlex.quote(f'{first}:{second}')}"


def proposed(file: Path) -> tuple[Path, ...]:
    """SRDF files beside a robot's file, or in a folder `srdf` beside its own.

    They are named, never read: what a file may change is for the user to say.
    """
    folders = (file.parent, file.parent / "srdf", file.parent.parent / "srdf")
    found = [path for folder in folders for path in _within(folder)]
    return tuple(sorted(found, key=lambda p: (p.stem != file.stem, p))[:MOST_PROPOSED])


def _within(folder: Path) -> list[Path]:
    try:
        return [p for p in folder.iterdir() if p.suffix.lower() == ".srdf"]
    except OSError:  # no such folder, or none that may be looked into
        return []
