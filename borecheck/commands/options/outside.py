"""`--allow-outside`: whether a robot file may name any file of this computer."""

from collections.abc import Callable


def add_allow_outside(add: Callable[..., object]) -> None:
    """Whether a robot file may name any file of this computer."""
    add(
        "--allow-outside",
        action="store_true",
        help="files named by a robot file may lie outside its folder tree and roots",
    )
