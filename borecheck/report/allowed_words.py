"""What the robot does to itself, apart from the obstacles, and who may touch whom."""

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

MARKS = {"clear": "CLEAR", "contact": "CONTACT", "unknown": "UNKNOWN"}

# So many pairs are named in the one line that sums them up.
NAMED = 3


def half_lines(block: Mapping[str, Any]) -> Iterator[str]:
    """A line about the obstacles and one about the robot itself, if that is not clear.

    Else, and where both say what the whole says, the verdict's own line says it all.
    """
    itself = block.get("itself")  # none in results of earlier versions
    if itself is None or itself["verdict"] == "clear":
        return
    halves = (block["obstacles"], itself)
    if all(
        (h["verdict"], h["reason"]) == (block["verdict"], block["reason"])
        for h in halves
    ):
        return  # both say the same again
    for name, half in (("obstacles", block["obstacles"]), ("itself", itself)):
        yield f"{name}: {MARKS[half['verdict']]}: {half['reason']}"


def allowed_lines(document: Mapping[str, Any], explain: bool = False) -> Iterator[str]:
    """Pairs of links that may touch: one line, or a line each."""
    pairs = document.get("allowed", ())
    if explain:
        for pair in pairs:
            more = "" if pair["skips_check"] else ", joined or without geometry anyway"
            yield f"may touch: {named(pair)}{more}"
        return
    asked = [pair for pair in pairs if pair["skips_check"]]
    if not asked:
        return
    if len(asked) <= NAMED:
        yield f"may touch, not examined: {', '.join(map(named, asked))}"
    else:
        yield f"may touch, not examined: {summed_up(asked)}; each with --explain"


def named(pair: Mapping[str, Any]) -> str:
    """A pair with reason and source."""
    return f"{pair['first']} with {pair['second']} ({pair['reason']}; {pair['source']})"


def summed_up(pairs: Sequence[Mapping[str, Any]]) -> str:
    """How many pairs for which reason."""
    kinds = Counter(pair["reason"] for pair in pairs).most_common()
    listed = ", ".join(f"{count} {reason}" for reason, count in kinds[:NAMED])
    more = ", ..." if len(kinds) > NAMED else ""
    return f"{len(pairs)} pairs of links ({listed}{more})"


def hint_lines(document: Mapping[str, Any]) -> Iterator[str]:
    """What to type next."""
    return (f"hint: {text}" for text in document.get("hints", ()))
