"""What values an expression may have, and how large they may grow.

An expression in a stranger's file is a program. Its values are numbers, texts and
collections of them; each step costs a little of a budget, and a value whose making
would fill the memory is refused before it is made.
"""

import operator
import re
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any

MAX_STEPS = 300_000  # of one expansion, half a second; the PR2 takes 3,000
MAX_SIZE = 250_000  # letters and entries in a value, those within it counted
MAX_BITS = 8_000  # of a whole number; 2,400 digits
MAX_DEPTH = 50  # of lists in lists
MAX_KEY = 2**61 - 1  # from here on whole numbers share their hashes
MAX_FIELD_DIGITS = 3  # of a width or precision in a format

_COLLECTIONS = (list, tuple, dict, set, frozenset)
_LIGHT = frozenset({bool, float, type(None)})  # of these nothing is to be asked
_PLAIN = (bool, int, float, complex, str, type(None), range, slice)
_FIELD = re.compile(r"%[-+ #0]*(\d*)(?:\.(\d*))?([a-zA-Z%]?)")


class ExpressionError(Exception):
    """An expression that is not evaluated, and why."""


@dataclass(frozen=True)
class Function:
    """A function that an expression may call.

    Attributes:
        name: What it is called.
        call: What is done.
        kind: The types it makes, for `isinstance`; empty if it is no type.
    """

    name: str
    call: Callable[..., Any]
    kind: tuple[type, ...] = ()

    def __repr__(self) -> str:
        return f"<function {self.name}>"


@dataclass(frozen=True)
class Namespace:
    """Names behind a dot: `math.pi`."""

    name: str
    names: Mapping[str, Any]

    def __repr__(self) -> str:
        return f"<namespace {self.name}>"


@dataclass
class Budget:
    """Steps that are left to an expansion."""

    steps: int = MAX_STEPS

    def spend(self, steps: int = 1) -> None:
        """Takes steps away.

        Raises:
            ExpressionError: None are left.
        """
        self.steps -= steps
        if self.steps < 0:
            raise ExpressionError(f"the expressions take more than {MAX_STEPS} steps")


