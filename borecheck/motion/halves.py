"""Two answers about a motion: of the obstacles, and of the robot itself.

One search answers for both; where it does not say clear, each question is searched for
itself, so that parts of the robot that always touch hide nothing of the scanner.
"""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from borecheck.contact.verdict import (
    CLEAR,
    CONTACT,
    UNKNOWN,
    Answer,
    Verdict,
)
from borecheck.motion.outcome import PathVerdict
from borecheck.motion.problem import PathProblem
from borecheck.motion.search import search

Answers = tuple[Answer, Answer]


def of_samples(
    fractions: Sequence[float], poses: Sequence[Verdict], not_known: Sequence[str]
) -> Answers:
    """What samples alone say: contact, or that nothing is certified.

    Args:
        fractions: Where they lie on the motion.
        poses: The verdict at each.
        not_known: For each why it may not lie on the motion, or "".
    """
    obstacles = [pose.obstacles for pose in poses]
    itself = [pose.itself for pose in poses]
    return (
        _of_samples(fractions, obstacles, not_known),
        _of_samples(fractions, itself, not_known),
    )


def _of_samples(
    fractions: Sequence[float], answers: Sequence[Answer], not_known: Sequence[str]
) -> Answer:
    known = [k for k, doubt in enumerate(not_known) if not doubt]
    for verdict in (CONTACT, UNKNOWN):
        for k in known:
            if answers[k].verdict == verdict and len(answers) > 1:
                pairs = {pair for m in known for pair in answers[m].pairs}
                reason = f"at {fractions[k]:.1%} of the motion: {answers[k].reason}"
                qualifiers = answers[k].qualifiers
                return Answer(verdict, reason, qualifiers, tuple(sorted(pairs)))
    doubts = [doubt for doubt in not_known if doubt]
    if doubts:
        return Answer(UNKNOWN, doubts[0])
    if len(answers) == 1:
        return answers[0]
    return Answer(UNKNOWN, f"clear at {len(answers)} samples, not certified between")


def searched(
    problem: PathProblem, points: NDArray[np.float64], found: PathVerdict
) -> tuple[PathVerdict, PathVerdict | None]:
    """What holds of the obstacles, and of the robot itself, at every instant.

    Args:
        problem: Who must not touch whom.
        points: The waypoints.
        found: What the search of the whole problem said.

    Returns:
        Both verdicts; None for the robot itself where the first holds of it, too.
    """
    if found.verdict == CLEAR or not problem.self_pairs:
        return found, None
    itself = search(only_itself(problem), points)
    if itself.verdict == CLEAR:
        return found, itself
    return search(without_itself(problem), points), itself


def answers_of(
    problem: PathProblem,
    around: PathVerdict,
    itself: PathVerdict | None,
    link_of: Mapping[str, str],
) -> Answers:
    """Two verdicts of `searched` as answers."""
    return about_obstacles(around, link_of), about_itself(problem, itself, link_of)


def without_itself(problem: PathProblem) -> PathProblem:
    """The same, but for what the robot does to itself."""
    return replace(problem, self_pairs=())


def only_itself(problem: PathProblem) -> PathProblem:
    """The same, but for what stands around the robot."""
    return replace(problem, obstacles=(), passages=(), doubt=None)


def _count(problem: PathProblem) -> str:
    count = len(problem.self_pairs)
    if count == 0:
        return "no two parts of it could meet"
    return f"every instant is proven clear for {count} pairs of parts"


def about_obstacles(found: PathVerdict, link_of: Mapping[str, str]) -> Answer:
    """A search's verdict, with the links that it found in contact with obstacles."""
    return _answer(found, {(link_of[part], other) for part, other in _touching(found)})


def about_itself(
    problem: PathProblem, found: PathVerdict | None, link_of: Mapping[str, str]
) -> Answer:
    """A search's verdict about the robot alone; None where all of it is clear."""
    if found is None:
        return Answer(CLEAR, _count(problem))
    pairs = {(link_of[a], link_of[b]) for a, b in _touching(found)}
    return _answer(found, pairs)


def _answer(found: PathVerdict, pairs: Iterable[tuple[str, str]]) -> Answer:
    return Answer(found.verdict, found.reason, found.qualifiers, tuple(sorted(pairs)))


def _touching(found: PathVerdict) -> Iterator[tuple[str, str]]:
    for stretch in found.intervals:
        if stretch.verdict == CONTACT:
            yield from stretch.pairs
