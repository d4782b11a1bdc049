"""The codes that words mean: codes, beginnings of codes, or names of checks."""

from collections.abc import Iterable

from borecheck.errors import UnknownNameError
from borecheck.validation.registry import all_checks


def codes_of(words: str | Iterable[str]) -> tuple[str, ...]:
    """Codes or their beginnings, for words that may hold several between commas.

    Raises:
        UnknownNameError: A word, maybe an empty one, that no check goes by.
    """
    listed = [words] if isinstance(words, str) else list(words)
    by_name = {check.name: check.code for check in all_checks()}
    known = list(by_name.values())
    found = []
    for part in (part for word in listed for part in _parts(str(word))):
        code = by_name.get(part.lower(), part.upper())
        if not part or not any(name.startswith(code) for name in known):
            raise UnknownNameError("check", part, known)
        found.append(code)
    return tuple(found)


def _parts(word: str) -> list[str]:
    """What stands between commas; an empty word stays, to be refused."""
    return [part.strip() for part in word.split(",") if part.strip()] or [""]