@dataclass
class Scale:
    """Weighs values; what is within several values is weighed once."""

    budget: Budget
    known: dict[int, int] = field(default_factory=dict)

    def size(self, value: Any, depth: int = 0) -> int:
        """Letters and entries of a value, as if nothing in it were shared.

        Raises:
            ExpressionError: Too large, nested too deeply, or no value.
        """
        if isinstance(value, str):
            return 1 + len(value)
        if not isinstance(value, _COLLECTIONS):
            check_kind(value)
            if isinstance(value, int) and abs(value) >= MAX_KEY:
                raise ExpressionError("too large a number in a collection")
            return 1
        if id(value) not in self.known:
            self.known[id(value)] = self._size_of_all(value, depth)
        return self.known[id(value)]

    def _size_of_all(self, value: Any, depth: int) -> int:
        if depth > MAX_DEPTH:
            raise ExpressionError(f"lists within lists, deeper than {MAX_DEPTH}")
        self.budget.spend(1 + len(value) // 4)
        if isinstance(value, dict):
            items: Iterable[Any] = (*value, *value.values())
        else:
            items = value
        total = 1
        for item in items:
            total += self.size(item, depth + 1)
            _refuse_size(total)
        return total


def weigh(value: Any, budget: Budget) -> None:
    """Pays for what an operation on a value may cost.

    Raises:
        ExpressionError: It is no value, too large, or the budget is spent.
    """
    if type(value) in _LIGHT or type(value) is int:
        return
    if isinstance(value, str):
        _refuse_size(len(value))
        budget.spend(len(value) // 64)
    elif isinstance(value, range):
        budget.spend(len(value) // 64)
    elif isinstance(value, _COLLECTIONS):
        budget.spend(Scale(budget).size(value) // 16)


def checked(value: Any, budget: Budget) -> Any:
    """The value, if it is one and not too large.

    Raises:
        ExpressionError: It is neither.
    """
    if type(value) in _LIGHT:
        return value
    check_kind(value)
    if isinstance(value, int) and value.bit_length() > MAX_BITS:
        raise ExpressionError(f"a number of more than {MAX_BITS} bits")
    weigh(value, budget)
    return value


def call(
    function: Any, given: Iterable[Any], named: Mapping[str, Any], budget: Budget
) -> Any:
    """What a function of an expression gives.

    Raises:
        ExpressionError: It is no function, or what it takes or gives is too large.
    """
    if not isinstance(function, Function):
        raise ExpressionError(f"{type(function).__name__} cannot be called")
    budget.spend()
    given = tuple(given)
    for value in (*given, *named.values()):
        weigh(value, budget)
    return checked(function.call(*given, **named), budget)


def check_kind(value: Any) -> None:
    """Whether a value is a number, a text, a collection or something to call.

    Raises:
        ExpressionError: It is anything else.
    """
    if not isinstance(value, (*_PLAIN, *_COLLECTIONS, Function, Namespace)):
        raise ExpressionError(f"a value of type {type(value).__name__}")


def _refuse_size(size: int) -> None:
    if size > MAX_SIZE:
        raise ExpressionError(f"a value is larger than {MAX_SIZE} letters or entries")


def _times(a: Any, b: Any) -> Any:
    for sequence, count in ((a, b), (b, a)):
        if isinstance(sequence, str | list | tuple) and isinstance(count, int):
            _refuse_size(len(sequence) * max(count, 0))
    if isinstance(a, int) and isinstance(b, int):
        _refuse_bits(a.bit_length() + b.bit_length())
    return a * b


def _power(a: Any, b: Any) -> Any:
    if isinstance(a, int) and isinstance(b, int) and b > 0:
        _refuse_bits(a.bit_length() * b)
    return a**b


def _shifted(a: Any, b: Any) -> Any:
    if isinstance(a, int) and isinstance(b, int) and b > 0:
        _refuse_bits(a.bit_length() + b)
    return a << b


def _refuse_bits(bits: int) -> None:
    if bits > MAX_BITS:
        raise ExpressionError(
            f"the exponent or factor is not allowed: a number of more than {MAX_BITS} "
            "bits"
        )


def _remainder(a: Any, b: Any) -> Any:
    if not isinstance(a, str):
        return a % b
    for width, precision, letter in _FIELD.findall(a):
        is_short = len(width) <= MAX_FIELD_DIGITS >= len(precision)
        if letter == "" or not is_short:  # by name or by *: any size, any number
            raise ExpressionError(f"the format {a[:80]!r} is not allowed")
    return a % b


OPERATORS: Mapping[str, Callable[[Any, Any], Any]] = {
    "Add": operator.add,
    "Sub": operator.sub,
    "Mult": _times,
    "Div": operator.truediv,
    "FloorDiv": operator.floordiv,
    "Mod": _remainder,
    "Pow": _power,
    "LShift": _shifted,
    "RShift": operator.rshift,
    "BitOr": operator.or_,
    "BitAnd": operator.and_,
    "BitXor": operator.xor,
}

COMPARISONS: Mapping[str, Callable[[Any, Any], bool]] = {
    "Eq": operator.eq,
    "NotEq": operator.ne,
    "Lt": operator.lt,
    "LtE": operator.le,
    "Gt": operator.gt,
    "GtE": operator.ge,
    "Is": operator.is_,
    "IsNot": operator.is_not,
    "In": lambda a, b: a in b,
    "NotIn": lambda a, b: a not in b,
}

SIGNS: Mapping[str, Callable[[Any], Any]] = {
    "UAdd": operator.pos,
    "USub": operator.neg,
    "Not": operator.not_,
    "Invert": operator.invert,
}
