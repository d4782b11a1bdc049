"""The names that an expression finds: Python's small change, `math`, and xacro's own.

The set is xacro's (`create_global_symbols`), without what only looks at Python itself
(`vars`, `hash`, `issubclass`). Functions that give iterators give lists here.
"""

import math
from collections.abc import Callable, Iterable, Mapping
from typing import Any

from borecheck.robots.urdf.xacro.limits import limited_range
from borecheck.robots.urdf.xacro.values import (
    OPERATORS,
    Budget,
    ExpressionError,
    Function,
    Namespace,
    call,
)

MAX_WHOLE = 1_000  # what a factorial or a binomial may be asked of
MAX_DIGITS = 400  # to which a number may be rounded

# Known without a prefix, for years; all are in `python`, too.
_EVERYWHERE = (
    *("list", "dict", "map", "len", "str", "float", "int", "bool", "True", "False"),
    *("min", "max", "round"),
)
_OLD_PYTHON = ("sorted", "range")
_OLD_XACRO = ("load_yaml", "abs_filename", "dotify")


def python_names(budget: Budget) -> dict[str, Any]:
    """What stands behind `python.`."""

    def apply(function: Any, *given: Any) -> Any:
        return call(function, given, {}, budget)

    plain: dict[str, Callable[..., Any]] = {
        **{"len": len, "abs": abs, "all": all, "any": any, "divmod": divmod},
        **{"ord": ord, "repr": repr, "sum": _sum, "round": _round},
        "map": lambda f, *lists: [
            apply(f, *each) for each in zip(*lists, strict=False)
        ],
        "filter": lambda f, items: [i for i in items if (apply(f, i) if f else i)],
        "zip": lambda *lists: list(zip(*lists, strict=False)),
        "enumerate": lambda items, start=0: list(enumerate(items, start)),
        "reversed": lambda items: list(reversed(items)),
        "sorted": _by_key(sorted, apply),
        "min": _by_key(min, apply),
        "max": _by_key(max, apply),
        "isinstance": _isinstance,
        "type": _type,
    }
    functions = {name: Function(name, made) for name, made in plain.items()}
    kinds: tuple[type, ...] = (str, float, int, bool, complex, list, tuple, dict, set)
    for kind in (*kinds, frozenset, slice):
        functions[kind.__name__] = Function(kind.__name__, kind, (kind,))
    functions["range"] = Function("range", limited_range(range), (range,))
    return {**functions, "True": True, "False": False}


def math_names() -> dict[str, Any]:
    """What stands behind `math.`."""
    found: dict[str, Any] = {}
    for name, value in vars(math).items():
        if not name.startswith("_"):
            found[name] = Function(name, value) if callable(value) else value
    for name in ("factorial", "comb", "perm"):
        found[name] = Function(name, _of_small(getattr(math, name)))
    for name in ("prod", "lcm", "sumprod"):
        found.pop(name, None)  # products of any size
    found["prod"] = Function("prod", _product)
    return found


def global_names(
    budget: Budget, xacro_names: Mapping[str, Any], warn: Callable[[str], Any]
) -> dict[str, Any]:
    """All names: those of xacro and Python with their prefix, and without.

    Args:
        budget: The steps that functions may take.
        xacro_names: What stands behind `xacro.`.
        warn: Told of names that xacro no longer wants without a prefix.
    """
    python, mathematics = python_names(budget), math_names()
    old = {name: _warning(python[name], "python", warn) for name in _OLD_PYTHON}
    old |= {name: _warning(xacro_names[name], "xacro", warn) for name in _OLD_XACRO}
    return {
        **{name: python[name] for name in _EVERYWHERE},
        **mathematics,
        **old,
        "python": Namespace("python", python),
        "math": Namespace("math", mathematics),
        "xacro": Namespace("xacro", xacro_names),
    }


def _warning(function: Function, owner: str, warn: Callable[[str], Any]) -> Function:
    name = function.name

    def warned(*given: Any, **named: Any) -> Any:
        warn(f"Using {name}() directly is deprecated. Use {owner}.{name}() instead.")
        return function.call(*given, **named)

    return Function(name, warned, function.kind)


def _by_key(
    function: Callable[..., Any], apply: Callable[..., Any]
) -> Callable[..., Any]:
    """`sorted`, `min` or `max` whose key is a function of an expression."""

    def chosen(*items: Any, key: Any = None, **more: Any) -> Any:
        by = None if key is None else (lambda item: apply(key, item))
        return function(*items, key=by, **more)

    return chosen


def _isinstance(value: Any, kinds: Any) -> bool:
    asked = kinds if isinstance(kinds, tuple) else (kinds,)
    if not all(isinstance(kind, Function) and kind.kind for kind in asked):
        raise ExpressionError("isinstance asks for types")
    return any(isinstance(value, kind.kind) for kind in asked)


def _type(value: Any) -> Function:
    kind = type(value)
    for known in (bool, int, float, str, list, tuple, dict, set):
        if issubclass(kind, known):
            return Function(known.__name__, known, (known,))
    raise ExpressionError(f"the type {kind.__name__} is not allowed")


def _sum(items: Iterable[Any], start: Any = 0) -> Any:
    total = start
    for item in items:
        if isinstance(item, list | tuple | str):
            raise ExpressionError("sum adds numbers")
        total += item
    return total


def _product(items: Iterable[Any], start: Any = 1) -> Any:
    for item in items:
        start = OPERATORS["Mult"](start, item)
        if isinstance(start, str | list | tuple):
            raise ExpressionError("prod multiplies numbers")
    return start


def _round(value: Any, digits: Any = None) -> Any:
    if isinstance(digits, int) and abs(digits) > MAX_DIGITS:
        raise ExpressionError(f"round to {digits} digits is not allowed")
    return round(value, digits)


def _of_small(function: Callable[..., int]) -> Callable[..., int]:
    def asked(*numbers: Any) -> int:
        if any(isinstance(n, int) and n > MAX_WHOLE for n in numbers):
            raise ExpressionError(f"a whole number over {MAX_WHOLE} is not allowed")
        return function(*numbers)

    return asked
