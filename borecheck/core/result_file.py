"""A stored result: a JSON file, or a report page, which carries the JSON within."""

import json
import re
from pathlib import Path
from typing import Any

from borecheck.errors import InputError

# The element of a page that holds the result.
RESULT_ID = "borecheck-result"

_BLOCK = re.compile(
    rf'<script[^>]*\bid="{RESULT_ID}"[^>]*>(.*?)</script>', re.DOTALL | re.IGNORECASE
)


def read_result(path: Path) -> dict[str, Any]:
    """The JSON document of a result file or of a page.

    Raises:
        InputError: Missing, not readable, or no result of borecheck.
    """
    text = _text(path)
    if text.lstrip()[:1] == "<":
        match = _BLOCK.search(text)
        if match is None:
            raise InputError(path, "is a page without a result of borecheck in it")
        text = match.group(1)
    try:
        document = json.loads(text)
    except (ValueError, RecursionError) as error:
        raise InputError(path, f"is no JSON result: {error}") from error
    if not isinstance(document, dict) or "schema_version" not in document:
        raise InputError(path, "is no result of borecheck (no `schema_version`)")
    return document


def _text(path: Path) -> str:
    try:
        if path.is_dir():
            raise InputError(path, "is a directory, not a result")
        return path.read_text(encoding="utf-8")
    except FileNotFoundError as error:
        raise InputError(path, "there is no such file") from error
    except PermissionError as error:
        raise InputError(path, "no permission to read it") from error
    except (OSError, ValueError) as error:
        raise InputError(path, f"cannot be read: {error}") from error
