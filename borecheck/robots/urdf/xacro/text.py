"""Texts of a xacro file with what is in `${...}` and `$(...)` worked out.

The same pieces as xacro's own `eval_text`, which copies what is left of a text at each
piece and so takes hours over a long one.
"""

import re
from collections.abc import Callable
from typing import Any

from borecheck.errors import UrdfError
from borecheck.robots.urdf.xacro.run import MAX_TEXT, Run
from borecheck.robots.urdf.xacro.values import MAX_SIZE, ExpressionError

SHOWN = 200  # letters of an expression in a message

_PIECE = re.compile(
    r"(?P<dollars>\$\$+[{(])|(?P<expression>\$\{[^}]*\})"
    r"|(?P<extension>\$\([^)]*\))|(?P<text>[^$]+|\$[^{($]+|\$\Z)"
)


def text_evaluator(
    run: Run,
    evaluate: Callable[[str, Any], Any],
    extend: Callable[[str], Any],
) -> Callable[[str, Any], Any]:
    """The replacement of `xacro.eval_text`.

    Args:
        run: Where the letters are counted.
        evaluate: The value of an expression with the names in a table.
        extend: The value of `$(...)`.
    """
    import xacro

    def eval_text(text: str, symbols: Any) -> Any:
        results, at = [], 0
        while at < len(text):
            match = _PIECE.match(text, at)
            if match is None:
                raise xacro.XacroException(f"invalid expression: {text[at:][:SHOWN]}")
            at = match.end()
            results.append(piece(match, symbols))
        run.count("letters of text", MAX_TEXT, sum(map(_length, results)))
        if len(results) == 1:
            return results[0]
        _refuse_long(results)
        return "".join(map(str, results))

    def piece(match: re.Match[str], symbols: Any) -> Any:
        text = match.group()
        if match.lastgroup == "expression":
            return expression(text[2:-1], symbols)
        if match.lastgroup == "extension":
            return extend(f"$({eval_text(text[2:-1], symbols)})")
        return text[1:] if match.lastgroup == "dollars" else text

    def expression(text: str, symbols: Any) -> Any:
        try:
            return evaluate(str(eval_text(text, symbols)), symbols)
        except (UrdfError, MemoryError, RecursionError):
            raise
        except Exception as error:
            shown = text if len(text) <= SHOWN else f"{text[:SHOWN]}..."
            suffix = f"\nwhen evaluating expression '{shown}'"
            raise xacro.XacroException(exc=error, suffix=suffix) from error

    return eval_text


def _length(value: Any) -> int:
    return len(value) if isinstance(value, str | list | tuple | dict | set) else 1


def _refuse_long(results: list[Any]) -> None:
    if sum(map(_length, results)) > MAX_SIZE:
        raise ExpressionError(f"a text is longer than {MAX_SIZE} letters")
