"""A stored result: a JSON file, or a report page, which carries the JSON within."""

import json
import re
from pathlib import Path
from typing import Any

from borecheck.errors import InputError

# Of every JSON result; raised when a key that outsiders read changes its meaning.
SCHEMA_VERSION = "1"

# A result with ten thousand plans and their pictures stays far below it, [bytes].
MAX_BYTES = 500_000_000

# The element of a page that holds the result.
RESULT_ID = "borecheck-result"

_BLOCK = re.compile(
    rf'<script[^>]*\bid="{RESULT_ID}"[^>]*>(.*?)</script>', re.DOTALL | re.IGNORECASE
)


def read_result(path: Path) -> dict[str, Any]:
    """The JSON document of a result file or of a page.

    Raises:
        InputError: Missing, not readable, no result of borecheck, or one of another
            schema version.
    """
    text = _text(path)
    if text.lstrip()[:1] == "<":
        match = _BLOCK.search(text)
        if match is None:
            raise InputError(path, "is a page without a result of borecheck in it")
        text = match.group(1)
    try:
        document = json.loads(text, parse_constant=_refuse_constant)
    except (ValueError, RecursionError) as error:
        raise InputError(path, f"is no JSON result: {error}") from error
    if not isinstance(document, dict) or "schema_version" not in document:
        raise InputError(path, "is no result of borecheck (no `schema_version`)")
    stated = document["schema_version"]
    if stated != SCHEMA_VERSION:
        raise InputError(
            path,
            f"is of schema version {str(stated)[:20]!r}, this borecheck reads "
            f"{SCHEMA_VERSION!r}",
        )
    return document


def _refuse_constant(text: str) -> float:
    raise ValueError(f"{text} is no finite number")


def _text(path: Path) -> str:
    try:
        if path.is_dir():
            raise InputError(path, "is a directory, not a result")
        if path.stat().st_size > MAX_BYTES:
            raise InputError(path, f"is larger than {MAX_BYTES // 10**6} MB")
        return path.read_text(encoding="utf-8")
    except FileNotFoundError as error:
        raise InputError(path, "there is no such file") from error
    except PermissionError as error:
        raise InputError(path, "no permission to read it") from error
    except (OSError, ValueError) as error:
        raise InputError(path, f"cannot be read: {error}") from error
