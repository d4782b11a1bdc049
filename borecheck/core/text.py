"""Text from files, made fit for a terminal."""

from collections.abc import Iterable


def printable(text: object, keep: str = "") -> str:
    r"""Text in which every character shows itself.

    Names come from files, and a file may be hostile: an escape sequence erases a line
    that was printed, a line break begins one that a program reads as a command, a
    change of direction turns a name round. All of these become escapes (`\x1b`,
    `\n`, `\u202e`); letters of any script stay.

    Args:
        text: Anything; of what is no text, its `str`.
        keep: Characters that stay although they do not show, for example a line break
            in text of our own lines.
    """
    return "".join(c if c.isprintable() or c in keep else _escape(c) for c in str(text))


def in_lines(lines: Iterable[object]) -> str:
    """Text of these lines, each printable: a name in one cannot begin another."""
    return "".join(f"{printable(line)}\n" for line in lines)


def one_line(text: object) -> str:
    """Text of an error or a warning in one line, blanks and breaks as one blank."""
    return printable(" ".join(str(text).split()))


def _escape(character: str) -> str:
    return character.encode("unicode_escape", "surrogatepass").decode("ascii")
