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
    found = []
    for part in (part for word in listed for part in _parts(str(word))):
        code = code_of(part)
        if code is None:
            raise UnknownNameError("check", part, [c.code for c in all_checks()])
        found.append(code)
    return tuple(found)


def code_of(word: str) -> str | None:
    """The code, or beginning of codes, that one word means; None if no check's."""
    for check in all_checks():
        if word.lower() == check.name:
            return check.code
    code = word.upper()
    known = any(check.code.startswith(code) for check in all_checks())
    return code if word and known else None


def _parts(word: str) -> list[str]:
    """What stands between commas; an empty word stays, to be refused."""
    return [part.strip() for part in word.split(",") if part.strip()] or [""]
