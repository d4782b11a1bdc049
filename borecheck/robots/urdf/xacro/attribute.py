"""What stands behind a dot in an expression, and what has entries."""

from functools import partial
from typing import Any

from borecheck.robots.urdf.xacro.methods import METHODS
from borecheck.robots.urdf.xacro.values import (
    ExpressionError,
    Function,
    Namespace,
)


def attribute_of(owner: Any, name: str) -> Any:
    """What stands behind a dot.

    Raises:
        ExpressionError: Nothing that may be used.
    """
    import xacro

    if isinstance(owner, Namespace):
        if name not in owner.names:
            raise NameError(f"name '{owner.name}.{name}' is not defined")
        return owner.names[name]
    if isinstance(owner, xacro.Table):  # what an include with `ns` defined
        return owner[name]
    for kind, methods in METHODS.items():
        if isinstance(owner, kind) and name in methods:
            return Function(name, partial(methods[name], owner))
    if isinstance(owner, xacro.YamlDictWrapper):
        return owner[name]
    raise ExpressionError(
        f"the attribute {name!r} of {type(owner).__name__} is not allowed"
    )


def refuse_no_entries(value: Any) -> None:
    """Nothing, unless a value has no entries to take or to go through."""
    import xacro

    if isinstance(value, Function | Namespace | xacro.Table):
        raise ExpressionError(f"{type(value).__name__} has no entries")
